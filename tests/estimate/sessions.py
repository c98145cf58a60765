"""Short sessions over several inclines, with coefficients that are not the protocol's."""

from functools import cache

from rig.analysis.session import Analysis
from rig.analysis.unknowns import SharedUnknowns
from rig.estimate.quadratic_forms import QuadraticForm, quadratic_form
from sim.dials import Dials
from tests.analysis.drops import SCENES
from tests.analysis.sessions import analysis as analyzed
from tests.analysis.sessions import cases

BETA, MU = 0.42, 0.26
DIALS = Dials(skew_sd=1e-3, restitution=BETA, friction=MU)


@cache
def analysis(
    inclines: tuple[float, ...], each: int = 2, seed: int = 1, dials: Dials = DIALS
) -> Analysis:
    """So many drops at each of these inclines, half of them with either chain."""
    planned = SCENES["uniform"].runs()
    numbers = tuple(
        run.number
        for incline in inclines
        for run in [one for one in planned if one.incline_deg == incline][:each]
    )
    return analyzed(cases(numbers, dials, seed))


@cache
def forms(inclines: tuple[float, ...], each: int = 2, seed: int = 1) -> tuple[QuadraticForm, ...]:
    found = analysis(inclines, each, seed)
    by_number = {run.number: run for run in SCENES["uniform"].runs()}
    shared = SharedUnknowns(drop.model for drop in found.adjusted.values())
    return tuple(
        quadratic_form(by_number[run], drop, shared) for (run, _), drop in found.adjusted.items()
    )
