"""Uncertainties of functions of the unknowns, and where they come from.

With M the normal matrix of all drops, prior included, and unknowns in units of their prior
uncertainties, a function with the gradient g has the variance gᵀM⁻¹g = wᵀ(N + P)w with w = M⁻¹g: N
is the edges' line of the budget and each group of priors has its own, and they add up. With the
drops' own unknowns eliminated, w_c = C h with h = g_c − Gᵀg_o for the common ones, G C h for the
other drops' own, and A⁻¹g_o − G C h for this drop's own. A drop by itself has nothing in common
with others.

How far a result may be from a prediction that holds follows from the same w: the true value moves
by g·x and the result's error is −w·x, and what the edges' scatter adds. The variance of result less
prediction is therefore g·g − g·w for what has a prior. Of what the edges alone tell, such as α, the
prediction knows the value: it has no share in g·g, and leaves 2 e·w with e its part of g.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.distributions import COVERAGE_95, coverage_factor
from rig.analysis.gate_passages import gate_passages
from rig.analysis.quantities import BUDGET, COMMON, Adjusted, effective_degrees, measurands
from rig.analysis.result import Deviation, Measured
from rig.analysis.unknowns import Side
from rig.protocol.protocol import GUESSED

if TYPE_CHECKING:
    from rig.analysis.drop_model import DropModel
    from rig.analysis.dual import Dual
    from rig.analysis.gate_passages import GatePassage
    from rig.analysis.joint_fit import JointFit
    from rig.analysis.joint_step import JointDrop
    from rig.arrays import Array, Flags, Index


_LINES = {name: place for place, name in enumerate(BUDGET)}
_GUESSED = [_LINES[name] for name in ("side", "contact")]
"""Lines of a guessed size that no number of drops tells."""
_SHARED = [_LINES[name] for name in COMMON]


class Budgets:
    """Uncertainties from a joint solution.

    Parameters
    ----------
    joint
        Of all drops; for a drop by itself see `rig.analysis.joint_fit.by_itself`.
    """

    def __init__(self, joint: JointFit) -> None:
        self.joint = joint
        self._common = np.zeros(len(joint.shared), dtype=np.intp)
        for name, block in joint.shared.blocks.items():
            self._common[block] = _LINES[joint.shared.rows[name].line]

    @cached_property
    def _gains(self) -> dict[int, Array]:
        """GᵀG of all drops' own unknowns, by the line of the budget that they belong to."""
        size = self._common.size
        gains: dict[int, Array] = {}
        for drop in self.joint.drops if size else ():
            lines = _supposed(drop.model).line[drop.own]
            for line in sorted(set(lines.tolist())):
                gain = drop.gain[lines == line]
                total = gains.setdefault(line, np.zeros((size, size)))
                total[np.ix_(drop.here, drop.here)] += gain.T @ gain
        return gains

    def measured(self, drop: JointDrop) -> dict[str, Measured]:
        """Everything the scene lets one measure, by its JSON name."""
        values = measurands(drop.model, drop.x)
        return {name: self.measure(drop, value) for name, value in values.items()}

    def gates(self, drop: JointDrop) -> tuple[GatePassage, ...]:
        """How one object passed each gate."""
        adjusted = Adjusted(drop.model, drop.x)
        return gate_passages(drop, adjusted, lambda value: self.measure(drop, value))

    def roots(self, drop: JointDrop, slopes: Array) -> tuple[Array, Array, Array]:
        """Return vectors whose squared lengths add up to the variance of functions of a drop.

        Parameters
        ----------
        slopes
            By its unknowns, shape ``(…, unknowns)``.

        Returns
        -------
        gradient, own, shared
            The slopes in units of prior uncertainties; and both vectors. Products of those that are
            shared are the covariances between drops, in which signs may cancel when chains change
            places.
        """
        gradient = slopes * drop.model.unknowns.sd
        own = gradient[..., drop.own]
        common = np.zeros((*own.shape[:-1], self._common.size))
        common[..., drop.here] = gradient[..., drop.common] - own @ drop.gain
        return gradient, own @ drop.inverse, common @ self.joint.inverse

    def measure(self, drop: JointDrop, result: Dual) -> Measured:
        """Put a value and its uncertainty together."""
        gradient, by_root, shared = self.roots(drop, result.slopes)
        variance = float(by_root @ by_root) + float(shared @ shared)
        common = self.joint.inverse @ shared
        behind = drop.gain @ common[drop.here]
        own = drop.inverse @ by_root - behind
        place, size = _supposed(drop.model).line[drop.own], len(_LINES)
        lines = np.bincount(place, own * own, size)
        lines += np.bincount(self._common, common * common, size)
        # The sum over all drops was made once; this drop's share is replaced by its own rows.
        shares = np.bincount(place, behind * behind, size)
        for line, gains in self._gains.items():
            lines[line] += max(0.0, float(common @ gains @ common) - float(shares[line]))
        # What no prior explains comes from the edges; rounding may leave less than nothing.
        lines[_LINES["edges"]] += max(0.0, variance - float(lines.sum()))
        parts = zip(_LINES, np.sqrt(lines).tolist(), strict=True)
        budget = {name: line for name, line in parts if line > 0.0}
        u, nu = math.sqrt(variance), self.joint.degrees
        line_nu = {name: nu[line.scale] for name, line in BUDGET.items() if line.scale in nu}
        degrees = effective_degrees(u, budget, line_nu)
        deviation = self._deviation(drop, gradient, degrees)
        return Measured(
            float(result.value), u, degrees, budget, shared if shared.size else None, deviation
        )

    def _deviation(self, drop: JointDrop, gradient: Array, degrees: float) -> Deviation:
        """Return how far a result may be from a prediction that holds."""
        (place, predicted, absent), inner, places = _supposed(drop.model), drop.own, drop.here
        if self._common.size:  # what is guessed counts for as much as its expanded uncertainty says
            wider = (coverage_factor(GUESSED) / COVERAGE_95) ** 2
            absent = np.where(np.isin(place, _GUESSED), 1.0 - wider, absent)
        true = np.where(predicted, 0.0, gradient)
        direct = gradient[inner] - true[inner]
        moves, response, without, lost = (np.zeros(self._common.size) for _ in range(4))
        moves[places], lost[places] = true[drop.common], absent[drop.common]
        response[places] = gradient[drop.common] - drop.gain.T @ gradient[inner]
        without[places] = drop.gain.T @ direct
        root = self.joint.inverse  # whose product with its transpose is the common covariance
        common = root @ (response @ root)
        solved = drop.inverse @ (gradient[inner] @ drop.inverse)
        error = true[inner] - np.where(predicted[inner], 0.0, solved - drop.gain @ common[places])
        own = true[inner] @ true[inner] - gradient[inner] @ solved + 2.0 * direct @ solved
        own -= absent[inner] @ error**2
        less, surplus = (
            np.sqrt(np.maximum(0.0, sign * lost)) * (moves - common) for sign in (1.0, -1.0)
        )
        # hCh + h(Ce) + (eC)h is what h + e make, less what e makes; e = −Gᵀ of what is known.
        plus = np.concatenate([moves, without @ root, surplus])
        minus = np.concatenate([(response + without) @ root, less])
        if not self._common.size:  # what drops have in common is known by its line alone
            part = (1.0 - absent[inner]) * error**2
            shared = float(part[np.isin(place[inner], _SHARED)].sum())
            own, plus, minus = own - shared, np.array([math.sqrt(shared)]), np.zeros(1)
        if "impact" in drop.model.records:
            degrees = self.joint.degrees.get("impulse", degrees)
        return Deviation(max(0.0, float(own)), degrees, plus, minus)


class _Supposed(NamedTuple):
    """What is known of a drop's unknowns, shape ``(unknowns,)`` each.

    Attributes
    ----------
    line
        Of the budget, by its place there.
    known
        Whether only the edges tell it, and a prediction knows it.
    absent
        Share of the prior variance that is none where the prediction's equations hold: what strings
        do besides, and air of which the protocol says nothing.
    """

    line: Index
    known: Flags
    absent: Array


@lru_cache(maxsize=1)  # all results of a drop ask for it
def _supposed(model: DropModel) -> _Supposed:
    at = model.unknowns
    line, predicted = np.zeros(len(at), dtype=np.intp), np.zeros(len(at), dtype=np.bool_)
    absent = np.zeros(len(at))
    measured = "alpha" if "impact" in model.records else "gravity"
    for name, row in at.rows.items():
        line[at[name]], predicted[at[name]] = _LINES[row.line], row.name in {"release", measured}
        record = model.records["impact" if row.of == "impact" else next(iter(model.records))]
        absent[at[name]] = row.absent(Side(model, record))
    return _Supposed(line, predicted, absent)
