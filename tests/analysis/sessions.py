"""Whole sessions straight from the simulated lab, and what they say together."""

from collections.abc import Iterable
from functools import cache
from typing import Any

from rig.analysis.fit import Fit
from rig.analysis.joint_fit import JointFit, joint_fit
from rig.analysis.session import Analysis, analyze
from rig.protocol.protocol import Protocol
from sim.dials import Dials
from tests.analysis.drops import SCENES, Case, case

MILD = Dials(skew_sd=1e-3)  # no drop is void for its skew


@cache
def cases(
    runs: tuple[int, ...], dials: Dials = MILD, seed: int = 1, scene: str = "uniform"
) -> list[Case]:
    return [case(SCENES[scene], dials, seed=seed, run=run) for run in runs]


def fits(drops: Iterable[Case]) -> list[Fit]:
    """Each drop by itself."""
    found = [one.read() for one in drops]
    assert all(result.verdict == "accepted" for result, _ in found)
    return [fit for _, fit in found if fit is not None]


@cache
def fit_session(
    runs: tuple[int, ...], dials: Dials = MILD, seed: int = 1, scene: str = "uniform"
) -> JointFit:
    return joint_fit(fits(cases(runs, dials, seed, scene)))


def analysis(drops: list[Case], protocol: Protocol | None = None, *more: Any) -> Analysis:
    """What drops say together, by their own protocol or by another one."""
    stated, scale = protocol or drops[0].protocol, drops[0].scale
    return analyze(stated, [one.drop for one in drops], lambda _: scale, *more)
