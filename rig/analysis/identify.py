"""Which fall a drop's edges are: a few readings, and one judge.

What annealing (`rig.analysis.annealing`) makes of each side's edges are its readings. Both sides
are decided together, for they were released together; the best pair, and whatever comes near it, is
adjusted with every unknown of the rig and weighed by its marginal likelihood (Laplace's method).
How much more likely the best reading is than the best really different one is the odds of the
identification.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rig.analysis.annealing import (
    LEAST,
    MISSED,
    PEAKS,
    Pairing,
    SideFall,
    log_density,
)
from rig.analysis.chain_records import SIDES, chain_records
from rig.analysis.drop_model import DropModel
from rig.analysis.equations import HUBER, STRAY, scaled
from rig.analysis.fit import Begun, Fit, count_matched, settle
from rig.protocol.gates import CLEARANCE_M
from rig.reasons import Reason, make_reason
from rig.vocabulary import ANY_SCENE

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from rig.analysis.annealing import Annealed
    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.components import Components
    from rig.arrays import Index
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol, Run
    from rig.records import Drop
    from rig.vocabulary import Vocabulary


AnyReading = TypeVar("AnyReading", "Annealed", "Reading")

LEAD = math.log(1000.0)
"""Log odds of a reading against the likeliest really different one, below which neither counts."""
_CLEAR = 0.97
"""Share of all that could be matched with which no other start is tried."""
_FAIR = 0.9
"""The same with which a reading is good."""
RESTLESS = 2.0
"""Scatter of the edges about a motion, relative to the assumed one, that is remarked."""
_CLOSE = 30.0
"""Log odds of annealed readings within which they are adjusted: what linear unknowns leave out."""


@dataclass(frozen=True, slots=True)
class Reading:
    """One way to read a side's edges, or a whole drop's.

    Attributes
    ----------
    fit
        Matched and adjusted.
    evidence
        Logarithm of its marginal likelihood, up to what all readings of the same edges share.
    """

    fit: Fit
    evidence: float

    @property
    def edges(self) -> list[Index]:
        """For each side the edge of every expected one, −1 for a missed one."""
        return [np.concatenate(side) for side in self.fit.matches.values()]


@dataclass(frozen=True, slots=True)
class Identification:
    """The best reading of a drop.

    Attributes
    ----------
    fit
        All sides together; `None` where the edges of a side are like no fall of its chain at all.
    shares
        Of each side's expected edges, by role, that are matched.
    log_odds
        Of that reading against the best different one; infinite where there is none.
    evidence
        As in `Reading`.
    other
        That different reading, where it was adjusted: what else the edges may be.
    """

    fit: Fit | None
    shares: Mapping[str, float]
    log_odds: float = math.inf
    evidence: float = -math.inf
    other: Fit | None = None


@dataclass(frozen=True, slots=True)
class DropIdentity:
    """Which rods a drop's edges are, found out once, at a round time scale.

    The session's clock is known a little better with each further drop; which edge is which rod
    stays.

    Attributes
    ----------
    scale
        At which.
    unlike
        Why they are not one fall of each chain, by role; empty where they are.
    poor
        Roles of chains of which too few edges are where one fall would put them.
    begun
        The fall, as it was adjusted; `None` where there is none.
    explained
        What else than the protocol would explain edges that are like no fall; `None` if not sought.
    """

    scale: TimeScale
    unlike: Mapping[str, Reason]
    poor: tuple[str, ...] = ()
    begun: Begun | None = None
    explained: tuple[Reason, ...] | None = None


def identify_drop(
    protocol: Protocol,
    run: Run,
    drop: Drop,
    scale: TimeScale,
    components: Components,
    aside: Collection[int] = (),
    before: Begun | None = None,
) -> DropIdentity:
    """Find out which rods a drop's edges are; arguments as in `rig.analysis.drop.DropCase`.

    Parameters
    ----------
    before
        Where the chains were found to be with more gates.
    """
    earliest = -math.inf if drop.fire_tick is None else 0.0
    records = chain_records(protocol, run, drop, scale.hz, aside)
    if before is not None:
        model = DropModel.of(protocol, records, before.guesses, scale.u, components)
        same = settle(model, x=before.x)
        return DropIdentity(scale, {}, begun=Begun(before.guesses, same.matches, same.x))
    identification = identify(protocol, records, scale.u, components, earliest)
    unlike, fit = pattern_faults(identification, protocol.vocabulary), identification.fit
    if unlike or fit is None:
        poor = tuple(role for role, share in identification.shares.items() if share < LEAST)
        return DropIdentity(scale, unlike, poor)
    return DropIdentity(scale, unlike, begun=Begun(fit.model.guesses, fit.matches, fit.x))


def identify(
    protocol: Protocol,
    records: Sequence[ChainRecord],
    clock_u: float,
    components: Components,
    earliest: float = -math.inf,
    batches: int | None = None,
) -> Identification:
    """Find out which fall the edges are.

    Parameters
    ----------
    records
        The chains with their trains.
    clock_u
        Relative standard uncertainty of the time scale.
    components
        How much everything scatters.
    earliest
        When chains were let go at the earliest, s since the release fired.
    batches
        How many batches of starts are tried at most, the likeliest first.
    """
    model = DropModel.of(protocol, records, None, clock_u, components)
    readings = {role: _read(model.side(role), earliest, batches) for role in model.records}
    # Likelier than that all edges are strays and every rod was missed.
    if all(side and side[0].evidence > 0.0 for side in readings.values()):
        return _together(model, readings)
    matched = {
        role: max((reading.matched for reading in side), default=0)
        for role, side in readings.items()
    }
    return Identification(None, _shares(model, matched))


def pattern_faults(
    identification: Identification, words: Vocabulary = ANY_SCENE
) -> dict[str, Reason]:
    """Say why the edges are not one fall of each chain, by role; nothing where they are."""
    reasons = {
        role: make_reason("few_edges_fit", words, side=role, share=share)
        for role, share in identification.shares.items()
        if share < LEAST
    }
    if not reasons and identification.fit is None:
        return dict.fromkeys(identification.shares, make_reason("no_fall", words))
    if not reasons and identification.log_odds < LEAD:
        return dict.fromkeys(identification.shares, _ambiguous(words, identification))
    return reasons


def _ambiguous(words: Vocabulary, identification: Identification) -> Reason:
    """Say that two falls fit, and with which further gate only one of them would."""
    odds = math.exp(identification.log_odds)
    if identification.fit is None or identification.other is None:
        return make_reason("two_falls", words, odds=odds)
    side, height = deciding_gate(identification.fit, identification.other)
    return make_reason("two_falls_gate", words, odds=odds, side=side, height_m=height)


def read_quickly(
    protocol: Protocol, records: Sequence[ChainRecord], clock_u: float, components: Components
) -> Reading | None:
    """Read a drop like `identify`, but only near what is stated."""
    identification = identify(protocol, records, clock_u, components, batches=1)
    fit = identification.fit
    return None if fit is None else Reading(fit, identification.evidence)


def most_votes(
    protocol: Protocol, record: ChainRecord, clock_u: float, components: Components
) -> int:
    """Count the expected edges of a side that agree on one fall near the stated one, at most."""
    pairing = Pairing.of(record.trains, record.crossed)
    votes = SideFall.of(protocol, record, pairing, clock_u, components).most_votes()
    return min(votes, possible(record))  # of a flicker many edges vote for one rod


def well_read(reading: Reading) -> bool:
    """Whether nearly all that could be is matched, with no more scatter or strain than usual."""
    fit = reading.fit
    matchable = sum(possible(record) for record in fit.model.records.values())
    expected = sum(record.expected for record in fit.model.records.values())
    many = fit.matched >= max(LEAST * max(1, expected), _FAIR * matchable)
    strain = float(np.abs(scaled(fit.estimate.x, fit.estimate.sd)).max())
    return many and fit.estimate.scatter < RESTLESS and strain < STRAY


def possible(record: ChainRecord) -> int:
    """Count the edges of a side that could be rods by their gates and polarities alone."""
    return sum(
        min(
            int(np.count_nonzero(train.blocked == dark)),
            int(np.count_nonzero(train.blocks == dark)),
        )
        for train in record.trains
        for dark in (True, False)
    )


def _read(fall: SideFall, earliest: float, batches: int | None) -> list[Annealed]:
    """Anneal from one batch of starts after another while none explains the edges."""
    readings: list[Annealed] = []
    least, matchable = LEAST * fall.record.expected, possible(fall.record)
    if not fall.pairing.times.size or matchable < least:
        return readings
    for starts in itertools.islice(fall.starts(earliest, least), batches):
        if len(starts):
            readings = _ranked([*readings, *fall.anneal(starts, _CLOSE)])
            best = readings[0]
            if best.scatter < RESTLESS and best.matched >= max(least, _CLEAR * matchable):
                break
    return readings


def _ranked(readings: Iterable[AnyReading]) -> list[AnyReading]:
    """Order readings, the likeliest first, and leave out what is the same as a likelier one."""
    ranked: list[AnyReading] = []
    for reading in sorted(readings, key=lambda candidate: -candidate.evidence):
        if all(any(map(_unlike, reading.edges, likelier.edges)) for likelier in ranked):
            ranked.append(reading)
    return ranked


def _unlike(edges: Index, other_edges: Index) -> bool:
    """Whether two readings differ in more edges than may be strays or missed."""
    matched = int(np.count_nonzero((edges >= 0) | (other_edges >= 0)))
    return bool(np.count_nonzero(edges != other_edges) > max(SIDES, MISSED * matched))


def log_evidence(fit: Fit) -> float:
    """Logarithm of the marginal likelihood of a reading, up to what depends on the edges alone.

    A matched edge has the density of its time about the motion; a missed and an extra one what is
    known of such beforehand. The unknowns are integrated out by Laplace's method: −½‖y‖² −
    ln |det R| at the best estimate, with y and RᵀR in units of the prior uncertainties.
    """
    estimate, model = fit.estimate, fit.model
    total = 0.0
    for role, matches in fit.matches.items():
        rows = model.parted(role, model.residuals(role, estimate.x, matches), matches)
        sigma = rows.sigma * estimate.scatter
        beyond = np.maximum(np.abs(rows.values) / sigma - HUBER, 0.0)
        total += float(np.sum(log_density(rows.values, sigma, rows.speed) + 0.5 * beyond**2))
    y = scaled(estimate.x, estimate.sd)
    _, volume = np.linalg.slogdet(estimate.root)
    return total - 0.5 * float(y @ y) - float(volume) + held_back(fit)


def held_back(fit: Fit) -> float:
    """Log of the share of an estimated κ's distribution above zero, twice: air only holds back."""
    model, estimate = fit.model, fit.estimate
    at = model.unknowns["drag"].start
    if not estimate.sd[at]:
        return 0.0
    below = -model.kappa(estimate.x) / float(estimate.own_u[at]) / math.sqrt(2.0)
    return math.log(math.erfc(min(below, 26.0)))  # beyond which a double has no erfc


