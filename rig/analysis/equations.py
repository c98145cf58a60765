"""Observation equations of a chain, its expected and matched edges, and their linearization."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.chain_records import ChainRecord
from rig.analysis.departures import drawn, lever, strike_u
from rig.analysis.square_root import EquationRows
from rig.arrays import Array, Flags, Index
from rig.protocol.protocol import Protocol

if TYPE_CHECKING:
    from rig.analysis.drop_model import DropModel

    Matches = Mapping[str, Index] | Mapping[str, "Seen"]

HUBER = 4.0
"""Standard deviations beyond which a value is unusual: an edge is given less weight, and drag below
zero is no chance."""
STRAY = 6.0
"""Standard deviations beyond which an edge belongs to no rod after the fit."""
SHARED = 0.5
"""Share of the variance of an early strike that a rod's edges have in common; the rest is each
edge's own."""
SLOWED = 0.5
"""Largest share of its speed that a rod loses when one end strikes: a uniform rod that turns
about its middle and rebounds elastically (Eq. 5 with β = 1 and ξ = ⅓)."""


class Residuals(NamedTuple):
    """Residuals of one side's matched edges, shape ``(edges,)`` each; of many ``(drops, edges)``.

    Attributes
    ----------
    values
        Height of the rod's side at the edge by the model, less that of the beam, m.
    sigma
        Standard deviation of each residual, m.
    speed
        Speed of the chain at each edge, m/s.
    clean
        Whether each edge is outside any flicker.
    loose
        `rig.analysis.trajectory.Trajectory.loose` at each edge; 0 where the top rod falls alone.
    """

    values: Array
    sigma: Array
    speed: Array
    clean: Flags
    loose: Array


class Equations(NamedTuple):
    """Independent observation equations of one side, one for each matched edge.

    Attributes
    ----------
    residuals
        Residual of each equation.
    told
        Share of the previous equation that was subtracted from each, shape ``(edges,)``: both
        edges of a rod are correlated.
    slopes
        Derivatives by the unknowns that act on this side, shape ``(edges, columns)``.
    columns
        Places of these unknowns in the drop's vector; shape ``(columns,)``.
    """

    residuals: Residuals
    told: Array
    slopes: Array
    columns: Index


class Seen(NamedTuple):
    """The matched edges of a side, shape ``(edges,)`` each; see `ExpectedEdges`.

    Attributes
    ----------
    pick
        Number of the expected edge that each is matched to.
    paired
        Whether the next edge is the other side of the same rod at the same gate.
    """

    pick: Index
    times: Array
    burst: Array
    alone: Flags
    landed: Array
    paired: Flags


class ExpectedEdges(NamedTuple):
    """The expected edges of a side, gate by gate; shape ``(edges,)`` each.

    Attributes
    ----------
    rods, gate, levels
        Rod, gate and height of the reference point, m, at every expected edge.
    sign
        Derivative of its height by the rod's width: −½ for an edge that darkens the beam, else ½.
    turn
        Sense of its rod's tilt: +1 for even rods, −1 for odd rods.
    drawn
        Derivative of its height by swing, see `rig.analysis.departures.drawn`.
    alone
        Whether the top rod falls alone, all rods below having struck.
    landed
        Standard deviation of its rod's height from a possible earlier strike, m.
    landed_bare
        The same on a board without a heap. Further off, an edge may be that of another rod.
    """

    rods: Index
    gate: Index
    levels: Array
    sign: Array
    turn: Array
    drawn: Array
    alone: Flags
    landed: Array
    landed_bare: Array

    @classmethod
    def of(cls, record: ChainRecord, protocol: Protocol) -> ExpectedEdges:
        """Return the expected edges of a side at all its gates."""
        (rods, blocks, levels, gate, _), strikes = record.due, record.strikes
        alone, landed_bare = np.zeros(rods.size, dtype=np.bool_), np.zeros(rods.size)
        landed = landed_bare
        if record.ratios is not None and strikes.size > 1:
            alone = (rods == strikes.size - 1) & (levels < -strikes[-2])
            to_strike = levels + strikes[rods] - protocol.contact.strike.value
            u = strike_u(record, protocol)
            both = np.stack([u, np.hypot(u, 2.0 * record.heap)])
            landed_bare, landed = _landing_sd(both[:, rods], to_strike)
        return cls(
            rods,
            gate,
            levels,
            np.where(blocks, -0.5, 0.5),
            np.where(rods % 2, -1.0, 1.0),
            drawn(lever(record.chain.chain)[rods], protocol, levels),
            alone,
            landed,
            landed_bare,
        )

    def seen(self, pick: Index, times: Array, burst: Array) -> Seen:
        """Return the matched edges: expected numbers `pick` with observed times and bursts."""
        paired = np.zeros(pick.size, dtype=np.bool_)
        rods, gate = self.rods[pick], self.gate[pick]
        paired[:-1] = (rods[1:] == rods[:-1]) & (gate[1:] == gate[:-1])
        return Seen(pick, times, burst, self.alone[pick], self.landed[pick], paired)


