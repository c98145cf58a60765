"""Identification of a drop: the assignment of its edges to rods with the largest evidence.

Annealing (`rig.analysis.annealing`) gives candidate readings of each side's edges. Both sides are
identified together, as they were released together. The best pairs of readings are fitted with all
unknowns of the rig and compared by marginal likelihood (Laplace's method). The odds of the
identification are those of the best reading against the best different reading.
"""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from rig.analysis.annealing import (
    ALPHA,
    LEAST,
    NAMES,
    PEAKS,
    START,
    FallFit,
    SideFall,
    count_matched,
)
from rig.analysis.chain_records import MISSED, SIDES, ChainRecord
from rig.analysis.distributions import BY_CHANCE
from rig.analysis.drop_model import DropModel
from rig.analysis.equations import STRAY
from rig.analysis.fit import Begun, DropFit, Fit, Matches, settle, simultaneous
from rig.arrays import Array
from rig.clock.calibration import TimeScale
from rig.protocol.gates import blocking_rod, hanging_rods
from rig.protocol.protocol import Protocol
from rig.reasons import Reason, make_reason
from rig.vocabulary import ANY_SCENE, Vocabulary

Reading = TypeVar("Reading", FallFit, Fit)

LEAD = -math.log(BY_CHANCE)
"""Least log odds of a reading against the likeliest different one; below, a drop is ambiguous."""
FAIR = 0.9
"""Matched share of the matchable edges above which a reading is good. With 0.95 fewer faults are
named; with as many misses as chance allows, few edges would hide a fault of the set-up."""
RESTLESS = 2.0
"""Scatter of the edges, relative to the assumed scatter, above which a remark is made."""
_CLOSE = 30.0
"""Log odds within which annealed readings are fitted: annealing leaves unknowns out."""


@dataclass(frozen=True, slots=True)
class Identification:
    """The best reading of a drop.

    Attributes
    ----------
    drop
        Matches and first estimates; `None` if the edges of a side match no fall of its chain.
        Fitted if there are rivals.
    shares
        Matched share of each side's expected edges, by role.
    log_odds
        Log odds against the best different reading; infinite if there is none.
    other
        Fit of the best different reading, if it was fitted.
    """

    drop: DropFit | None
    shares: Mapping[str, float]
    log_odds: float = math.inf
    other: Fit | None = None

    def fit_reading(self) -> Fit | None:
        """Fit the best reading; `None` if there is none that explains the edges."""
        drop = self.drop
        if drop is None:
            return None
        fit = drop if isinstance(drop, Fit) else settle(drop.model, drop.x, drop.matches)
        return fit if fit.evidence > 0.0 else None


@dataclass(frozen=True, slots=True)
class DropIdentity:
    """The identification of a drop, made once at a rounded time scale.

    Each further drop changes the session's time scale a little, but not the identification.

    Attributes
    ----------
    scale
        Rounded time scale.
    unlike
        Reasons why the edges do not match a fall of each chain, by role; empty if they do.
    begun
        Matches and first estimates; `None` if the drop was not identified.
    explained
        Set-up faults that would explain the edges; `None` if not searched for.
    """

    scale: TimeScale
    unlike: Mapping[str, Reason]
    begun: Begun | None = None
    explained: tuple[Reason, ...] | None = None


def identify(
    protocol: Protocol,
    records: Sequence[ChainRecord],
    clock_u: float,
    earliest: float = -math.inf,
    batches: int | None = None,
) -> Identification:
    """Return the best reading of a drop's edges, and its odds.

    Parameters
    ----------
    records
        The chains with their edges.
    clock_u
        Relative standard uncertainty of the time scale.
    earliest
        Earliest possible release, s since the release fired.
    batches
        Greatest number of batches of starts, the likeliest first; all if not given.
    """
    model = DropModel.of(protocol, records, clock_u)
    readings = {role: _read(SideFall(model, role), earliest, batches) for role in model.records}
    # Evidence is relative to all edges being strays and every rod missed.
    if all(side and side[0].evidence > 0.0 for side in readings.values()):
        return _together(model, readings)
    shares = {
        role: max((count_matched(reading.matches[role]) for reading in side), default=0)
        / max(1, model.records[role].edge_count)
        for role, side in readings.items()
    }
    return Identification(None, shares)


def pattern_faults(
    identification: Identification, words: Vocabulary = ANY_SCENE
) -> dict[str, Reason]:
    """Return reasons why the edges do not match a fall of each chain, by role; empty if they do."""
    reasons = few_edges(identification.shares, words)
    if not reasons and identification.drop is None:
        return dict.fromkeys(identification.shares, make_reason("no_fall", words))
    if not reasons and identification.log_odds < LEAD:
        odds = math.exp(identification.log_odds)
        return dict.fromkeys(identification.shares, make_reason("two_falls", words, odds=odds))
    return reasons


def few_edges(shares: Mapping[str, float], words: Vocabulary) -> dict[str, Reason]:
    """Return the reason for each side of whose edges too few fit a fall, by role."""
    return {
        role: make_reason("few_edges_fit", words, side=role, share=share)
        for role, share in shares.items()
        if share < LEAST
    }


def side_fall(protocol: Protocol, record: ChainRecord, clock_u: float) -> SideFall:
    """Return a side whose edges are to be counted that agree on a fall near the stated values."""
    return SideFall(DropModel(protocol, [record], clock_u), record.role)


