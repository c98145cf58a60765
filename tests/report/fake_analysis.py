"""A made-up but realistic analysis: the model's numbers with scatter."""

import random
from dataclasses import replace

from rig.analysis.comparison import Difference
from rig.analysis.result import Audit, DropResult, Measured
from rig.analysis.session import Analysis
from rig.analysis.summary import Incline, summarize
from rig.predictions import predictions
from rig.protocol.protocol import Condition, Run
from rig.units import Quantity
from tests.sim.falls import UNIFORM

MODEL = {
    one.incline_deg: (one.separation_m, one.speed_m_s)
    for one in predictions(UNIFORM)
    if one.incline_deg not in {50.0, 70.0}
}


def analysis(runs: list[DropResult], summary: list[Incline]) -> Analysis:
    return Analysis(tuple(runs), (), tuple(summary))


EMPTY = analysis([], [])


def two_chains(seed: int = 1, repeats: int = 12) -> Analysis:
    rng = random.Random(seed)
    runs: list[DropResult] = []
    inclines = list(MODEL)
    rng.shuffle(inclines)
    for incline in inclines:
        separation, speed = MODEL[incline]
        for repeat in range(repeats):
            number = len(runs) + 1
            skew = rng.gauss(0.0008, 0.002)
            dz = separation + 0.0008 + rng.gauss(0, 0.0022)
            void = abs(skew) > 0.0049 or number == 33
            impact, free = ("A", "B") if repeat % 4 in (0, 3) else ("B", "A")
            runs.append(
                DropResult(
                    Run(number, incline, impact, free),
                    1,
                    "void" if void else "accepted",
                    ("release skew 5.3 ms is beyond 5 ms",) if void else (),
                    Audit(226, 225, 1, 0, 0),
                    {
                        "separation_m": Measured(dz, 0.0011),
                        "separation_raw_m": Measured(dz - 4.9 * skew, 0.0009),
                        "speed_m_s": Measured(speed + rng.gauss(0, 0.05), 0.02),
                        "release_skew_s": Measured(skew, 0.0002),
                    },
                )
            )
    return analysis(runs, summarize(UNIFORM, runs))


def compared(line: Incline) -> Incline:
    """Set means beside predictions that have nothing in common with them."""
    both = line.means.keys() & line.predicted.keys()
    off = {
        name: line.means[name].less(Measured(model.value, model.u))
        for name, model in line.predicted.items()
        if name in both
    }
    return replace(
        line,
        differences={
            name: Difference(one.value, one.u, condition=line.condition, n=line.n)
            for name, one in off.items()
        },
    )


def measured(one: DropResult, **quantities: Measured) -> DropResult:
    """Let a drop have measured something else."""
    return replace(one, quantities={**one.quantities, **quantities})


def gravity(seed: int = 3) -> Analysis:
    rng = random.Random(seed)
    runs = [
        DropResult(
            Run(number, 0.0, None, None),
            1,
            "accepted",
            (),
            Audit(50, 50, 0, 0, 0),
            {"gravity_m_s2": Measured(9.8185 + rng.gauss(0, 0.004), 0.0035)},
        )
        for number in range(1, 11)
    ]
    mean, model = Measured(9.8188, 0.0014), Quantity(9.8201)
    line = Incline(Condition(0.0), 10, {"gravity_m_s2": mean}, {}, {"gravity_m_s2": model})
    return analysis(runs, [compared(line)])