def _landing_sd(u: Array, to_strike: Array) -> Array:
    """Return `ExpectedEdges.landed`: strikes slow their rods.

    A strike is on average ½u off its height, with exponential tails: rods lie on rods.
    """
    off = 0.5 * u
    far = np.divide(np.abs(to_strike), off, out=np.full_like(off, np.inf), where=off > 0.0)
    tail = off**2 * np.exp(-far)
    square = np.where(to_strike > 0.0, tail, to_strike**2 + 2.0 * off**2 - tail)
    return np.asarray(SLOWED * np.sqrt(square))


def robust_weights(residuals: Array, cut: float = math.inf) -> Array:
    """Return the weights of squared standardized residuals, below 1 beyond 4 σ (Huber 1964).

    Parameters
    ----------
    cut
        Standard deviations beyond which the weight is 0.
    """
    far = np.abs(residuals)
    return np.asarray(np.where(far > cut, 0.0, HUBER / np.maximum(far, HUBER)))


def standardise(x: Array, sd: Array) -> Array:
    """Return unknowns in units of their prior uncertainties; 0 for those known exactly."""
    return np.divide(x, sd, out=np.zeros_like(x), where=sd > 0.0)


@dataclass(frozen=True, slots=True)
class Linearization:
    """Observations linearized about a point, in standard deviations.

    Attributes
    ----------
    rows
        Residuals and their derivatives by the unknowns in SI units, one block for each side.
    chi2, size
        Weighted sum of squares, and number of observations.
    loss
        Twice the sum of Huber's losses, which the fit minimizes.
    """

    rows: Mapping[str, EquationRows]
    chi2: float
    size: int
    loss: float


def linearize(
    model: DropModel, matches: Matches, x: Array, inflation: float = 1.0, cut: float = math.inf
) -> Linearization:
    """Linearize the matched edges about a point; residuals beyond 4 σ weigh less (Huber).

    Each side has rows only for the unknowns that act on it.

    Parameters
    ----------
    inflation
        Scatter of the edges relative to that of the model.
    cut
        Standard deviations beyond which an edge has no weight.
    """
    rows: dict[str, EquationRows] = {}
    chi2, loss, size = 0.0, 0.0, 0
    for role, match in matches.items():
        side, _, slopes, columns = model.equations(role, x, match)
        sigma = side.sigma * inflation
        residuals = side.values / sigma
        root = np.sqrt(robust_weights(residuals, cut))
        residuals *= root
        slopes *= (root / sigma)[..., None]  # in place: no other reference exists
        rows[role] = EquationRows(slopes, residuals, columns)
        squares = residuals * residuals
        chi2 += float(squares.sum())
        # Twice Huber's loss: 2·4|r| − 4² beyond 4 σ.
        loss += float(squares.sum()) + float((squares - HUBER**2)[root < 1.0].sum())
        size += residuals.size
    return Linearization(rows, chi2, size, loss)
