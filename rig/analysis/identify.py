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
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rig.analysis.annealing import (
    ALPHA,
    CLOCK,
    DRAG,
    EVER,
    GROWTH,
    MISSED,
    PULL,
    RELEASE,
    SLOWEST,
    START,
    STRAYS,
    UNKNOWNS,
    Guess,
    SideFall,
)
from rig.analysis.discrepancy import STRETCHES
from rig.analysis.drop_model import DropModel, prior_air
from rig.analysis.equations import HUBER, scaled
from rig.analysis.fit import Fit, count_matched, settle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.annealing import Annealed, Span
    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.components import Components
    from rig.analysis.fit import Matches
    from rig.protocol.protocol import Protocol

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

Weighed = TypeVar("Weighed", "Annealed", "Reading")

_ANY_ALPHA = 0.25  # standard deviation of α about what the model expects
_CLEAR = 0.97  # share of all that could be matched with which no other start is tried
_FAIR = 0.9  # and with which a side tells the other when it was let go
_LEAST = 0.6  # and of all that is expected
_MARGIN = 3  # edges by which votes may fall short of what is matched
_CALM = 2.0  # scatter of edges above which a reading is none that ends the search
_STRAINED = 6.0  # standard uncertainties of any unknown, likewise
_OTHER = 0.02  # share of a side's edges at another rod that makes a different reading
_FEW = 2  # edges that make none: a stray in place of a missed edge
_CLOSE = 30.0  # log odds of annealed readings within which they are adjusted
_PAIRS = 4  # of readings, adjusted
_TOGETHER = 30e-3  # s: chains let go at once are not further apart, if it can be helped
_TAIL = 8.0  # standard deviations beyond which a normal distribution's tail is its first term


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
    def share(self) -> float:
        """Share of the expected edges that are matched."""
        expected = sum(record.expected for record in self.fit.model.records.values())
        return self.fit.matched / max(1, expected)


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


