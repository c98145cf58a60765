"""A made-up but realistic analysis: the numbers of the reference table with scatter."""

import math
import random
from dataclasses import replace
from typing import Any

from rig.analysis.comparison import Difference
from rig.analysis.result import Audit, DropResult, Measured
from rig.analysis.session import Analysis
from rig.analysis.summary import Incline
from rig.protocol.protocol import Run
from rig.units import Quantity

MODEL = {
    0.0: (0.0801755, 6.2857635),
    10.0: (0.0801755, 6.2857635),
    20.0: (0.0801755, 6.2857635),
    30.0: (0.1445578, 7.5511642),
    40.0: (0.1154681, 6.9327597),
    60.0: (0.0535856, 5.8609488),
    80.0: (0.0098142, 5.2579813),
}


def analysis(runs: list[DropResult], summary: list[Incline]) -> Analysis:
    return Analysis(tuple(runs), (), tuple(summary))


EMPTY = analysis([], [])


def two_chains(seed: int = 1, repeats: int = 12) -> Analysis:
    rng = random.Random(seed)
    runs: list[DropResult] = []
    summary: list[Incline] = []
    inclines = list(MODEL)
    rng.shuffle(inclines)
    for incline in inclines:
        separation, speed = MODEL[incline]
        values = []
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
            if not void:
                values.append(dz)
        mean = sum(values) / len(values)
        sd = math.sqrt(sum((value - mean) ** 2 for value in values) / (len(values) - 1))
        summary.append(
            compared(
                Incline(
                    incline,
                    len(values),
                    {
                        "separation_m": Measured(mean, sd / math.sqrt(len(values))),
                        "speed_m_s": Measured(speed + rng.gauss(0, 0.03), 0.03),
                    },
                    {"separation_m": sd},
                    {"separation_m": Quantity(separation), "speed_m_s": Quantity(speed)},
                )
            )
        )
    summary.sort(key=lambda line: line.incline_deg)
    return analysis(runs, summary)


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


def without(found: Analysis, *names: str) -> Analysis:
    """Let a session have measured less."""

    def rest(some: Any) -> dict[str, Any]:
        return {name: value for name, value in some.items() if name not in names}

    return analysis(
        [replace(one, quantities=rest(one.quantities)) for one in found.runs],
        [
            compared(replace(line, means=rest(line.means), predicted=rest(line.predicted)))
            for line in found.summary
        ],
    )


def curves() -> dict[str, Any]:
    def alpha(theta: float) -> float:
        t = math.radians(theta)
        tilt = (1 - 0.2 / math.tan(t)) / (1 + 0.2 * math.tan(t))
        g = math.cos(t) ** 2 + math.sin(t) ** 2 * 4 / 3 * tilt
        return 0.25 * math.cos(t) ** 2 / g

    inclines = [0.0, 30.0, *map(float, range(30, 86))]
    segments = ["pile"] * 2 + ["surface"] * 56
    points = [(0.0801755, 6.2857635)] * 2
    points += [
        (0.73 * alpha(t) + 0.001, 5.1366 + 11.5 * alpha(t)) for t in map(float, range(30, 86))
    ]
    return {
        "incline_deg": inclines,
        "separation_m": [point[0] for point in points],
        "speed_m_s": [point[1] for point in points],
        "segments": segments,
        "separation_U95_m": [0.004] * len(points),
        "speed_U95_m_s": [0.08] * len(points),
        "free_fall_speed_m_s": 5.1366,
    }


def single_chain() -> Analysis:
    """One chain that strikes."""
    found = without(two_chains(repeats=4), "separation_m", "separation_raw_m", "release_skew_s")
    runs = [replace(one, run=replace(one.run, impact="A", free=None)) for one in found.runs]
    return replace(found, runs=tuple(runs))


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
    line = Incline(0.0, 10, {"gravity_m_s2": mean}, {}, {"gravity_m_s2": model})
    return analysis(runs, [compared(line)])