def well_read(fit: Fit) -> bool:
    """Whether nearly all matchable edges are matched, with usual scatter and unknowns in range."""
    records = fit.model.records.values()
    expected = sum(record.edge_count for record in records)
    matchable = sum(pairing.matchable for pairing in fit.model.pairings.values())
    many = fit.match_count >= max(LEAST * max(1, expected), FAIR * matchable)
    strain = float(np.abs(fit.model.unknowns.pull(fit.x)).max())
    return many and fit.estimate.scatter < RESTLESS and strain < STRAY


def _read(fall: SideFall, earliest: float, batches: int | None) -> list[FallFit]:
    """Anneal batches of starts until a reading explains the edges; the likeliest first."""
    readings: list[FallFit] = []
    least, matchable = LEAST * fall.record.edge_count, fall.pairing.matchable
    enough = max(least, (1.0 - MISSED) * matchable)
    if not fall.record.edges.times.size or matchable < least:
        return readings
    for starts in itertools.islice(fall.starts(earliest, least), batches):
        if len(starts):
            readings = _rank_readings([*readings, *fall.anneal(starts, _CLOSE)])
            best = readings[0]
            if best.scatter < RESTLESS and count_matched(best.matches[fall.role]) >= enough:
                break
    return readings


def _rank_readings(readings: Iterable[Reading]) -> list[Reading]:
    """Sort readings, the likeliest first, without those that equal a likelier reading."""
    ranked: list[Reading] = []
    for reading in sorted(readings, key=lambda candidate: -candidate.evidence):
        if all(_unlike(reading.matches, likelier.matches) for likelier in ranked):
            ranked.append(reading)
    return ranked


def _unlike(matches: Matches, others: Matches) -> bool:
    """Whether two readings differ on a side in more edges than strays and missed edges explain."""
    for edges, other_edges in zip(matches.values(), others.values(), strict=True):
        matched = int(np.count_nonzero((edges >= 0) | (other_edges >= 0)))
        if np.count_nonzero(edges != other_edges) > max(SIDES, MISSED * matched):
            return True
    return False


def _together(model: DropModel, readings: Mapping[str, Sequence[FallFit]]) -> Identification:
    """Return the likeliest pair of both sides' readings with its odds; rivals are fitted first."""

    def likely(pair: Sequence[FallFit]) -> float:
        return sum(side.evidence for side in pair) + simultaneous(model, _merge(model, pair))

    pairs = sorted(itertools.product(*readings.values()), key=likely, reverse=True)
    likeliest = likely(pairs[0])
    close = [pair for pair in pairs if likeliest - likely(pair) < _CLOSE][:PEAKS]
    further = likeliest - likely(pairs[len(close)]) if len(pairs) > len(close) else math.inf
    drops = [_begin(model, pair) for pair in close]
    best, evidence, odds, other = drops[0], likeliest, further, None
    if len(drops) > 1:
        tried = [settle(drop.model, drop.x, drop.matches) for drop in drops]
        likelier, *rest = _rank_readings(tried)
        best, evidence = likelier, likelier.evidence
        if rest:
            odds, other = min(further, evidence - rest[0].evidence), rest[0]
    return Identification(best if evidence > 0.0 else None, best.shares, odds, other)


def _begin(model: DropModel, pair: Sequence[FallFit]) -> DropFit:
    """Return a drop with the matches and unknowns of annealed falls."""
    x = _merge(model, pair)
    alpha = float(x[model.unknowns["alpha"]][0]) if "impact" in model.records else 0.0
    matches = {role: side.matches[role] for role, side in zip(model.records, pair, strict=True)}
    return DropFit(model.copy_with(alpha=alpha), matches, x)


def _merge(model: DropModel, pair: Sequence[FallFit]) -> Array:
    """Return the unknowns of a drop: of what both sides have the mean, the rest of either."""
    x: Array = np.sum([side.x for side in pair], axis=0)
    for name in NAMES[START:ALPHA]:
        x[model.unknowns[name]] /= len(pair)
    return x


def deciding_gate(likelier: DropFit, rival: DropFit) -> tuple[str, float]:
    """Return the place of a further beam that would best separate two falls.

    A beam does not identify rods, so each edge of a fall is compared with the nearest edge of the
    other fall. The beam with the largest mean distance is chosen: there the intervals between
    rods, or the first and last passages, differ most.

    Parameters
    ----------
    likelier, rival
        Readings of the same drop.

    Returns
    -------
    role, height
        Side, and height above the zero of the protocol's heights, m. No hanging rod blocks the
        beam.
    """
    apart: dict[tuple[str, float], float] = {}
    protocol = likelier.model.protocol
    zero = 0.0 if protocol.stated is None else protocol.stated.drop.value - protocol.drop.value
    for role, record in likelier.model.records.items():
        paths = [fit.model.trajectory(role, fit.x) for fit in (likelier, rival)]
        places = np.array(record.chain.chain.heights)
        hanging = hanging_rods([record.chain], protocol.drop)
        start = min(float(path.height[0]) for path in paths)
        end = -math.inf if record.ratios is None else -places.max()
        for height in np.arange(4e-3, protocol.drop.value + places.max(), 4e-3).tolist():
            levels = np.sort(height - places)[::-1]
            levels = levels[(end < levels) & (levels < start)]
            if levels.size and not blocking_rod(hanging, height):
                times, rival_times = (path.times(levels) for path in paths)
                nearest = np.abs(times[:, None] - rival_times).min(axis=1)
                apart[role, height] = float(np.mean(nearest * paths[0].heights(times)[1]))
    role, height = max(apart, key=apart.__getitem__, default=("", 0.0))
    return role, height + zero