def identify(
    protocol: Protocol,
    records: Sequence[ChainRecord],
    clock_u: float,
    components: Components,
    window: Span = EVER,
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
    window
        Within which chains were let go, s since the release fired.
    """
    sides: list[_Side] = []
    # The free chain first: it tells when both were let go.
    near = window
    for record in reversed(records):
        side = _Side(protocol, record, clock_u, components)
        side.search(near)
        if near != window and not side.convincing(_FAIR):
            side.search(window)
        if side.convincing(_FAIR):
            near = _around([one.unknowns[RELEASE] for one in side.found], window)
        sides.insert(0, side)
    if not all(side.found for side in sides):
        return Identification(None, {side.record.role: side.share for side in sides})
    return _together(protocol, records, sides, clock_u, components)


def read_quickly(
    protocol: Protocol, records: Sequence[ChainRecord], clock_u: float, components: Components
) -> Reading | None:
    """Read a drop like `identify`, but only near what is stated."""
    sides = [_Side(protocol, record, clock_u, components) for record in records]
    for side in sides:
        side.search(EVER, batches=1)
        if not side.found:
            return None
        del side.found[1:]
    whole = _together(protocol, records, sides, clock_u, components)
    return None if whole.fit is None else weighed(whole.fit)


def most_votes(
    protocol: Protocol, record: ChainRecord, clock_u: float, components: Components
) -> int:
    """Count the expected edges of a side that agree on one fall near the stated one, at most."""
    return _Side(protocol, record, clock_u, components).fall.most_votes()


def well_read(reading: Reading) -> bool:
    """Whether nearly all that could be is matched, with no more scatter or strain than usual."""
    fit = reading.fit
    most = sum(possible(record) for record in fit.model.records.values())
    many = reading.share >= _LEAST and fit.matched >= _FAIR * most
    return many and fit.estimate.scatter < _CALM and _strain(fit) < _STRAINED


def _strain(fit: Fit) -> float:
    """How far the unknown that is farthest off is, in standard uncertainties of its prior."""
    return float(np.abs(scaled(fit.estimate.x, fit.estimate.sd)).max())


def possible(record: ChainRecord) -> int:
    """Count the edges of a side that could be rods by their gates and polarities alone."""
    count = 0
    for train in record.trains:
        dark, due = int(np.count_nonzero(train.blocked)), int(np.count_nonzero(train.blocks))
        count += min(dark, due) + min(train.blocked.size - dark, train.blocks.size - due)
    return count


def _around(releases: Sequence[float], window: Span) -> Span:
    """Return the part of a window that is near some releases; all of it where none is."""
    first, last = min(releases) - _TOGETHER, max(releases) + _TOGETHER
    if last < window[0] or first > window[1]:
        return window
    return max(window[0], first), min(window[1], last)


class _Side:
    """One chain's edges, to be read by themselves.

    Attributes
    ----------
    found
        Its readings, the likeliest first.
    """

    def __init__(
        self,
        protocol: Protocol,
        record: ChainRecord,
        clock_u: float,
        components: Components,
    ) -> None:
        self.record = record
        self.found: list[Annealed] = []
        stated = Guess(0.0, protocol.drop.value, record.alpha, prior_air(protocol)[0])
        self.model = DropModel(protocol, [record], {record.role: stated}, clock_u, components)
        self._tried = np.zeros((0, UNKNOWNS))
        self._most = 0

    @cached_property
    def fall(self) -> SideFall:
        """Its falls, as the edges may tell them."""
        model, record = self.model, self.record
        protocol, components = model.protocol, model.components
        kappa, kappa_u = prior_air(protocol)
        sd = np.zeros(UNKNOWNS)
        sd[START] = math.hypot(protocol.drop.u, components.hang)
        sd[CLOCK], sd[DRAG] = model.clock_u, kappa_u
        sd[PULL] = float(model.unknowns.sd[model.unknowns["gravity"]][0])
        if record.ratios is not None:
            sd[ALPHA], sd[GROWTH] = _ANY_ALPHA, protocol.priors.strings * abs(record.alpha)
        return SideFall(
            record,
            model.pairings[record.role],
            protocol.drop.value,
            protocol.gravity.value,
            kappa,
            sd,
            self._sigma(),
        )

    def _sigma(self) -> Array:
        """By how much every expected edge may be off a chain that falls as a whole, m."""
        (role,), model = self.model.records, self.model
        components, at, sd = model.components, model.unknowns, model.unknowns.sd
        gate = sd[at["beams"]][model.expected[role].gate]
        rod = sd[at[f"{role} rods"]][model.expected[role].rods]
        variance = components.floor**2 + gate**2 + rod**2 + float(sd[at[f"{role} width"]][0]) ** 2
        if self.record.ratios is not None:
            variance += components.departure**2
            stretch = model.discrepancy.stretch
            for name in STRETCHES:
                variance += (stretch * sd[at[name]]) ** 2 @ np.ones(stretch.shape[1])
        return np.asarray(np.sqrt(variance))

    @property
    def share(self) -> float:
        """Share of the expected edges that the best reading, or the most votes, explain."""
        return self._most / max(1, self.record.expected)

    def convincing(self, clear: float) -> bool:
        """Whether the best reading matches a share of all that could be matched."""
        if not self.found:
            return False
        best = self.found[0]
        enough = max(_LEAST * self.record.expected, clear * possible(self.record))
        return best.scatter < _CALM and best.matched >= enough

    def search(self, window: Span, batches: int | None = None) -> None:
        """Anneal from one batch of starts after another while none explains the edges."""
        fall = self.fall
        least = _LEAST * self.record.expected - _MARGIN
        if not fall.pairing.times.size or possible(self.record) < least:
            return
        for starts, _ in itertools.islice(fall.starts(window, least), batches):
            fresh = starts[fall.unlike(starts, self._tried, len(starts))]
            if not len(fresh):
                continue
            self._tried = np.concatenate([self._tried, fresh])
            annealed = fall.anneal(fresh)
            self._most = max(self._most, *(one.matched for one in annealed))
            # Likelier than that all edges are strays and every rod was missed.
            likely = (one for one in annealed if one.evidence > 0.0)
            self.found = _ranked([*self.found, *likely], lambda one: [one.edges])
            if self.convincing(_CLEAR):
                return


def _ranked(readings: Iterable[Weighed], edges: Callable[[Weighed], list[Index]]) -> list[Weighed]:
    """Order readings, the likeliest first, and leave out what is the same as a likelier one."""
    found: list[Weighed] = []
    for reading in sorted(readings, key=lambda one: -one.evidence):
        if all(any(map(_unlike, edges(reading), edges(other))) for other in found):
            found.append(reading)
    return found


def _edges(fit: Fit) -> list[Index]:
    """For each side the edge of every expected one, counted in its train."""
    return [np.concatenate(side) for side in fit.matches.values()]


def _unlike(mine: Index, theirs: Index) -> bool:
    """Whether two readings give really different rods to the same edges."""
    matched = int(np.count_nonzero((mine >= 0) | (theirs >= 0)))
    return bool(np.count_nonzero(mine != theirs) > max(_FEW, _OTHER * matched))


def log_evidence(fit: Fit) -> float:
    """Logarithm of the marginal likelihood of a reading, up to what depends on the edges alone.

    A matched edge has the density of its time about the motion; a missed and an extra one what is
    known of such beforehand. The unknowns are integrated out by Laplace's method: −½‖y‖² −
    ln |det R| at the best estimate, with y and RᵀR in units of the prior uncertainties.
    """
    estimate, model = fit.estimate, fit.model
    total = 0.0
    for role, matches in fit.matches.items():
        rows = model.independent(role, estimate.x, matches)
        sigma = rows.sigma * estimate.scatter
        far = np.abs(rows.values) / sigma
        loss = np.where(far <= HUBER, 0.5 * far**2, HUBER * far - 0.5 * HUBER**2)
        density = np.log(np.maximum(rows.speed, SLOWEST) / (sigma * math.sqrt(2.0 * math.pi)))
        total += float(np.sum(density - loss))
        # Relative to a reading in which all edges are strays and every rod was missed.
        total += far.size * (math.log((1.0 - MISSED) / MISSED) - math.log(STRAYS))
    y = scaled(estimate.x, estimate.sd)
    _, volume = np.linalg.slogdet(estimate.root)
    return total - 0.5 * float(y @ y) - float(volume) + held_back(fit)


def held_back(fit: Fit) -> float:
    """Log of the share of an estimated κ's distribution above zero, twice: air only holds back."""
    model, estimate = fit.model, fit.estimate
    at = model.unknowns["drag"].start
    if not estimate.sd[at]:
        return 0.0
    unit = np.eye(estimate.x.size)[at]
    u = float(np.linalg.norm(np.linalg.solve(estimate.root.T, unit)) * estimate.sd[at])
    below = -model.kappa(estimate.x) / u
    if below < _TAIL:
        return math.log(math.erfc(below / math.sqrt(2.0)))
    return -0.5 * below**2 - math.log(below * math.sqrt(math.pi / 2.0))


def adjusted(fit: Fit, role: str) -> Guess:
    """Return where an adjustment has a chain begin, as a guess for a further one."""
    at, x = fit.model.unknowns, fit.x
    path = fit.model.trajectory(role, x)
    one = fit.model.guesses[role]
    return Guess(
        float(path.time[0]),
        float(path.height[0]),
        one.alpha + (float(x[at["alpha"]][0]) if role == "impact" else 0.0),
        path.kappa,
        float(x[at["clock"]][0]),
    )


def _together(
    protocol: Protocol,
    records: Sequence[ChainRecord],
    sides: Sequence[_Side],
    clock_u: float,
    components: Components,
) -> Identification:
    """Weigh the readings of all sides against each other, and adjust those that come near."""
    ranked = sorted(
        ((_likely(protocol, pair), pair) for pair in itertools.product(*(s.found for s in sides))),
        key=lambda row: -row[0],
    )
    most = ranked[0][0]
    close = [pair for likely, pair in ranked if most - likely < _CLOSE][:_PAIRS]
    tried: list[Reading] = []
    for pair in close:
        both = list(zip(sides, pair, strict=True))
        begin: dict[str, Guess] = {
            side.record.role: side.fall.guess(one.unknowns) for side, one in both
        }
        matches: Matches = {
            side.record.role: side.fall.pairing.numbered(one.edges) for side, one in both
        }
        models = [side.model for side in sides]
        model = DropModel(protocol, records, begin, clock_u, components, models)
        tried.append(weighed(settle(model, matches)))
    best, *rest = _ranked(tried, lambda one: _edges(one.fit))
    if not best.evidence > 0.0:
        return Identification(None, _shares(best.fit))
    odds = best.evidence - rest[0].evidence if rest else math.inf
    if len(ranked) > len(close):
        odds = min(odds, most - ranked[len(close)][0])
    other = rest[0].fit if rest else None
    return Identification(best.fit, _shares(best.fit), odds, best.evidence, other)


def weighed(fit: Fit) -> Reading:
    """Weigh a fit of all sides."""
    releases = [adjusted(fit, role).release for role in fit.model.records]
    evidence = log_evidence(fit) + _simultaneous(fit.model.protocol, releases)
    return Reading(fit, evidence if math.isfinite(evidence) else -math.inf)


def _shares(fit: Fit) -> dict[str, float]:
    return {
        role: count_matched(fit.matches[role]) / max(1, record.expected)
        for role, record in fit.model.records.items()
    }


def _likely(protocol: Protocol, pair: Sequence[Annealed]) -> float:
    releases = [float(one.unknowns[RELEASE]) for one in pair]
    return sum(one.evidence for one in pair) + _simultaneous(protocol, releases)


def _simultaneous(protocol: Protocol, releases: Sequence[float]) -> float:
    """Log prior of how far apart two releases are: a Cauchy of the skew that is accepted."""
    apart = (max(releases) - min(releases)) / protocol.accept.release_skew
    return -math.log1p(apart**2)
