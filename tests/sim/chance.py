"""Many drops of the simulated lab, and what chance allows of them."""

import math
from dataclasses import asdict, replace

import numpy as np

from rig.link.messages import pack_label
from sim.dials import Dials
from sim.lab import ChainLab
from sim.truth import Truth
from tests.sim.falls import UNIFORM

SIGMAS = 5.0
"""A right simulation fails one such check in two million."""
FREE = {gate.channel for gate in UNIFORM.gates.on("free")}
RUN_40 = next(n for n, run in ChainLab(UNIFORM, Dials(), 0).runs.items() if run.incline_deg == 40)
A_STRIKES, B_STRIKES = RUN_40, RUN_40 + 1  # ABBA
FEW_GATES = replace(
    UNIFORM,
    gates=replace(
        UNIFORM.gates, gates=tuple(g for g in UNIFORM.gates.gates if g.channel in {4, 12})
    ),
)
"""One gate a side, above the bottom rod: for many drops in a short time."""


def with_dials(**changes: float) -> Dials:
    """All is quiet but these."""
    return Dials(**(asdict(Dials.quiet()) | changes))


def truths(dials: Dials, seed: int, *drops: tuple[int, int], protocol=UNIFORM) -> list[Truth]:
    """Ask for drops by run and attempt."""
    told: list[Truth] = []
    lab = ChainLab(protocol, dials, seed, told.append)
    for run, attempt in drops:
        lab.drop(pack_label(run, attempt))
    return told


def attempts(dials: Dials, n: int, protocol=UNIFORM) -> list[Truth]:
    """Drop the chains many times in the same run at 40°."""
    return truths(dials, 1, *((RUN_40, i) for i in range(1, n + 1)), protocol=protocol)


def assert_binomial(count: float, n: int, share: float) -> None:
    """Hold a count to what chance allows."""
    assert abs(count - n * share) <= SIGMAS * math.sqrt(n * share * (1 - share))


def assert_normal(draws, sd: float) -> None:
    """Mean 0 and the stated scatter, as far as so many draws can tell."""
    x = np.array(draws) / sd
    assert x.size >= 200
    assert abs(x.mean()) < SIGMAS / math.sqrt(x.size)
    assert abs((x**2).mean() - 1) < SIGMAS * math.sqrt(2 / x.size)
