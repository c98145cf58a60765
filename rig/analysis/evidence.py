"""How much each kind of nuisance scatters, by what was found (empirical Bayes).

A kind with prior uncertainty s and estimates x_i ± √v_i (posterior) has determined
γ = Σ(1 − v_i/s²) of its members by the edges; s² = Σx_i²/γ is then where the evidence for s is
largest (MacKay 1992). What was stated counts as one more member, so that where nothing is
determined, s stays as stated, and the less is, the nearer it stays. Where several components make
up one variance, each is multiplied by the share of Σx² that it explains (an EM step), which keeps
all of them positive. Nothing becomes less than a share of what was stated.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.components import LEAST_SHARE, STATED
from rig.analysis.equations import STRAY

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from rig.analysis.components import Components
    from rig.analysis.drop_model import DropModel
    from rig.analysis.equations import Residuals

    Array = NDArray[np.float64]

STATED_WEIGHT = 1.0
"""Members that a stated uncertainty counts for."""
_INNER = 40  # steps of sums over few bins; the next round of the joint fit goes on from there
_BINS = 64


class Evidence:
    """Sums over a session, and the components that follow.

    Parameters
    ----------
    components
        With which the sums are made.

    Attributes
    ----------
    components
        After `settled`, the new ones.
    degrees
        Degrees of freedom of each.
    """

    def __init__(self, components: Components) -> None:
        self.components = components
        self.degrees: dict[str, float] = {}
        self._squares = dict.fromkeys(("gates", "rods", "beam", "hang"), 0.0)
        self._determined = dict.fromkeys(("gates", "rods", "beam", "hang"), 0.0)
        self._impulses: list[tuple[float, float, float]] = []
        self._edges: list[tuple[Array, Array]] = []

    def common(self, name: str, y: Array, v: Array, sd: Array) -> None:
        """Count a block of the session's unknowns.

        Parameters
        ----------
        y, v
            Estimates and variances in units of the prior uncertainties `sd`.
        """
        # Clock, gravity, drop and air are one number each: one number has no scatter to estimate.
        kind = {"beams": "gates", "ripple": "beam"}.get(name)
        if name.endswith(" rods"):
            kind = "rods"
        if kind is not None:
            self._count(kind, y[sd > 0.0], v[sd > 0.0])

    def drop(self, model: DropModel, y: Array, v: Array) -> None:
        """Count the unknowns of one drop, in units of their prior uncertainties."""
        at = model.unknowns
        for role in model.records:
            self._count("hang", y[at[f"{role} hang"]], v[at[f"{role} hang"]])
        if "impulses" in at:
            block, alpha = at["impulses"], abs(model.guesses["impact"].alpha)
            # Back to α², for drops of different α have different units.
            variance = self.components.impulses(alpha) ** 2
            self._impulses.append(
                (alpha**2, float(y[block] @ y[block]) * variance, float(np.sum(1.0 - v[block])))
            )

    def edges(self, residuals: Iterable[Residuals]) -> None:
        """Count what is left over of the edges that are no part of a flicker."""
        for row in residuals:
            good = row.clean & (np.abs(row.values) <= STRAY * row.sigma)
            self._edges.append((row.values[good] ** 2, row.speed[good] ** 2))

    def _count(self, kind: str, y: Array, v: Array) -> None:
        self._squares[kind] += float(y @ y)
        self._determined[kind] += float(np.sum(1.0 - v))

    def settled(self, parameters: float) -> Evidence:
        """Estimate the components.

        Parameters
        ----------
        parameters
            Number of unknowns that all edges together have determined.
        """
        old = self.components
        new: dict[str, float] = {}
        for kind, found in self._squares.items():
            stated = (getattr(STATED, kind) / getattr(old, kind)) ** 2
            self.degrees[kind] = STATED_WEIGHT + self._determined[kind]
            share = (STATED_WEIGHT * stated + found) / self.degrees[kind]
            least = LEAST_SHARE * getattr(STATED, kind)
            new[kind] = max(getattr(old, kind) * share**0.5, least)
        if self._impulses:
            sizes, squares, counts = np.array(self._impulses).T
            self._pair("impulse", "impulse_floor", (squares, counts, sizes), new)
        squares, speeds = (np.concatenate(parts) for parts in zip(*self._edges, strict=True))
        # Every unknown that the edges determine takes one degree of freedom, at all speeds alike.
        free = max(0.5, 1.0 - parameters / max(1, squares.size))
        # Edges at about the same speed scatter alike: few bins do as well as all of them.
        counts, edges = np.histogram(speeds, _BINS)
        sums, _ = np.histogram(speeds, edges, weights=squares)
        middles = 0.5 * (edges[1:] + edges[:-1])
        self._pair("jitter", "floor", (sums, free * counts, middles), new)
        self.components = replace(old, **new)
        return self

    def _pair(
        self, name: str, floor: str, sums: tuple[Array, Array, Array], new: dict[str, float]
    ) -> None:
        """Estimate two components that make up one variance, see `_two`."""
        squares, counts, sizes = sums
        # The stated member is spread over all sizes, so that it pulls neither component alone.
        stated = sizes * getattr(STATED, name) ** 2 + getattr(STATED, floor) ** 2
        share = STATED_WEIGHT / sizes.size
        squares, counts = squares + share * stated, counts + share
        begin = getattr(self.components, name), getattr(self.components, floor)
        least = LEAST_SHARE * getattr(STATED, name), LEAST_SHARE * getattr(STATED, floor)
        new[name], new[floor] = _two(squares, counts, sizes, begin, least)
        self.degrees[name] = self.degrees[floor] = float(counts.sum())


def _two(
    squares: Array,
    counts: Array,
    sizes: Array,
    begin: tuple[float, float],
    least: tuple[float, float],
) -> tuple[float, float]:
    """Fit variances sizes·a² + b² to sums of squares with so many degrees of freedom.

    The maximum of the χ² likelihood above the least a and b, by multiplicative steps.
    """
    a, b = begin[0] ** 2, begin[1] ** 2
    for _ in range(_INNER):
        total = a * sizes + b
        a = max(a * _explained(squares, counts, total, sizes), least[0] ** 2)
        total = a * sizes + b
        b = max(b * _explained(squares, counts, total, np.ones_like(sizes)), least[1] ** 2)
    return a**0.5, b**0.5


def _explained(squares: Array, counts: Array, total: Array, sizes: Array) -> float:
    """How much larger a component is than it was thought to be, in the light of all sums."""
    weight = sizes / total**2
    return float(weight @ squares) / max(float(weight @ (counts * total)), np.finfo(float).tiny)
