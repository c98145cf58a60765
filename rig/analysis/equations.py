"""One chain's observation equations, the edges they are made of, and a drop's normal equations."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.swing import drawn, lever

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.drop_model import DropModel
    from rig.protocol.protocol import Protocol
    from rig.units import Quantity

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]
    Index = NDArray[np.intp]
    Matches = Mapping[str, Sequence[Index]]

HUBER = 4.0
"""Standard deviations beyond which an edge counts less."""
STRAY = 6.0
"""Standard deviations: no rod is that far off once everything was adjusted."""
SLOWED = 0.5
"""Share of its speed that a rod loses at most whose one end strikes: that of a uniform rod which
turns about its middle, thrown back as fast as it came (Eq. 5 with β = 1 and ξ = ⅓)."""
_ALIKE = 0.01  # by which the root of an edge's weight may differ and still be the same


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
    unknowns
        Number of all.
    """

    residuals: Residuals
    told: Array
    slopes: Array
    columns: Index
    unknowns: int

    @property
    def jacobian(self) -> Array:
        """Derivatives by all unknowns, shape ``(edges, unknowns)``."""
        found = np.zeros((self.slopes.shape[0], self.unknowns))
        found[:, self.columns] = self.slopes
        return found


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
    rods: Index
    gate: Index
    sign: Array
    turn: Array
    drawn: Array
    alone: Flags
    landed: Array
    paired: Flags


class Expected(NamedTuple):
    """All gates of a side one after another.

    Attributes
    ----------
    times, burst
        Of every observed edge, see `rig.analysis.chain_records.EdgeTrain`.
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
        How much higher it may be there because it struck before, m; one standard deviation.
    begins, ends
        Number of observed edges before each gate, and of expected ones after each.
    """

    times: Array
    burst: Array
    rods: Index
    gate: Index
    levels: Array
    sign: Array
    turn: Array
    drawn: Array
    alone: Flags
    landed: Array
    begins: Index
    ends: Index

    @classmethod
    def of(cls, record: ChainRecord, protocol: Protocol) -> Expected:
        """Join the gates of a side."""
        trains, strikes = record.trains, record.strikes
        observed = np.array([train.times.size for train in trains])
        expected = [train.rods.size for train in trains]
        rods = np.concatenate([train.rods for train in trains])
        levels = np.concatenate([train.levels for train in trains])
        alone = rods == strikes.size - 1
        alone &= levels < (
            -strikes[-2] if record.ratios is not None and strikes.size > 1 else -np.inf
        )
        left = np.where(alone, levels + strikes[-1], np.inf)  # of the top rod's way
        return cls(
            np.concatenate([train.times for train in trains]),
            np.concatenate([train.burst for train in trains]),
            rods,
            np.repeat([train.gate for train in trains], expected),
            levels,
            np.where(np.concatenate([train.blocks for train in trains]), -0.5, 0.5),
            np.where(rods % 2, -1.0, 1.0),
            drawn(lever(record.chain.chain)[rods], protocol, levels),
            alone,
            _landed(protocol.contact.strike, left),
            np.cumsum(observed) - observed,
            np.cumsum(expected),
        )

    def chosen(self, matches: Sequence[Index]) -> tuple[Index, Index]:
        """Expected edges that are matched, and the observed edge of each."""
        match = np.concatenate(matches)
        begins = np.repeat(self.begins, [one.size for one in matches])
        pick = np.flatnonzero(match >= 0)
        return pick, (match + begins)[pick]

    def seen(self, matches: Sequence[Index]) -> Seen:
        """Join the expected edges that are matched and the observed edge of each."""
        pick, edge = self.chosen(matches)
        return Seen(
            pick,
            self.times[edge],
            self.burst[edge],
            self.rods[pick],
            self.gate[pick],
            self.sign[pick],
            self.turn[pick],
            self.drawn[pick],
            self.alone[pick],
            self.landed[pick],
            self._pairs(pick),
        )

    def _pairs(self, pick: Index) -> Flags:
        found = np.zeros(pick.size, dtype=np.bool_)
        rods, gate = self.rods[pick], self.gate[pick]
        found[:-1] = (rods[1:] == rods[:-1]) & (gate[1:] == gate[:-1])
        return found