def _together(model: DropModel, readings: Mapping[str, Sequence[Annealed]]) -> Identification:
    """Weigh the readings of all sides against each other, and adjust those that come near."""
    pairs = []
    for pair in itertools.product(*readings.values()):
        together = _simultaneous(model.protocol, [side.guess.release for side in pair])
        pairs.append((sum(side.evidence for side in pair) + together, pair))
    pairs.sort(key=lambda row: -row[0])
    likeliest = pairs[0][0]
    close = [pair for likely, pair in pairs if likeliest - likely < _CLOSE][:PEAKS]
    tried: list[Reading] = []
    for pair in close:
        sides = dict(zip(readings, pair, strict=True))
        begun = model.changed(guesses={role: side.guess for role, side in sides.items()})
        matches = {
            role: model.pairings[role].numbered(side.edges[0]) for role, side in sides.items()
        }
        tried.append(weigh(settle(begun, matches)))
    best, *rest = _ranked(tried)
    shares = _shares(model, {role: count_matched(side) for role, side in best.fit.matches.items()})
    if not best.evidence > 0.0:
        return Identification(None, shares)
    odds = best.evidence - rest[0].evidence if rest else math.inf
    if len(pairs) > len(close):
        odds = min(odds, likeliest - pairs[len(close)][0])
    return Identification(best.fit, shares, odds, best.evidence, rest[0].fit if rest else None)


