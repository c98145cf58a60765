"""A made-up but realistic analysis: the model's numbers with scatter."""

import random
from dataclasses import replace

from rig.analysis.comparison import Difference
from rig.analysis.result import DropResult, Measured
from rig.analysis.session import Analysis
from rig.analysis.summary import Incline, summarize
from rig.predictions import predictions
from rig.protocol.protocol import Condition, Run
from rig.units import Quantity
from tests.analysis.drops import UNIFORM, made_up

MODEL = {
    one.incline_deg: (one.separation_m, one.speed_m_s)
    for one in predictions(UNIFORM)
    if one.incline_deg not in {50.0, 70.0}
}


def analysis(drops: list[DropResult], summary: list[Incline]) -> Analysis:
    return Analysis(tuple(drops), (), tuple(summary))


EMPTY = analysis([], [])


def two_chains() -> Analysis:
    rng = random.Random(1)
    plan = replace(UNIFORM.plan, inclines=tuple(MODEL))
    drops = []
    for run in replace(UNIFORM, plan=plan).runs():
        separation, speed = MODEL[run.incline_deg]
        skew = rng.gauss(0.0008, 0.002)
        dz = separation + 0.0008 + rng.gauss(0, 0.0022)
        drops.append(
            made_up(
                run,
                "void" if abs(skew) > 0.0049 or run.number == 33 else "accepted",
                separation_m=Measured(dz, 0.0011),
                separation_raw_m=Measured(dz - 4.9 * skew, 0.0009),
                speed_m_s=Measured(speed + rng.gauss(0, 0.05), 0.02),
                release_skew_s=Measured(skew, 0.0002),
            )
        )
    return analysis(drops, summarize(UNIFORM, drops))


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


def gravity() -> Analysis:
    rng = random.Random(3)
    drops = [
        made_up(
            Run(number, 0.0, None, None),
            gravity_m_s2=Measured(9.8185 + rng.gauss(0, 0.004), 0.0035),
        )
        for number in range(1, 11)
    ]
    mean, model = Measured(9.8188, 0.0014), Quantity(9.8201)
    line = Incline(Condition(0.0), 10, {"gravity_m_s2": mean}, {}, {"gravity_m_s2": model})
    return analysis(drops, [compared(line)])
