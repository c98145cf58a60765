"""β, μ and the pile's β by least squares on the edges, where these can tell them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.drop_model import prior_air
from rig.estimate.hypotheses import ALPHA, BETA, MU, PILE, coefficients, with_contact, with_drag
from rig.estimate.hypothesis_fit import Hypothesis, HypothesisFit, Parameter, fit
from rig.model.impact import impact_on

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rig.arrays import Array
    from rig.estimate.quadratic_forms import QuadraticForm
    from rig.model.chain import Chain
    from rig.protocol.protocol import Protocol
    from rig.units import Quantity

CONTACT_U = 1e-3
"""How far the contact point may move when the board is inclined anew, m."""
KNOWN = 0.2
"""A coefficient less sure than this is not identified: all of them are within about one."""
FOUND = 0.5
"""Share of its prior uncertainty that a nuisance must lose to the edges to count as found."""


@dataclass(frozen=True, slots=True)
class CoefficientProblem:
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
    left_out: tuple[str, ...]
    held: tuple[str, ...] = ()

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


def coefficient_problem(protocol: Protocol, forms: Sequence[QuadraticForm]) -> CoefficientProblem:
    """Find out what drops at these inclines can tell.

    Parameters
    ----------
    forms
        Of like drops, see `rig.estimate.quadratic_forms.merged`.
    """
    ordered = sorted(forms, key=lambda form: form.run.incline_deg)
    in_model, stated, left_out = described(
        protocol, [(form.chain, form.run.incline_deg) for form in ordered]
    )
    informative = tuple(form for form, fits in zip(ordered, in_model, strict=True) if fits)
    problem = CoefficientProblem(informative, stated, tuple(left_out))
    return _hold_unknown(protocol, problem) if informative else problem


def described(
    protocol: Protocol, drops: Sequence[tuple[Chain, float]]
) -> tuple[list[bool], dict[str, Quantity], list[str]]:
    """Find the coefficients that drops of these chains at these inclines depend on.

    Returns
    -------
    kept, stated, left_out
        Whether the model describes each; the protocol's coefficients by name; and sentences on
        inclines outside its domain.
    """
    surface = protocol.surface
    assert surface is not None
    stated: dict[str, Quantity] = {}
    left_out: list[str] = []
    in_model = []
    alpha_names = given_alphas(protocol)
    for chain, incline in drops:
        impact = impact_on(surface, chain, incline)
        in_model.append(impact.basis == "given" or not impact.notes)
        if not in_model[-1]:
            sentence = f"{incline:g}° tells no coefficient: {'; '.join(impact.notes)}"
            left_out += [sentence] if sentence not in left_out else []
        elif chain.alpha is not None:
            stated[alpha_names[chain]] = chain.alpha
        elif impact.basis == "pile" and surface.pile is not None:
            stated[PILE] = surface.pile.restitution
        else:
            stated[BETA] = surface.restitution
            if impact.basis == "surface":
                stated[MU] = surface.friction
    return in_model, stated, left_out


def given_alphas(protocol: Protocol) -> dict[Chain, str]:
    """Name the α of each chain whose α is simply given; like chains have one."""
    chains = {rods.chain: rods.name for rods in protocol.chains.values() if rods.chain.alpha}
    return {chain: ALPHA if len(chains) == 1 else f"{ALPHA} {chains[chain]}" for chain in chains}


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


def _hold_unknown(protocol: Protocol, problem: CoefficientProblem) -> CoefficientProblem:
    """Hold what the edges do not tell."""

    def holding(held: Mapping[str, float]) -> CoefficientProblem:
        stated = {name: q for name, q in problem.stated.items() if held.get(name) != 0.0}
        return replace(problem, stated=stated, held=tuple(name for name in held if name in stated))

    def uncertainties(held: Mapping[str, float]) -> dict[str, float]:
        candidate = holding(held)
        outcome = best(protocol, candidate)
        return {name: outcome[name][1] for name in candidate.stated}

    held = held_back(problem.stated, uncertainties)
    inclines = ", ".join(f"{incline:g}°" for incline in problem.inclines)
    left_out = [
        f"{words(name)} is not identified by drops at {inclines}: held at the protocol's "
        f"{problem.stated[name].value:g}"
        + (f" ± {u:g}, which the other coefficients allow for" if u else "")
        for name, u in held.items()
    ]
    return replace(holding(held), left_out=(*problem.left_out, *left_out))


def model(protocol: Protocol, parameters: Sequence[Parameter]) -> Hypothesis:
    """Suppose the model with these parameters unknown, and nothing of contact or air."""
    assert protocol.surface is not None
    return coefficients(protocol.surface, parameters, given_alphas(protocol))


def nuisances(protocol: Protocol, problem: CoefficientProblem, inner: Hypothesis) -> Hypothesis:
    """Add where the contact point is at each incline, and the air."""
    added = with_contact(inner, problem.inclines, (0.0, CONTACT_U))
    return with_drag(added, prior_air(protocol))


def best(
    protocol: Protocol, problem: CoefficientProblem, parameters: Sequence[Parameter] = ()
) -> HypothesisFit:
    """Fit the coefficients, or these parameters instead of theirs, with all nuisances."""
    coefficients_only = model(protocol, parameters or problem.parameters)
    return fit(problem.forms, nuisances(protocol, problem, coefficients_only))


def correlation(outcome: HypothesisFit, names: Sequence[str]) -> Array:
    """Correlation matrix of some parameters, shape ``(names, names)``."""
    at = [outcome.names.index(name) for name in names]
    part = outcome.covariance[np.ix_(at, at)]
    sd = np.sqrt(np.diag(part))
    matrix: Array = part / np.outer(sd, sd)
    return matrix