def _landed(strike: Quantity, left: Array) -> Array:
    """See `Expected.landed`: normally distributed strikes, from which on a rod is slower."""
    found = np.zeros_like(left)
    if strike.u <= 0.0:
        return found
    for place in np.flatnonzero(np.isfinite(left)):
        z = (float(left[place]) - strike.value) / strike.u
        beyond = 0.5 * math.erfc(z / math.sqrt(2.0))
        square = (1.0 + z * z) * beyond - z * math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
        found[place] = SLOWED * strike.u * math.sqrt(max(square, 0.0))
    return found


def robust_weights(residuals: Array, cut: float = math.inf) -> Array:
    """What the square of each standardized residual counts: less beyond 4 σ (Huber 1964).

    Parameters
    ----------
    cut
        Standard deviations beyond which an edge does not count at all.
    """
    far = np.abs(residuals)
    found: Array = np.where(far > cut, 0.0, HUBER / np.maximum(far, HUBER))
    return found


def scaled(x: Array, sd: Array) -> Array:
    """In units of the prior uncertainty; what is known exactly stays."""
    return np.divide(x, sd, out=np.zeros_like(x), where=sd > 0.0)


class KeptSlopes(NamedTuple):
    """The slopes that normal equations were made of.

    Attributes
    ----------
    slopes
        √W J/σ of one side, shape ``(edges, columns)``.
    columns
        Which unknowns its columns are.
    weights, scale
        √W and √W/σ of each edge.
    """

    slopes: Array
    columns: Index
    weights: Array
    scale: Array

    def weighing(self, edges: Index, weights: Array, scale: Array) -> KeptSlopes:
        """Return the same with other weights of some edges."""
        new = KeptSlopes(self.slopes.copy(), self.columns, self.weights.copy(), self.scale.copy())
        new.slopes[edges] *= (scale[edges] / self.scale[edges])[:, None]
        new.weights[edges], new.scale[edges] = weights[edges], scale[edges]
        return new

    def placed(self, rows: Sequence[int], places: Sequence[int]) -> KeptSlopes:
        """Return the same of a vector that has each of the unknowns `rows` at `places`."""
        position = np.full(max(rows) + 1, -1)
        position[self.columns] = np.arange(self.columns.size)
        mine = position[np.array(rows)]
        found = mine >= 0
        columns = np.array(places)[found]
        return self._replace(slopes=self.slopes[:, mine[found]], columns=columns)


@dataclass(frozen=True, slots=True)
class NormalEquations:
    """½‖r/σ‖² about a point, to second order.

    Attributes
    ----------
    matrix
        JᵀWJ in units of the prior uncertainties, shape ``(unknowns, unknowns)``.
    vector
        JᵀWr likewise, shape ``(unknowns,)``.
    chi2, size
        Weighted sum of squares, and number of edges.
    plain
        Matrix and vector in the unknowns' own units, where they were set up from edges.
    slopes
        Then also those of each side.
    """

    matrix: Array
    vector: Array
    chi2: float
    size: int
    plain: tuple[Array, Array] | None = None
    slopes: Mapping[str, KeptSlopes] = field(default_factory=dict)

    def in_units(self, sd: Array) -> NormalEquations:
        """Return the same where other priors are the units."""
        assert self.plain is not None
        matrix, vector = self.plain
        return replace(self, matrix=matrix * np.outer(sd, sd), vector=vector * sd)


