"""How much each kind of nuisance scatters, by what was found (empirical Bayes).

A kind with prior uncertainty s and estimates x_i ± √v_i (posterior) has determined
γ = Σ(1 − v_i/s²) of its members by the edges; s² = Σx_i²/γ is then where the evidence for s is
largest (MacKay 1992). An estimate and its v say what the edges alone know of a member, so that for
any other s its x_i and v_i follow at once, and s is found in one round where round by round it
would take dozens. What was stated, S, is the scale of a half-Cauchy prior of s (Gelman 2006), by an
EM step: two more members, whose square is the harmonic mean of S² and s². Where nothing is
determined, s stays as stated, and the less is, the nearer it stays; but what is stated much too
large draws no scatter up that many members tell. Where several components make up one variance,
each is multiplied by the share of Σx² that it explains (an EM step too), which keeps all of them
positive. Nothing becomes less than a share of what was stated.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.components import LEAST_SHARE, above
from rig.analysis.equations import STRAY

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rig.analysis.components import Components
    from rig.analysis.drop_model import DropModel
    from rig.analysis.equations import Residuals
    from rig.arrays import Array


STATED_WEIGHT = 2.0
"""Members that a stated uncertainty counts for: a scale known to half of itself (GUM G.4.2)."""
_KINDS = ("stretch", "gates", "rods", "beam", "hang", "swing")
_IMPULSES = ("impulse", "impulse_floor", "bounce")
_EDGES = ("jitter", "floor", "departure")
_LEAVES = {"departure", "stretch"}  # how far chains leave the equations
_DOUBTED = 2.0
"""Times the share of the stated departures that is found is the least share of every other scale:
once or thrice this moves no coverage by more than a point."""
_INNER = 40  # steps; the next round of the joint fit goes on from there
_SETTLED = 1e-3  # relative change of variances, after which there is none
_BINS = 64
_MANY = 9  # rods that still fall: so many are as good as more


class Evidence:
    """Sums over a session, and the components that follow.

    Parameters
    ----------
    components
        With which the sums are made.
    stated
        Those of the protocol.

    Attributes
    ----------
    components
        After `settled`, the new ones.
    degrees
        Degrees of freedom of each.
    """

    def __init__(self, components: Components, stated: Components) -> None:
        self.components = components
        self.stated = stated
        self.degrees = {name: STATED_WEIGHT for name in (*_EDGES, *_KINDS) if getattr(stated, name)}
        self._members: dict[tuple[str, ...], list[Array]] = {}
        self._edges: list[tuple[Array, Array, Array]] = []

    def members(self, kind: str, y: Array, root: Array) -> None:
        """Count a block of unknowns, in units of their prior uncertainties.

        Parameters
        ----------
        kind
            Which scale they tell; none of what is one number, which has no scatter.
        y, root
            Estimates, and R of their covariance RRᵀ: of such sums of them as are independent.
        """
        if kind and y.size:
            variances, sums = np.linalg.eigh(root @ root.T)
            told = np.maximum(1.0 - variances, np.finfo(float).eps)
            size = np.full(y.size, getattr(self.components, kind) ** -2)
            rows = [size, ((y @ sums) / told) ** 2, variances / told, np.ones_like(y)]
            self._members.setdefault((kind,), []).append(np.stack(rows))

    def drop(self, model: DropModel, y: Array, root: Array) -> None:
        """Count a drop's own unknowns, likewise."""
        at = model.unknowns
        for name, row in at.rows.items():
            # Once rods have struck, what a chain does else looks like its swing.
            if row.shared == "drop" and name in at and name != "impact swing":
                self.members(row.scale, y[at[name]], root[at[name]])
        if "impulses" in at:
            # Back to α², for drops of different α have different units.
            block, alpha = at["impulses"], abs(model.guesses["impact"].alpha)
            squares = (y[block] * at.sd[block]) ** 2
            size = np.full(squares.size, alpha**2)
            single = size / above(model.records["impact"].chain.chain) ** 2
            told = 1.0 - np.sum(root[block] ** 2, axis=1)
            rows = [size, np.ones_like(size), single, squares, np.zeros_like(size), told]
            self._members.setdefault(_IMPULSES, []).append(np.stack(rows))

    def edges(self, residuals: Iterable[Residuals]) -> None:
        """Count what is left over of the edges that are no part of a flicker.

        Nor of rods that may have struck: most of what these are off is of another kind.
        """
        sizes = self.components
        for row in residuals:
            usual = sizes.floor**2 + (row.speed * sizes.jitter) ** 2 + sizes.departures(row.loose)
            good = row.clean & (np.abs(row.values) <= STRAY * row.sigma)
            good &= row.sigma**2 <= 2.0 * usual
            self._edges.append((row.values[good] ** 2, row.speed[good] ** 2, row.loose[good]))

    def settled(self, parameters: float, struck: float = 0.0) -> Evidence:
        """Estimate the components.

        Parameters
        ----------
        parameters
            Number of unknowns that all edges together have determined.
        struck
            How many of them only the edges after a first impact can have told.
        """
        new: dict[str, float] = {}
        self._share(_EDGES, self._binned(parameters, struck), new)
        for names, members in self._members.items():
            self._share(names, np.concatenate(members, axis=1), new)
        # Where chains leave the equations, whatever else is found may be how they do that.
        parted = new["departure"] / self.stated.departure if self.stated.departure else 0.0
        if "stretch" in new:
            new["stretch"] = max(new["stretch"], _doubted(parted - LEAST_SHARE))
        least = _doubted(max(parted, new.get("stretch", 0.0)))
        for name in new.keys() - _LEAVES:
            new[name] = max(new[name], least * getattr(self.stated, name))
        new["few"] = parted * self.stated.few
        self.components = replace(self.components, landed=least, **new)
        return self

    def _binned(self, parameters: float, struck: float) -> Array:
        """Sort edges by what scatters alike: at about the same speed, with as many rods falling.

        Returns
        -------
        ndarray
            By how much each component counts in each bin, three rows; sums of squares, nothing that
            they are uncertain by, and their degrees of freedom; shape ``(6, bins)``.
        """
        parts = zip(*self._edges, strict=True)
        squares, speeds, loose = (np.concatenate(part) for part in parts)
        # Few bins do as well as all edges.
        edges = np.linspace(speeds.min(), speeds.max(), _BINS + 1)[1:-1]
        after = loose > 0.0
        falling = np.minimum(np.divide(1.0, loose, out=np.zeros_like(loose), where=after), _MANY)
        place = np.digitize(speeds, edges) + _BINS * np.rint(falling).astype(np.intp)
        bins = _BINS * (_MANY + 1)
        counts: Array = np.bincount(place, minlength=bins).astype(np.float64)
        sums: Array = np.bincount(place, squares, bins).astype(np.float64)
        middles = np.bincount(place, speeds, bins) / np.maximum(counts, 1)
        late = (np.bincount(place, loose, bins) > 0.0).astype(np.float64)
        stated = self.stated.departures(loose)
        departed = np.bincount(place, stated, bins) / np.maximum(counts, 1)
        departed /= self.stated.departure**2 or 1.0
        # Every unknown that the edges determine takes one degree of freedom, at all speeds alike.
        total, behind = max(1, squares.size), max(1, int(after.sum()))
        taken = (parameters - struck) / total + late * struck / behind
        full = counts > 0
        degrees = np.maximum(0.5, 1.0 - taken) * counts
        kinds = middles, np.ones_like(middles), departed
        return np.stack([*kinds, sums, np.zeros_like(sums), degrees])[:, full]

    def _share(self, names: Sequence[str], members: Array, new: dict[str, float]) -> None:
        """Estimate components that make up one variance.

        A member x ± e, of which they make the variance s² = Σ kinds·a², is found to be x·s²/(s² +
        e²) with as large a share of a degree of freedom. Variances are fitted to these squares: the
        maximum of the χ² likelihood above the least a, by multiplicative steps.
        """
        kinds, (squares, unsure, counts) = members[:-3], members[-3:]
        stated = np.array([getattr(self.stated, name) ** 2 for name in names])
        variances = np.array([getattr(self.components, name) ** 2 for name in names])
        # The stated member is spread over all sizes, so that it pulls no component alone.
        beforehand = STATED_WEIGHT / squares.size
        tiny = np.finfo(float).tiny
        for _ in range(_INNER):
            total = variances @ kinds
            share = total / (total + unsure)
            member = 2.0 * stated * variances / (stated + variances + tiny)  # 0 of what is exact
            estimates = squares * share**2 + beforehand * (member @ kinds)
            degrees = counts * share + beforehand
            grown = kinds @ (estimates / total**2) / np.maximum(kinds @ (degrees / total), tiny)
            before, variances = variances, np.maximum(variances * grown, LEAST_SHARE**2 * stated)
            if (np.abs(variances - before) <= _SETTLED * before).all():
                break
        for name, sizes, variance in zip(names, kinds, variances.tolist(), strict=True):
            new[name] = variance**0.5
            self.degrees[name] = max(STATED_WEIGHT, float(degrees[sizes > 0.0].sum()))


def _doubted(parted: float) -> float:
    """Share of what is stated that a scale has at least, for that by which chains are parted."""
    return max(LEAST_SHARE, min(1.0, _DOUBTED * parted))