def _shares(model: DropModel, matched: Mapping[str, int]) -> dict[str, float]:
    return {role: count / max(1, model.records[role].expected) for role, count in matched.items()}


def weigh(fit: Fit) -> Reading:
    """Weigh a fit of all sides."""
    paths = [fit.model.trajectory(role, fit.x) for role in fit.model.records]
    evidence = log_evidence(fit) + _simultaneous(
        fit.model.protocol, [float(path.time[0]) for path in paths]
    )
    return Reading(fit, evidence if math.isfinite(evidence) else -math.inf)


def _simultaneous(protocol: Protocol, releases: Sequence[float]) -> float:
    """Log prior of how far apart two releases are: a Cauchy of the skew that is accepted."""
    apart = (max(releases) - min(releases)) / protocol.accept.release_skew
    return -math.log1p(apart**2)


def deciding_gate(likelier: Fit, rival: Fit) -> tuple[str, float]:
    """Find the beam that would see two falls differ most.

    A beam tells no rod by itself: of each edge of one fall it is compared how far the chain is from
    where the other fall has its nearest edge. On average over all edges that is most where rods
    come by at unlike intervals, or first and last ones at unlike moments.

    Parameters
    ----------
    likelier, rival
        Readings of the same drop.

    Returns
    -------
    role, height
        On which side, and how high above the zero of the protocol's heights, m. No hanging rod
        blocks it.
    """
    best = ("", 0.0, -1.0)
    protocol = likelier.model.protocol
    zero = 0.0 if protocol.stated is None else protocol.stated.drop.value - protocol.drop.value
    for role, record in likelier.model.records.items():
        paths = [fit.model.trajectory(role, fit.x) for fit in (likelier, rival)]
        places, drop = np.array(record.chain.chain.heights), protocol.drop
        start, blocked = drop.value, np.array(record.chain.widths) / 2.0 + max(CLEARANCE_M, drop.u)
        for height in np.arange(4e-3, start + float(places.max()), 4e-3).tolist():
            if np.any(np.abs(start + places - height) < blocked):
                continue
            levels = np.sort(height - places)[::-1]
            levels = levels[levels < min(float(path.height[0]) for path in paths)]
            if record.ratios is not None:
                levels = levels[levels > -places.max()]
            if levels.size == 0:
                continue
            times, rival_times = (path.times(levels) for path in paths)
            apart = np.abs(times[:, None] - rival_times).min(axis=1)
            mean = float(np.mean(apart * paths[0].heights(times)[1]))
            if mean > best[2]:
                best = role, height, mean
    return best[0], best[1] + zero