def plain_equations(residuals: Array, slopes: Array, sd: Array) -> NormalEquations:
    """Set up the normal equations of observations that are all good.

    Parameters
    ----------
    residuals, slopes
        In standard deviations of each, shapes ``(observations,)`` and ``(observations, unknowns)``.
    sd
        As in `normal_equations`.
    """
    scaled_slopes = slopes * sd
    return NormalEquations(
        scaled_slopes.T @ scaled_slopes,
        scaled_slopes.T @ residuals,
        float(residuals @ residuals),
        residuals.size,
    )


def normal_equations(
    model: DropModel,
    matches: Matches,
    x: Array,
    sd: Array,
    inflation: float = 1.0,
    cut: float = math.inf,
) -> NormalEquations:
    """Set up the normal equations; residuals beyond 4 σ weigh less (Huber).

    A side knows nothing of the other's unknowns: only its own are multiplied.

    Parameters
    ----------
    sd
        Prior standard uncertainties of the unknowns; where 0 the unknown stays as it is.
    inflation
        How much more the edges scatter than the model assumes.
    cut
        Standard deviations beyond which an edge does not count.
    """
    matrix, vector = np.zeros((x.size, x.size)), np.zeros(x.size)
    chi2, size = 0.0, 0
    kept: dict[str, KeptSlopes] = {}
    for role, match in matches.items():
        left, _, slopes, columns, _ = model.equations(role, x, match)
        residuals, weights, scale = _weighed(left, inflation, cut)
        slopes *= scale[:, None]  # in place: nobody else has them
        kept[role] = KeptSlopes(slopes, columns, weights, scale)
        matrix[np.ix_(columns, columns)] += slopes.T @ slopes
        vector[columns] += slopes.T @ residuals
        chi2 += float(residuals @ residuals)
        size += residuals.size
    # A column's unit is applied to few numbers instead of to each edge.
    return NormalEquations(
        matrix * np.outer(sd, sd), vector * sd, chi2, size, (matrix, vector), kept
    )


def with_kept_slopes(
    model: DropModel,
    matches: Matches,
    x: Array,
    sd: Array,
    inflation: float,
    near: NormalEquations,
    *,
    rough: bool = False,
) -> NormalEquations:
    """Set up the normal equations about a point that is near another one, with its slopes.

    That takes a quarter of the time: what is left over of each edge is new, where it leads is not.

    Parameters
    ----------
    near
        Those about the other point; the rest as in `normal_equations`.
    rough
        Whether edges may count as they did there.
    """
    assert near.plain is not None
    matrix, vector, chi2 = near.plain[0], np.zeros(x.size), 0.0
    kept = dict(near.slopes)
    for role, match in matches.items():
        left, old = model.left_over(role, x, match), near.slopes[role]
        residuals, weights, scale = _weighed(left, inflation)
        other = np.flatnonzero(np.abs(weights - old.weights) > _ALIKE)
        if other.size and not rough:
            # Few edges count otherwise than there.
            kept[role] = new = old.weighing(other, weights, scale)
            place = np.ix_(old.columns, old.columns)
            more, less = new.slopes[other], old.slopes[other]
            matrix = matrix.copy()
            matrix[place] += more.T @ more - less.T @ less
            old = new
        scale = old.scale if rough else scale**2 / old.scale
        vector[old.columns] += (left.values * scale) @ old.slopes
        chi2 += float(residuals @ residuals)
    same = matrix is near.plain[0]
    return replace(
        near,
        matrix=near.matrix if same else matrix * np.outer(sd, sd),
        vector=vector * sd,
        chi2=chi2,
        plain=(matrix, vector),
        slopes=kept,
    )


def _weighed(
    left: Residuals, inflation: float, cut: float = math.inf
) -> tuple[Array, Array, Array]:
    """Weigh residuals in standard deviations; then see `KeptSlopes`."""
    sigma = left.sigma * inflation
    residuals = left.values / sigma
    weights = np.sqrt(robust_weights(residuals, cut))
    residuals *= weights
    return residuals, weights, weights / sigma
