"""β, μ and the pile's β by least squares on the edges, where these can tell them."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Self

from rig.estimate.hypotheses import by_model, given_alphas, with_nuisances
from rig.estimate.hypothesis_fit import HypothesisFit, Parameter, fit
from rig.estimate.quadratic_forms import QuadraticForm
from rig.model.chain import Chain
from rig.model.impact import ALPHA, BETA, MU, PILE, impact_on, stated_coefficients
from rig.protocol.protocol import Protocol
from rig.reasons import make_reason
from rig.units import Quantity

KNOWN = 0.2
"""A coefficient less sure than this is not identified: all of them are within about one."""
FOUND = 0.5
"""Standard uncertainty of a found nuisance, at most, in units of the prior's or of its value."""


class CoefficientProblem(NamedTuple):
    """What there is to be estimated.

    What the edges tell is fitted, whatever the protocol says of it. What they do not tell is held
    by its stated uncertainty; without one it is exact, which is no parameter, and leaves the fit.

    Attributes
    ----------
    forms
        Of like drops, added up; only those that the model describes.
    stated
        What the protocol says of each coefficient that is fitted, by name.
    held
        Names of those that the edges do not tell.
    left_out
        Sentences on what is not fitted, and why.
    """

    forms: tuple[QuadraticForm, ...]
    stated: dict[str, Quantity]
    held: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Coefficients that the edges tell, and those they do not, these with a prior."""
        return tuple(
            Parameter(name, stated.value, (stated.value, stated.u) if name in self.held else None)
            for name, stated in self.stated.items()
        )

    @property
    def inclines(self) -> list[float]:
        """Inclines that the model describes, ascending."""
        return sorted({form.run.incline_deg for form in self.forms})

    def hold(self, held: Mapping[str, float]) -> Self:
        """Hold coefficients within these uncertainties; one that is exact leaves the fit."""
        stated = {name: q for name, q in self.stated.items() if held.get(name) != 0.0}
        return self._replace(stated=stated, held=tuple(name for name in held if name in stated))


def coefficient_problem(protocol: Protocol, forms: Sequence[QuadraticForm]) -> CoefficientProblem:
    """Find out what drops at these inclines can tell.

    Parameters
    ----------
    forms
        Of like drops, see `rig.estimate.quadratic_forms.merge_like`.
    """
    stated: dict[str, Quantity] = {}
    left_out, in_model = [], []
    for form in sorted(forms, key=lambda form: form.run.incline_deg):
        depends_on, notes = coefficients_of(protocol, form.chain, form.run.incline_deg)
        stated |= depends_on
        if depends_on:
            in_model.append(form)
        else:
            at = {"incline_deg": form.run.incline_deg, "notes": "; ".join(notes)}
            left_out.append(make_reason("incline_without_coefficient", **at).text)
    problem = CoefficientProblem(tuple(in_model), stated)

    def uncertainties(held: Mapping[str, float]) -> dict[str, float]:
        candidate = problem.hold(held)
        outcome = best(protocol, candidate)
        return {name: outcome[name].u for name in candidate.stated}

    held = held_back(stated, uncertainties)
    inclines = ", ".join(f"{incline:g}°" for incline in problem.inclines)
    for name, u in held.items():
        values = {"coefficient": words(name), "value": stated[name].value, "u": u}
        code = "coefficient_held" if u else "coefficient_exact"
        left_out.append(make_reason(code, inclines=inclines, **values).text)
    return problem.hold(held)._replace(left_out=tuple(dict.fromkeys(left_out)))


def coefficients_of(
    protocol: Protocol, chain: Chain, incline_deg: float
) -> tuple[dict[str, Quantity], Sequence[str]]:
    """Return the protocol's coefficients that a drop depends on by the model, by name.

    Where the model does not describe it there are none, but sentences that say why.
    """
    assert protocol.surface is not None
    scene = protocol.surface, chain, incline_deg
    if chain.alpha is None and (notes := impact_on(*scene).notes):
        return {}, notes
    own = {ALPHA: given_alphas(protocol).get(chain, ALPHA)}
    return {own.get(name, name): stated for name, stated in stated_coefficients(*scene).items()}, ()


def words(name: str) -> str:
    """Write a coefficient's name for people."""
    coefficient, _, chain = name.partition(" ")
    return coefficient.replace("_", " ") + (f" of chain {chain}" if chain else "")


def held_back(
    stated: Mapping[str, Quantity],
    uncertainties: Callable[[Mapping[str, float]], Mapping[str, float]],
) -> dict[str, float]:
    """Choose the coefficients to hold, one after the other, until the edges tell the others.

    μ is held first, and then β, where the edges do not tell them apart.

    Parameters
    ----------
    uncertainties
        Of all coefficients, with some held within what is stated of them.

    Returns
    -------
    dict
        Stated uncertainties of those that are held, 0 for what is exact.
    """
    held: dict[str, float] = {}
    models = [name for name in (MU, BETA, PILE) if name in stated]
    for name in [*models, *(name for name in stated if name not in models)]:
        unsure = {coefficient for coefficient, u in uncertainties(held).items() if u > KNOWN}
        if not unsure:
            break
        if name != MU or unsure & {MU, BETA}:
            held[name] = stated[name].u
    return held


def best(
    protocol: Protocol, problem: CoefficientProblem, parameters: Sequence[Parameter] = ()
) -> HypothesisFit:
    """Fit the coefficients, or these parameters instead of theirs, with all nuisances."""
    supposed = by_model(protocol, parameters or problem.parameters)
    return fit(problem.forms, with_nuisances(supposed, problem.inclines, protocol))
