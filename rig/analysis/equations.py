"""One chain's observation equations, the edges they are made of, and a drop's linearization."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.square_root import EquationRows
from rig.analysis.swing import drawn, lever, strike_shifts

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.drop_model import DropModel
    from rig.arrays import Array, Flags, Index
    from rig.protocol.protocol import Protocol

    Matches = Mapping[str, Sequence[Index]]

HUBER = 4.0
"""Standard deviations beyond which an edge counts less."""
STRAY = 6.0
"""Standard deviations: no rod is that far off once everything was adjusted."""
SLOWED = 0.5
"""Share of its speed that a rod loses at most whose one end strikes: that of a uniform rod which
turns about its middle, thrown back as fast as it came (Eq. 5 with β = 1 and ξ = ⅓)."""


class Residuals(NamedTuple):
    """What is left over of one side's matched edges, shape ``(edges,)`` each.

    Attributes
    ----------
    values
        Where the beam saw the rod's side less where the beam is, m.
    sigma
        Standard deviation of each, m.
    speed
        Of the chain at each edge, m/s.
    clean
        Whether each edge is no part of a flicker.
    loose
        How loose the chain was, see `rig.analysis.trajectory.Trajectory.loose`.
    """

    values: Array
    sigma: Array
    speed: Array
    clean: Flags
    loose: Array


class Equations(NamedTuple):
    """Observation equations of one side, one a matched edge, independent of each other.

    Attributes
    ----------
    residuals
        Their left sides.
    told
        Which share of the equation before was taken away from each, shape ``(edges,)``: both sides
        of a rod are off together.
    slopes
        Derivatives by the unknowns that this side knows of, shape ``(edges, columns)``.
    columns
        Which unknowns these are; shape ``(columns,)``.
    """

    residuals: Residuals
    told: Array
    slopes: Array
    columns: Index


class Seen(NamedTuple):
    """The matched edges of a side, shape ``(edges,)`` each; see `Expected`.

    Attributes
    ----------
    pick
        Which of the expected edges each is.
    paired
        Whether the next edge is the other side of the same rod at the same gate.
    """

    pick: Index
    times: Array
    burst: Array
    alone: Flags
    landed: Array
    paired: Flags


class Expected(NamedTuple):
    """All gates of a side one after another.

    Attributes
    ----------
    rods, gate, levels
        Of every expected edge.
    sign
        By how much its height follows the rods' width: −½ where it darkens the beam, else ½.
    turn
        Which way its rod is tilted: +1 for even rods, −1 for odd ones.
    drawn
        See `rig.analysis.swing.drawn`, of its rod.
    alone
        Whether all rods below have struck: only the top rod falls.
    landed
        How much higher its rod may be there because it struck before, m; one standard deviation.
    ends
        Number of expected edges after each gate.
    """

    rods: Index
    gate: Index
    levels: Array
    sign: Array
    turn: Array
    drawn: Array
    alone: Flags
    landed: Array
    ends: Index

    @classmethod
    def of(cls, record: ChainRecord, protocol: Protocol) -> Expected:
        """Join the gates of a side."""
        trains, strikes = record.trains, record.strikes
        expected = [train.rods.size for train in trains]
        rods = np.concatenate([train.rods for train in trains])
        levels = np.concatenate([train.levels for train in trains])
        last_falling = rods == strikes.size - 1
        last_falling &= levels < (
            -strikes[-2] if record.ratios is not None and strikes.size > 1 else -np.inf
        )
        u = np.full(rods.size, protocol.contact.strike.u)
        if record.chain.diameters and protocol.contact.strike.u:
            # Others but the top rod may strike the one before, which may be thicker.
            before = np.append(0.0, record.chain.diameters[:-1])[rods]
            u = np.where(rods < strikes.size - 1, np.maximum(u, before), u)
        to_strike = np.full(rods.size, np.inf)  # of each rod's way until it strikes
        if record.ratios is not None:
            if strikes.size > 1:
                u = np.hypot(u, protocol.priors.swing * strike_shifts(record, protocol)[rods])
            to_strike = levels + strikes[rods] - protocol.contact.strike.value
        return cls(
            rods,
            np.repeat([train.gate for train in trains], expected),
            levels,
            np.where(np.concatenate([train.blocks for train in trains]), -0.5, 0.5),
            np.where(rods % 2, -1.0, 1.0),
            drawn(lever(record.chain.chain)[rods], protocol, levels),
            last_falling,
            _landed(u, to_strike),
            np.cumsum(expected),
        )

    def seen(self, pick: Index, times: Array, burst: Array) -> Seen:
        """Join the expected edges that are matched and what was observed of each."""
        paired = np.zeros(pick.size, dtype=np.bool_)
        rods, gate = self.rods[pick], self.gate[pick]
        paired[:-1] = (rods[1:] == rods[:-1]) & (gate[1:] == gate[:-1])
        last_falling, landed = self.alone[pick], self.landed[pick]
        return Seen(pick, times, burst, last_falling, landed, paired)


def _landed(u: Array, to_strike: Array) -> Array:
    """See `Expected.landed`: normally distributed strikes, from which on a rod is slower."""
    sd = np.zeros_like(to_strike)
    for place in np.flatnonzero(np.isfinite(to_strike) & (u > 0.0)):
        z = float(to_strike[place] / u[place])
        beyond = 0.5 * math.erfc(z / math.sqrt(2.0))
        square = (1.0 + z * z) * beyond - z * math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
        sd[place] = SLOWED * u[place] * math.sqrt(max(square, 0.0))
    return sd


def robust_weights(residuals: Array, cut: float = math.inf) -> Array:
    """What the square of each standardized residual counts: less beyond 4 σ (Huber 1964).

    Parameters
    ----------
    cut
        Standard deviations beyond which an edge does not count at all.
    """
    far = np.abs(residuals)
    weights: Array = np.where(far > cut, 0.0, HUBER / np.maximum(far, HUBER))
    return weights


def scaled(x: Array, sd: Array) -> Array:
    """In units of the prior uncertainty; what is known exactly stays."""
    return np.divide(x, sd, out=np.zeros_like(x), where=sd > 0.0)


@dataclass(frozen=True, slots=True)
class Linearization:
    """Observations about a point, to first order, in standard deviations.

    Attributes
    ----------
    rows
        What they leave over and their slopes, in the unknowns' own units; one block a side.
    chi2, size
        Weighted sum of squares, and number of observations.
    loss
        Sum of Huber's losses, twice: what a step has to make less.
    """

    rows: Mapping[str, EquationRows]
    chi2: float
    size: int
    loss: float


def linearize(
    model: DropModel, matches: Matches, x: Array, inflation: float = 1.0, cut: float = math.inf
) -> Linearization:
    """Linearize the matched edges about a point; residuals beyond 4 σ weigh less (Huber).

    A side knows nothing of the other's unknowns.

    Parameters
    ----------
    inflation
        How much more the edges scatter than the model assumes.
    cut
        Standard deviations beyond which an edge does not count.
    """
    rows: dict[str, EquationRows] = {}
    chi2, loss, size = 0.0, 0.0, 0
    for role, match in matches.items():
        side, _, slopes, columns = model.equations(role, x, match)
        sigma = side.sigma * inflation
        residuals = side.values / sigma
        root = np.sqrt(robust_weights(residuals, cut))
        residuals *= root
        slopes *= (root / sigma)[:, None]  # in place: nobody else has them
        rows[role] = EquationRows(slopes, residuals, columns)
        squares = residuals * residuals
        chi2 += float(squares.sum())
        # Huber's losses, twice: 2·4|r| − 4² beyond 4 σ.
        loss += float(squares.sum()) + float((squares - HUBER**2)[root < 1.0].sum())
        size += residuals.size
    return Linearization(rows, chi2, size, loss)
