"""A drop's results in the light of its whole session, and where their uncertainty comes from."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.deviation import deviation_among
from rig.analysis.gate_passages import gate_passages
from rig.analysis.quantities import BUDGET, effective_degrees, measurands
from rig.analysis.result import Measured

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from rig.analysis.gate_passages import GatePassage
    from rig.analysis.joint_fit import JointDrop, JointFit

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]
    Places = Mapping[str, Index]


class Budgets:
    """Uncertainties of functions of a drop's unknowns, from the joint solution.

    With M the normal matrix of all drops, prior included, the variance is gᵀM⁻¹g = wᵀ(N + P)w with
    w = M⁻¹g: N is the edges' line and each group of priors has its own, and they add up. With the
    drops' own unknowns eliminated, w_c = C h with h = g_c − Gᵀg_o for the common ones, G C h for
    the other drops' own, and A⁻¹g_o − G C h for this drop's own.

    Parameters
    ----------
    joint
        Of all drops.
    """

    def __init__(self, joint: JointFit) -> None:
        self.joint = joint
        size = len(joint.shared)
        self._others: dict[str, Array] = {}
        # Those of another drop's condition count too, by what they tell of the rest.
        self._common: dict[str, Index] = {}
        for drop in joint.drops:
            common = np.full(drop.x.size, -1)
            common[drop.common] = drop.here
            for name, rows in _lines(drop, common).items():
                self._common[name] = np.union1d(self._common.get(name, rows), rows)
            place = np.ix_(drop.here, drop.here)
            for name, rows in _groups(drop).items():
                total = self._others.setdefault(name, np.zeros((size, size)))
                total[place] += drop.gain[rows].T @ drop.gain[rows]

    def measured(self, drop: JointDrop) -> dict[str, Measured]:
        """Everything the scene lets one measure, by its JSON name."""
        own = _groups(drop)
        return {
            name: self._measured(drop, own, value, gradient * drop.model.unknowns.sd)
            for name, (value, gradient) in measurands(drop.model, drop.x).items()
        }

    def gates(self, drop: JointDrop) -> tuple[GatePassage, ...]:
        """How one object passed each gate."""
        groups, sd = _groups(drop), drop.model.unknowns.sd
        return gate_passages(
            drop, drop.x, lambda value, slopes: self._measured(drop, groups, value, slopes * sd)
        )

    def _measured(self, drop: JointDrop, groups: Places, value: float, gradient: Array) -> Measured:
        """Put value and uncertainty together; `gradient` is in units of the prior uncertainties."""
        by_root = gradient[drop.own] @ drop.inverse
        h = np.zeros(len(self.joint.shared))
        h[drop.here] = gradient[drop.common] - drop.gain.T @ gradient[drop.own]
        # h·C·h is |h·R⁻¹|²: with that vector kept of every measurand, covariances between drops
        # are plain products, and signs that cancel when chains change places are not lost.
        shared = h @ self.joint.inverse
        common = self.joint.inverse @ shared
        own = drop.inverse @ by_root - drop.gain @ common[drop.here]
        variance = float(by_root @ by_root) + float(shared @ shared)
        lines: dict[str, float] = {}
        for name, rows in groups.items():
            # The sum over all drops was made once; this drop's share is replaced by its own rows.
            here = drop.gain[rows] @ common[drop.here]
            others = float(common @ self._others[name] @ common) - float(here @ here)
            lines[name] = float(own[rows] @ own[rows]) + max(0.0, others)
        for name, rows in self._common.items():
            lines[name] = lines.get(name, 0.0) + float(common[rows] @ common[rows])
        # What no prior explains comes from the edges; rounding may leave less than nothing.
        lines["edges"] = lines.get("edges", 0.0) + max(0.0, variance - sum(lines.values()))
        budget = {name: math.sqrt(line) for name, line in lines.items() if line > 0.0}
        u = math.sqrt(variance)
        found = self.joint.degrees
        known = {name: found[line.scale] for name, line in BUDGET.items() if line.scale in found}
        degrees = effective_degrees(u, budget, known)
        deviation = deviation_among(self.joint, drop, gradient, degrees)
        return Measured(value, u, degrees, budget, shared, deviation)


def _groups(drop: JointDrop) -> Places:
    """Rows of a drop's own unknowns that each line of the budget has."""
    row = np.full(drop.x.size, -1)
    row[drop.own] = np.arange(drop.own.size)
    return _lines(drop, row)


def _lines(drop: JointDrop, places: Index) -> Places:
    """Sort places that there are, one an unknown, by line of the budget."""
    found = {
        name: np.concatenate([places[block] for block in blocks])
        for name, blocks in drop.model.unknowns.groups.items()
    }
    return {name: rows[rows >= 0] for name, rows in found.items() if (rows >= 0).any()}
