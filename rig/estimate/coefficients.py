"""β, μ and the pile's β by least squares on the edges, where these can tell them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.drop_model import prior_air
from rig.estimate.hypotheses import (
    ALPHA,
    BETA,
    MU,
    PILE,
    coefficients,
    with_contact,
    with_drag,
)
from rig.estimate.hypothesis_fit import Parameter, fit
from rig.model.impact import impact_on

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from rig.estimate.hypothesis_fit import Hypothesis, HypothesisFit
    from rig.estimate.quadratic_forms import QuadraticForm
    from rig.model.chain import Chain
    from rig.protocol.protocol import Protocol
    from rig.units import Quantity

    Array = NDArray[np.float64]

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
    parameters
        Coefficients that the edges tell, and those they do not, these with a prior.
    held
        Names of the latter.
    stated
        What the protocol says of each coefficient that is fitted, by name.
    left_out
        Sentences on what is not fitted, and why.
    """

    forms: tuple[QuadraticForm, ...]
    parameters: tuple[Parameter, ...]
    held: tuple[str, ...]
    stated: dict[str, Quantity]
    left_out: tuple[str, ...]

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
    ordered = sorted(forms, key=lambda one: one.run.incline_deg)
    kept, stated, left_out = described(
        protocol, [(one.chain, one.run.incline_deg) for one in ordered]
    )
    parameters = [Parameter(name, quantity.value) for name, quantity in stated.items()]
    told = tuple(one for one, said in zip(ordered, kept, strict=True) if said)
    found = CoefficientProblem(told, tuple(parameters), (), stated, tuple(left_out))
    return _identified(protocol, found) if told else found


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
    kept = []
    given = given_alphas(protocol)
    for chain, incline in drops:
        impact = impact_on(surface, chain, incline)
        kept.append(impact.basis == "given" or not impact.notes)
        if not kept[-1]:
            said = f"{incline:g}° tells no coefficient: {'; '.join(impact.notes)}"
            left_out += [said] if said not in left_out else []
        elif chain.alpha is not None:
            stated[given[chain]] = chain.alpha
        elif impact.basis == "pile" and surface.pile is not None:
            stated[PILE] = surface.pile.restitution
        else:
            stated[BETA] = surface.restitution
            if impact.basis == "surface":
                stated[MU] = surface.friction
    return kept, stated, left_out


def given_alphas(protocol: Protocol) -> dict[Chain, str]:
    """Name the α of each chain whose α is simply given; like chains have one."""
    chains = {one.chain: one.name for one in protocol.chains.values() if one.chain.alpha}
    return {chain: ALPHA if len(chains) == 1 else f"{ALPHA} {chains[chain]}" for chain in chains}


def words(name: str) -> str:
    """Write a coefficient's name for people."""
    what, _, chain = name.partition(" ")
    return what.replace("_", " ") + (f" of chain {chain}" if chain else "")


def first_held(names: Iterable[str]) -> list[str]:
    """Order coefficients as they are held, one after the other, where edges do not tell all."""
    known = list(names)
    models = [name for name in (MU, BETA, PILE) if name in known]
    return models + [name for name in known if name not in models]


def _identified(protocol: Protocol, given: CoefficientProblem) -> CoefficientProblem:
    """Hold μ, and then β, where the edges do not tell them apart."""
    found = given
    for name in first_held(given.stated):
        outcome = best(protocol, found)
        unsure = [one for one in found.stated if outcome[one][1] > KNOWN]
        if not unsure:
            break
        if name == MU and BETA not in unsure and MU not in unsure:
            continue
        stated = given.stated[name]
        said = (
            f"{words(name)} is not identified by drops at "
            f"{', '.join(f'{incline:g}°' for incline in given.inclines)}: held at the protocol's "
        )
        if stated.u:
            said += f"{stated.value:g} ± {stated.u:g}, which the other coefficients allow for"
            parameters = tuple(
                one._replace(prior=(stated.value, stated.u)) if one.name == name else one
                for one in found.parameters
            )
            found = replace(found, parameters=parameters, held=(*found.held, name))
        else:
            said += f"{stated.value:g}"
            found = replace(
                found,
                parameters=tuple(one for one in found.parameters if one.name != name),
                stated={key: value for key, value in found.stated.items() if key != name},
            )
        found = replace(found, left_out=(*found.left_out, said))
    return found


def model(protocol: Protocol, parameters: Sequence[Parameter]) -> Hypothesis:
    """Suppose the model with these parameters unknown, and nothing of contact or air."""
    assert protocol.surface is not None
    return coefficients(protocol.surface, parameters, given_alphas(protocol))


def nuisances(protocol: Protocol, found: CoefficientProblem, inner: Hypothesis) -> Hypothesis:
    """Add where the contact point is at each incline, and the air."""
    added = with_contact(inner, found.inclines, (0.0, CONTACT_U))
    return with_drag(added, prior_air(protocol))


def best(protocol: Protocol, found: CoefficientProblem) -> HypothesisFit:
    """Fit the coefficients with all nuisances."""
    return fit(found.forms, nuisances(protocol, found, model(protocol, found.parameters)))


def correlation(outcome: HypothesisFit, names: Sequence[str]) -> Array:
    """Correlation matrix of some parameters, shape ``(names, names)``."""
    at = [outcome.names.index(name) for name in names]
    part = outcome.covariance[np.ix_(at, at)]
    sd = np.sqrt(np.diag(part))
    found: Array = part / np.outer(sd, sd)
    return found
