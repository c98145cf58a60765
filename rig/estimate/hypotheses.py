"""What may be supposed of the impacts: from the coefficients of the model down to rod by rod."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rig.estimate.hypothesis_fit import Hypothesis, Parameter
from rig.estimate.quadratic_forms import EXTRA, QuadraticForm
from rig.model.rods import rod_impacts
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from rig.arrays import Array
    from rig.model.chain import Chain
    from rig.model.surface import Surface

    Index = NDArray[np.intp]

ALPHA, BETA, MU, PILE = "alpha", "restitution", "friction", "pile_restitution"
END, AIR = "end_correction", "drag"
_STEP = 1e-5  # of a coefficient, for its derivative


def coefficients(
    surface: Surface, parameters: Sequence[Parameter], alpha_names: Mapping[Chain, str]
) -> Hypothesis:
    """Suppose Eqs. 8 to 13 with these of β, μ and the pile's β unknown, the others as stated.

    Parameters
    ----------
    alpha_names
        Name of the α of each chain whose α is simply given.
    """
    names = [parameter.name for parameter in parameters]
    computed: dict[tuple[float, int, tuple[float, ...]], tuple[Array, Array]] = {}

    def targets(form: QuadraticForm, values: Array) -> tuple[Array, Array]:
        key = form.run.incline_deg, id(form.chain), tuple(values.tolist())
        if key not in computed:
            current = dict(zip(names, values.tolist(), strict=True))
            name, incline_deg = alpha_names.get(form.chain), form.run.incline_deg
            computed[key] = _with_extras(*alphas(surface, form.chain, incline_deg, current, name))
        return computed[key]

    return Hypothesis(tuple(parameters), targets)


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
    if alpha_name is not None and alpha_name in values:
        slopes = np.zeros((chain.rods, len(values)))
        slopes[:, [*values].index(alpha_name)] = 1.0
        return np.full(chain.rods, values[alpha_name]), slopes

    def at(moved: Mapping[str, float]) -> Array:
        impacts = rod_impacts(with_coefficients(surface, moved), chain, incline_deg)
        return np.array([impact.alpha for impact in impacts])

    slopes = np.zeros((chain.rods, len(values)))
    for n, (name, value) in enumerate(values.items()):
        low, high = (at({**values, name: value + step}) for step in (-_STEP, _STEP))
        slopes[:, n] = (high - low) / (2.0 * _STEP)
    return at(values), slopes


def with_coefficients(surface: Surface, values: Mapping[str, float]) -> Surface:
    """Return the surface with some of its coefficients replaced."""
    pile = surface.pile
    if pile is not None and PILE in values:
        pile = replace(pile, restitution=Quantity(values[PILE]))
    return replace(
        surface,
        restitution=Quantity(values[BETA]) if BETA in values else surface.restitution,
        friction=Quantity(values[MU]) if MU in values else surface.friction,
        pile=pile,
    )


def one_alpha(forms: Sequence[QuadraticForm], key: Callable[[QuadraticForm], object]) -> Hypothesis:
    """Suppose one α for all drops that share a key: an incline, or a run."""
    return _open(forms, key, lambda rods: {"": np.arange(rods)})


def each_rod(forms: Sequence[QuadraticForm], key: Callable[[QuadraticForm], object]) -> Hypothesis:
    """Suppose an α for each rod but the top one, whose impact pulls on nothing."""
    return _open(forms, key, lambda rods: {f", rod {k}": np.array([k]) for k in range(rods - 1)})


def _open(
    forms: Sequence[QuadraticForm],
    key: Callable[[QuadraticForm], object],
    split: Callable[[int], Mapping[str, Index]],
) -> Hypothesis:
    """Suppose an α for each of some sets of rods of all drops that share a key."""
    parameters: list[Parameter] = []
    sets: dict[object, list[tuple[int, Index]]] = {}
    for group in dict.fromkeys(map(key, forms)):
        alphas = np.array([form.alphas for form in forms if key(form) == group])
        for name, rods in split(alphas.shape[1]).items():
            sets.setdefault(group, []).append((len(parameters), rods))
            parameters.append(Parameter(f"α {group}{name}", float(alphas[:, rods].mean())))

    def targets(form: QuadraticForm, values: Array) -> tuple[Array, Array]:
        slopes = np.zeros((form.alphas.size, values.size))
        for place, rods in sets[key(form)]:
            slopes[rods, place] = 1.0
        return _with_extras(slopes @ values, slopes)

    return Hypothesis(tuple(parameters), targets)


def with_end_correction(
    inner: Hypothesis, gammas: Callable[[QuadraticForm], Array], scale: float | None
) -> Hypothesis:
    """Suppose γ to be so many times that of Eq. 10, or (`None`) leave it open.

    Parameters
    ----------
    gammas
        γ of Eq. 10 for every rod of a drop, shape ``(rods,)``.
    """
    size = len(inner.parameters)

    def targets(form: QuadraticForm, values: Array) -> tuple[Array, Array]:
        target, slopes = inner.targets(form, values[:size])
        rods = form.alphas.size
        factor = float(values[size]) if scale is None else scale
        # m/(M + γm) is here r/(1 + (γ − γ₀)r), with r = m/(M + γ₀m) as in the form.
        change = gammas(form) * form.ratios
        ratio = 1.0 / (1.0 + (factor - 1.0) * change)
        target, slopes = target.copy(), slopes.copy()
        by_scale = np.zeros(target.size)
        by_scale[:rods] = -target[:rods] * change * ratio**2
        target[:rods] *= ratio
        slopes[:rods] *= ratio[:, None]
        return target, np.column_stack([slopes, by_scale]) if scale is None else slopes

    added = (Parameter(END, 1.0),) if scale is None else ()
    return Hypothesis((*inner.parameters, *added), targets)


def with_contact(
    inner: Hypothesis, inclines: Sequence[float], prior: tuple[float, float] | None
) -> Hypothesis:
    """Suppose the contact point to be at another height at each incline."""
    parameters = tuple(Parameter(f"contact {incline:g}", 0.0, prior) for incline in inclines)
    return _with(inner, parameters, 0, lambda form: inclines.index(form.run.incline_deg))


def with_drag(inner: Hypothesis, prior: tuple[float, float]) -> Hypothesis:
    """Suppose air of a κ that is known so well beforehand."""
    return _with(inner, (Parameter(AIR, prior[0], prior),), 1, lambda _: 0)


def _with(
    inner: Hypothesis,
    added: tuple[Parameter, ...],
    extra: int,
    which: Callable[[QuadraticForm], int],
) -> Hypothesis:
    size = len(inner.parameters)

    def targets(form: QuadraticForm, values: Array) -> tuple[Array, Array]:
        target, slopes = inner.targets(form, values[:size])
        row, n = form.alphas.size + extra, which(form)
        target = target.copy()
        target[row] += values[size + n]
        wider = np.column_stack([slopes, np.zeros((target.size, len(added)))])
        wider[row, size + n] = 1.0
        return target, wider

    return Hypothesis((*inner.parameters, *added), targets)


def _with_extras(target: Array, slopes: Array) -> tuple[Array, Array]:
    """Add the extras, which are nothing unless supposed."""
    none = np.zeros((len(EXTRA), slopes.shape[1]))
    return np.append(target, np.zeros(len(EXTRA))), np.vstack([slopes, none])
