"""What may be supposed of the impacts: from the coefficients of the model down to rod by rod."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.air import prior_air
from rig.estimate.hypothesis_fit import Hypothesis, Parameter
from rig.model.rods import rod_impacts
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rig.arrays import Array
    from rig.estimate.quadratic_forms import QuadraticForm
    from rig.model.chain import Chain
    from rig.model.surface import Surface
    from rig.protocol.protocol import Protocol

    AlphasAndSlopes = tuple[Array, Array]

ALPHA, BETA, MU, PILE = "alpha", "restitution", "friction", "pile_restitution"
END, AIR = "end_correction", "drag"
CONTACT_U = 1e-3
"""How far the contact point may move when the board is inclined anew, m."""
_STEP = 1e-5  # of a coefficient, for its derivative


def given_alphas(protocol: Protocol) -> dict[Chain, str]:
    """Name the α of each chain whose α is simply given; like chains have one."""
    chains = {rods.chain: rods.name for rods in protocol.chains.values() if rods.chain.alpha}
    return {chain: ALPHA if len(chains) == 1 else f"{ALPHA} {chains[chain]}" for chain in chains}


def by_model(protocol: Protocol, parameters: Sequence[Parameter]) -> Hypothesis:
    """Suppose Eqs. 8 to 13 with these coefficients unknown, the others as stated."""
    surface, alpha_names = protocol.surface, given_alphas(protocol)
    assert surface is not None
    names = [parameter.name for parameter in parameters]

    @cache
    def alphas_at(chain: Chain, incline_deg: float, values: tuple[float, ...]) -> AlphasAndSlopes:
        stated = dict(zip(names, values, strict=True))
        return alphas(surface, chain, incline_deg, stated, alpha_names.get(chain))

    return Hypothesis(
        tuple(parameters),
        lambda form, values: alphas_at(form.chain, form.run.incline_deg, tuple(values.tolist())),
    )


def alphas(
    surface: Surface,
    chain: Chain,
    incline_deg: float,
    values: Mapping[str, float],
    alpha_name: str | None = None,
) -> tuple[Array, Array]:
    """α of every rod by Eqs. 8 to 13, shape ``(rods,)``, with its derivatives by coefficients.

    Parameters
    ----------
    values
        Coefficients by name; others are as stated.
    alpha_name
        Name of this chain's α, where it is simply given.
    """

    def at(moved: Mapping[str, float]) -> Array:
        given = chain if alpha_name is None else replace(chain, alpha=Quantity(moved[alpha_name]))
        impacts = rod_impacts(with_coefficients(surface, moved), given, incline_deg)
        return np.array([impact.alpha for impact in impacts])

    slopes = np.zeros((chain.rods, len(values)))
    for n, (name, value) in enumerate(values.items()):
        low, high = (at({**values, name: value + step}) for step in (-_STEP, _STEP))
        slopes[:, n] = (high - low) / (2.0 * _STEP)
    return at(values), slopes


def with_coefficients(surface: Surface, values: Mapping[str, float]) -> Surface:
    """Return the surface with some of its coefficients replaced."""
    changes: dict[str, Any] = {
        name: Quantity(values[name]) for name in (BETA, MU) if name in values
    }
    if surface.pile is not None and PILE in values:
        changes["pile"] = replace(surface.pile, restitution=Quantity(values[PILE]))
    return replace(surface, **changes)


def one_alpha(
    forms: Sequence[QuadraticForm],
    key: Callable[[QuadraticForm], object],
    *,
    each_rod: bool = False,
) -> Hypothesis:
    """Suppose one α for all drops that share a key: an incline, or a run.

    `each_rod`: one for each rod but the top one, whose impact pulls on nothing.
    """
    parameters: list[Parameter] = []
    shares: dict[object, tuple[int, Array]] = {}
    for group in dict.fromkeys(map(key, forms)):
        begin = np.mean([form.alphas for form in forms if key(form) == group], axis=0)
        share = np.eye(begin.size)[:, :-1] if each_rod else np.ones((begin.size, 1))
        shares[group] = len(parameters), share
        starts = (begin @ share / share.sum(axis=0)).tolist()
        parameters += [Parameter(f"α {group}", start) for start in starts]

    def alphas(form: QuadraticForm, values: Array) -> tuple[Array, Array]:
        first, share = shares[key(form)]
        slopes = np.zeros((form.alphas.size, values.size))
        slopes[:, first : first + share.shape[1]] = share
        return slopes @ values, slopes

    return Hypothesis(tuple(parameters), alphas)


def with_end_correction(
    inner: Hypothesis, gammas: Callable[[QuadraticForm], Array], scale: float | None
) -> Hypothesis:
    """Suppose γ to be exactly so many times that of Eq. 10, or (`None`) leave it open.

    Parameters
    ----------
    gammas
        γ of Eq. 10 for every rod of a drop, shape ``(rods,)``.
    """

    def alphas(form: QuadraticForm, values: Array) -> tuple[Array, Array]:
        target, slopes = inner.alphas(form, values[:-1])
        # m/(M + γm) is here r/(1 + (γ − γ₀)r), with r = m/(M + γ₀m) as in the form.
        change = gammas(form) * form.ratios
        ratio = 1.0 / (1.0 + (values[-1] - 1.0) * change)
        by_scale = -target * change * ratio**2
        return target * ratio, np.column_stack([slopes * ratio[:, None], by_scale])

    added = Parameter(END, 1.0) if scale is None else Parameter(END, scale, (scale, 0.0))
    return Hypothesis((*inner.parameters, added), alphas)


def with_contact(inner: Hypothesis, inclines: Sequence[float]) -> Hypothesis:
    """Suppose the contact point to be at another height at each incline."""
    prior = 0.0, CONTACT_U
    added = (Parameter(f"contact {at:g}", 0.0, prior, "contact", at) for at in inclines)
    return inner._replace(parameters=(*inner.parameters, *added))


def with_nuisances(protocol: Protocol, inner: Hypothesis, inclines: Sequence[float]) -> Hypothesis:
    """Suppose also air of a κ that is known as well as the protocol says."""
    prior = prior_air(protocol)
    inner = with_contact(inner, inclines)
    return inner._replace(parameters=(*inner.parameters, Parameter(AIR, prior[0], prior, "drag")))
