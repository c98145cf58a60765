"""What may be supposed of the impacts: from the coefficients of the model down to rod by rod."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from rig.analysis.unknowns import prior_air
from rig.arrays import Array
from rig.estimate.hypothesis_fit import Hypothesis, Parameter
from rig.estimate.quadratic_forms import QuadraticForm
from rig.model.chain import Chain
from rig.model.impact import ALPHA, impact_on, with_coefficients
from rig.protocol.protocol import Protocol

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
    names = [parameter.name for parameter in parameters]

    def alpha(form: QuadraticForm, values: Array) -> tuple[float, Array]:
        by_name = dict(zip(names, values.tolist(), strict=True))
        return model_alpha(protocol, form.chain, form.run.incline_deg, by_name)

    return Hypothesis(tuple(parameters), alpha)


def model_alpha(
    protocol: Protocol, chain: Chain, incline_deg: float, values: Mapping[str, float]
) -> tuple[float, Array]:
    """α of all rods by Eqs. 8 to 13, and its derivatives by coefficients, shape ``(values,)``.

    Parameters
    ----------
    values
        Coefficients by name; others are as stated.
    """
    alpha, surface = given_alphas(protocol).get(chain, ""), protocol.surface
    assert surface is not None

    def at(moved: Mapping[str, float]) -> float:
        # Of given α's only the chain's own.
        own = {name: value for name, value in moved.items() if not name.startswith(ALPHA)}
        own |= {ALPHA: moved[alpha]} if alpha in moved else {}
        return impact_on(*with_coefficients(surface, chain, own), incline_deg).alpha

    slopes = [
        (at({**values, name: value + _STEP}) - at({**values, name: value - _STEP})) / (2.0 * _STEP)
        for name, value in values.items()
    ]
    return at(values), np.array(slopes)


def one_alpha(forms: Sequence[QuadraticForm], key: Callable[[QuadraticForm], object]) -> Hypothesis:
    """Suppose one α for all drops that share a key: an incline, or a run."""
    starts: dict[object, list[Array]] = {}
    for form in forms:
        starts.setdefault(key(form), []).append(form.alphas)
    places = list(starts)
    return Hypothesis(
        tuple(Parameter(f"α {of}", float(np.mean(alphas))) for of, alphas in starts.items()),
        lambda form, values: (values[n := places.index(key(form))], np.eye(values.size)[n]),
    )


def open_alphas(forms: Sequence[QuadraticForm]) -> Hypothesis:
    """Suppose an α for each rod but the top one, whose impact pulls on nothing."""
    starts = np.mean([form.alphas for form in forms], axis=0)[:-1].tolist()

    def alphas(form: QuadraticForm, values: Array) -> tuple[Array, Array]:
        slopes = np.eye(form.alphas.size, values.size)
        return slopes @ values, slopes

    return Hypothesis(
        tuple(Parameter(f"α {rod}", start) for rod, start in enumerate(starts)), alphas
    )


def with_end_correction(
    inner: Hypothesis, gammas: Mapping[Chain, float], scale: float | None
) -> Hypothesis:
    """Suppose γ to be exactly so many times a chain's of Eq. 10, or (`None`) leave it open."""

    def alphas(form: QuadraticForm, values: Array) -> tuple[Array, Array]:
        target, slopes = inner.alphas(form, values[:-1])
        # m/(M + γm) is here r/(1 + (γ − γ₀)r), with r = m/(M + γ₀m) as in the form.
        change = gammas[form.chain] * form.ratios
        ratio = 1.0 / (1.0 + (values[-1] - 1.0) * change)
        by_scale = -target * change * ratio**2
        return target * ratio, np.column_stack([slopes * ratio[:, None], by_scale])

    added = Parameter(END, 1.0) if scale is None else Parameter(END, scale, (scale, 0.0))
    return Hypothesis((*inner.parameters, added), alphas)


def with_nuisances(inner: Hypothesis, inclines: Sequence[float], protocol: Protocol) -> Hypothesis:
    """Suppose air, and the contact point to be at another height at each of some inclines."""
    air, prior = prior_air(protocol), (0.0, CONTACT_U)
    added = [Parameter(f"contact {at:g}", 0.0, prior, "contact", at) for at in inclines]
    added.append(Parameter(AIR, air[0], air, "drag"))
    return inner._replace(parameters=(*inner.parameters, *added))
