"""Uncertainty budgets of functions of the unknowns.

With M the normal matrix of all drops, prior included, and unknowns in units of their prior
uncertainties, a function with the gradient g has the variance gᵀM⁻¹g = wᵀ(N + P)w with w = M⁻¹g.
N gives the edges' line of the budget, and each group of priors in P a line of its own. With the
drops' own unknowns eliminated, w_c = C h with h = g_c − Gᵀg_o for the shared unknowns, G C h for
the other drops' own, and A⁻¹g_o − G C h for this drop's own. A single drop has no shared unknowns.

The deviation of a result from a valid prediction follows from the same w. The true value changes
by g·x, and the result's error is −w·x plus the contribution of the edges' scatter. The variance of
result less prediction is therefore g·g − g·w for unknowns with priors. For unknowns without, such
as α, the prediction has the true value: they add nothing to g·g, but 2 e·w with e their part of g.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rig.analysis.budget_lines import BUDGET, COMMON, effective_degrees
from rig.analysis.distributions import coverage_factor
from rig.analysis.drop_model import DropModel
from rig.analysis.dual import Dual
from rig.analysis.gate_passages import GatePassage, gate_passages
from rig.analysis.joint_fit import JointFit
from rig.analysis.joint_step import JointDrop
from rig.analysis.quantities import measurands
from rig.analysis.result import Deviation, Measured
from rig.analysis.unknowns import Side
from rig.arrays import Array, Flags, Index
from rig.measurands import MEASURANDS
from rig.protocol.protocol import GUESSED
from rig.units import COVERAGE_95

_LINES = {name: place for place, name in enumerate(BUDGET)}
_GUESSED = [_LINES[name] for name in ("side", "contact")]
"""Lines of a guessed size that no number of drops determines."""
_SHARED = [_LINES[name] for name in COMMON]


class Budgets:
    """Uncertainty budgets from a joint fit.

    Parameters
    ----------
    joint
        Joint fit of all drops; for a single drop see `rig.analysis.joint_fit.by_itself`.
    """

    def __init__(self, joint: JointFit) -> None:
        self.joint = joint
        shared = joint.shared
        self._common = np.zeros((len(shared), len(_LINES)))
        for name, block in shared.blocks.items():
            self._common[block, _LINES[shared.rows[name].line]] = 1.0

    def measure_all(self, drop: JointDrop) -> dict[str, Measured]:
        """Return all measurands of the scene with budgets, by JSON name."""
        values = measurands(drop.model, drop.x)
        measured = zip(values, self._measure(drop, [*values.values()]), strict=True)
        # Only means are compared with a prediction.
        return {
            name: value if "averaged" in MEASURANDS[name].kinds else replace(value, deviation=None)
            for name, value in measured
        }

    def gates(self, drop: JointDrop) -> tuple[GatePassage, ...]:
        """Return the passages of a single object through each gate."""
        return gate_passages(drop, lambda value: self._measure(drop, [value])[0])

    def roots(self, drop: JointDrop, slopes: Array) -> tuple[Array, Array, Array]:
        """Return vectors whose squared lengths add up to the variance of functions of a drop.

        Parameters
        ----------
        slopes
            Derivatives by the drop's unknowns, shape ``(…, unknowns)``.

        Returns
        -------
        gradient, own, shared
            The slopes in units of prior uncertainties, and both vectors. Products of `shared`
            vectors are covariances between drops, which may cancel when chains change places.
        """
        inverse, gain = drop.solve()
        gradient = slopes * drop.model.unknowns.sd
        own, common, here = drop.places
        response = gradient[..., common] - gradient[..., own] @ gain
        return gradient, gradient[..., own] @ inverse, response @ self.joint.inverse[here]

    def _measure(self, drop: JointDrop, values: Sequence[Dual]) -> list[Measured]:
        """Return values with their uncertainty, degrees of freedom, budget and deviation."""
        gradient, by_root, shared = self.roots(drop, np.array([value.slopes for value in values]))
        (line, *_), inner, nu = _prior_info(drop.model), drop.places.own, self.joint.degrees
        inverse, gain = drop.solve()
        common, solved = shared @ self.joint.inverse.T, by_root @ inverse.T
        behind = common[:, drop.places.here] @ gain.T
        own, place = solved - behind, np.eye(len(_LINES))[line[inner]]
        lines = own**2 @ place + common**2 @ self._common
        # `gains` is summed over all drops; replace this drop's share by its own rows.
        shares = behind**2 @ place
        for name, gains in self.joint.gains.items():
            others = np.sum(common @ gains * common, axis=1) - shares[:, _LINES[name]]
            lines[:, _LINES[name]] += np.maximum(0.0, others)
        variances = np.sum(by_root**2, axis=1) + np.sum(shared**2, axis=1)
        # The rest comes from the edges; rounding may make it negative.
        lines[:, _LINES["edges"]] += np.maximum(0.0, variances - lines.sum(axis=1))
        line_nu = {name: nu[line.scale] for name, line in BUDGET.items() if line.scale in nu}
        parts = self._deviations(drop, gradient, own, solved, shared)
        measured = []
        for n, (value, u) in enumerate(zip(values, np.sqrt(variances).tolist(), strict=True)):
            row = zip(_LINES, np.sqrt(lines[n]).tolist(), strict=True)
            budget = {name: part for name, part in row if part > 0.0}
            degrees = effective_degrees(u, budget, line_nu)
            scatter_nu = nu.get("impulse", degrees) if "impact" in drop.model.records else degrees
            vectors = (part[n].copy() for part in parts[1:])  # not views of all values' vectors
            deviation = Deviation(max(0.0, float(parts[0][n])), scatter_nu, *vectors)
            vector = shared[n] if shared.size else None
            measured.append(Measured(float(value.value), u, degrees, budget, vector, deviation))
        return measured

    def _deviations(
        self, drop: JointDrop, gradient: Array, moved: Array, solved: Array, shared: Array
    ) -> tuple[Array, Array, Array]:
        """Return `Deviation.own`, `plus` and `minus` of each value.

        Parameters
        ----------
        gradient, shared
            As from `roots`.
        moved, solved
            w of the drop's own unknowns, and the same with the shared ones given.
        """
        (line, predicted, absent), (inner, outer, here) = _prior_info(drop.model), drop.places
        root = self.joint.inverse  # R⁻¹, a square root of the shared covariance
        if root.size:  # widen guessed lines to their expanded uncertainty
            wider = (coverage_factor(GUESSED) / COVERAGE_95) ** 2
            absent = np.where(np.isin(line, _GUESSED), 1.0 - wider, absent)
        true = np.where(predicted, 0.0, gradient)
        direct = gradient[:, inner] - true[:, inner]
        error = true[:, inner] - np.where(predicted[inner], 0.0, moved)
        own = np.sum(true[:, inner] ** 2 - absent[inner] * error**2, axis=1)
        own += np.sum((2.0 * direct - gradient[:, inner]) * solved, axis=1)
        if not root.size:  # only budget lines say what drops share
            common = np.isin(line[inner], _SHARED) * (1.0 - absent[inner])
            part = np.sum(common * error**2, axis=1, keepdims=True)
            return own - part[:, 0], np.sqrt(part), 0.0 * part
        moves, lost = np.zeros(shared.shape), np.zeros(len(root))
        moves[:, here], lost[here] = true[:, outer], absent[outer]
        without = direct @ drop.solve()[1] @ root[here]
        off = moves - shared @ root.T
        surplus, less = (off * np.sqrt(np.maximum(0.0, part)) for part in (-lost, lost))
        # hCh + h(Ce) + (eC)h is the form of h + e less that of e; e = −Gᵀ of the predicted ones.
        return own, np.hstack([moves, without, surplus]), np.hstack([shared + without, less])


class _PriorInfo(NamedTuple):
    """Properties of a drop's unknowns, shape ``(unknowns,)`` each.

    Attributes
    ----------
    line
        Number of the budget line.
    known
        Whether only edges determine the unknown, and a prediction has its true value.
    absent
        Share of the prior variance that vanishes where the prediction's equations hold: effects of
        strings beyond the model, and drag that the protocol does not state.
    """

    line: Index
    known: Flags
    absent: Array


@lru_cache(maxsize=1)  # the same for all results of a drop
def _prior_info(model: DropModel) -> _PriorInfo:
    at = model.unknowns
    line, predicted = np.zeros(len(at), dtype=np.intp), np.zeros(len(at), dtype=np.bool_)
    absent = np.zeros(len(at))
    measured = "alpha" if "impact" in model.records else "gravity"
    for name, row in at.rows.items():
        line[at[name]], predicted[at[name]] = _LINES[row.line], row.name in {"release", measured}
        record = model.records["impact" if row.of == "impact" else next(iter(model.records))]
        absent[at[name]] = row.absent(Side(model, record))
    return _PriorInfo(line, predicted, absent)
