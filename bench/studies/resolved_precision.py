"""Error against processor time of the resolved world, and what its stiffness costs.

Chains of three rods, which do not touch each other: longer falls are chaotic, and no step makes a
single one exact. A tilt that differs by 1 nrad moves Δz of three rods by up to 0.1 nm, of five by
0.3 µm, of eight by 0.6 mm. Of 25 rods only means over falls are compared. An error is the median
over inclines: where another end of a rod strikes first, a single Δz jumps.
"""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from functools import partial
from statistics import fmean, median, stdev
from time import process_time
from typing import TYPE_CHECKING

import numpy as np

from bench.studies import resolved_chain as paper
from bench.studies.integrators import euler, runge_kutta, strike
from rig.bench.references import DIGITS
from rig.bench.work import Answer, Method, WorkProblem
from sim.resolved.fall import fall
from sim.resolved.scene import Strings

if TYPE_CHECKING:
    from bench.studies.integrators import Follow
    from sim.resolved.scene import Chain

RODS = 3
INCLINES = (45.0, 50.0, 55.0, 60.0, 65.0, 70.0)
TOUCH_S = 0.2e-3
STEPS_S = (1.6e-5, 1e-5, 6e-6, 3e-6, 1.5e-6)
FINEST_S = 4e-7
STIFF_S = (1.6e-3, 0.8e-3, 0.4e-3, 0.2e-3, 0.1e-3, 0.05e-3)
"""Of touches; the reference has a quarter of the last."""
STEPS_A_TOUCH = 80
MANY, MANY_INCLINE = 25, 50.0
MANY_STEPS_S = (2e-5, 1e-5, 5e-6)


def chains(touch_s: float = TOUCH_S) -> list[Chain]:
    """Hang the paper's first rods for each incline; strings ring as long as touches last."""
    rng = np.random.default_rng(1)
    strings = Strings(strain_at_break=Strings().strain_at_break * (touch_s / TOUCH_S) ** 2)
    hung = (
        paper.paper_chain(incline, rng, rods=RODS, touch_s=touch_s, touching=False)
        for incline in INCLINES
    )
    return [replace(chain, strings=strings) for chain in hung]


def separation(chain: Chain, step_s: float, follow: Follow | None = None) -> float:
    """Return Δz at the strike, m; without `follow` by the world's own leapfrog."""
    if follow is None:
        end = fall(chain, step=step_s, after=0.0)
        when, height = end.strike_s, float(end.touched_height[-1])
    else:
        when, height = strike(chain, follow, step_s)
    top = chain.start + float(chain.rods.heights[-1])
    return top - 0.5 * chain.gravity * when**2 - height


def problems() -> list[WorkProblem]:
    """Return what its step and its stiffness are chosen by."""
    hung = chains()
    exact = [separation(chain, FINEST_S) for chain in hung]
    by_other = _error([separation(chain, 2.0 * FINEST_S, runge_kutta) for chain in hung], exact)

    def by(follow: Follow | None, step_s: float) -> Answer:
        return _answer([separation(chain, step_s, follow) for chain in hung], exact)

    def touching(touch_s: float) -> list[float]:
        return [separation(chain, touch_s / STEPS_A_TOUCH) for chain in chains(touch_s)]

    stiffest = touching(STIFF_S[-1] / 4.0)
    next_stiff = _error(touching(STIFF_S[-1] / 2.0), stiffest)
    inclines = f"{len(INCLINES)} falls of {RODS} rods"
    return [
        WorkProblem(
            "step", f"{inclines}, by step", {}, partial(_one, by_other),
            f"steps of {FINEST_S:.0e} s, beside Runge and Kutta",
            tuple(
                Method(name, STEPS_S, "step {:.1e} s", lambda step, follow=follow: by(follow, step))  # type: ignore[misc]
                for name, follow in (
                    ("leapfrog (sim)", None), ("Euler", euler), ("Runge and Kutta", runge_kutta),
                )
            ),
        ),
        WorkProblem(
            "stiff", f"{inclines}, by stiffness", {}, partial(_one, next_stiff),
            "touches and strings four times as short, beside twice",
            (Method("touches and strings (sim)", STIFF_S, "touch {:.1e} s",
                    lambda touch_s: _answer(touching(touch_s), stiffest)),),
        ),
    ]  # fmt: skip


def ensembles(falls: int) -> list[dict[str, float]]:
    """Return the mean Δz of 25 rods with its standard error, m, and a fall's time, by step."""
    found = []
    for step_s in MANY_STEPS_S:
        rng = np.random.default_rng(5)
        hung = [paper.paper_chain(MANY_INCLINE, rng, rods=MANY) for _ in range(falls)]
        begin = process_time()
        values = [separation(chain, step_s) for chain in hung]
        spent = (process_time() - begin) / falls
        found.append({
            "step_s": step_s, "mean_m": fmean(values), "se_m": stdev(values) / falls**0.5,
            "falls": falls, "cpu_s": spent,
        })  # fmt: skip
    return found


def _one(error: float, digits: int = DIGITS) -> dict[str, Decimal]:
    """Return the true share of Δz; with more digits than there are, as far off as is known."""
    return {"separation": Decimal(1.0 + (error if digits > DIGITS else 0.0))}


def _answer(values: list[float], exact: list[float]) -> Answer:
    """Return how far falls are from the exact ones, as a number that should be 1."""
    return Answer({"separation": 1.0 + _error(values, exact)}, len(values))


def _error(values: list[float], exact: list[float]) -> float:
    return median(abs(value / true - 1.0) for value, true in zip(values, exact, strict=True))
