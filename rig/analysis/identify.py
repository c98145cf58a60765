"""Which fall a drop's edges are: several readings, and one judge.

Each guess of `rig.analysis.pattern` is matched in order and adjusted; what is left is weighed by
its marginal likelihood (Laplace's method), every unknown of the rig integrated out. Both sides are
decided together, for they were released together. How much more likely the best reading is than
the best really different one is the odds of the identification.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.drop_model import DropModel, prior_air
from rig.analysis.equations import HUBER, scaled
from rig.analysis.fit import ROUGHLY, Fit, count_matched, first_match, settle
from rig.analysis.pattern import (
    AIRS,
    ANY_ALPHA,
    EVER,
    LONGEST,
    Guess,
    in_order,
    merged,
    near_alpha,
    slack_of,
)
from rig.analysis.pattern import guesses as votes
from rig.analysis.square_root import EquationRows, square_root

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.components import Components
    from rig.analysis.fit import Matches
    from rig.analysis.pattern import Span
    from rig.analysis.trajectory import Trajectory
    from rig.protocol.protocol import Protocol

    Array = NDArray[np.float64]

MISSED = 0.02
"""Share of expected edges that leave no trace, as far as one can know beforehand."""
STRAYS = 2.0
"""Edges of a gate that belong to no rod, 1/s."""
SLOWEST = 0.05
"""m/s: no edge is stamped by a chain slower than this, as far as the density of its time goes."""
_MARGIN = 3  # edges by which votes may fall short of what an adjusted fall matches
_CLEAR = 0.97  # share of all that could be matched with which no other α is tried
_FAIR = 0.9  # and with which, all α being tried, no other air or clock is
_LEAST = 0.6  # and of all that is expected
_CALM = 2.0  # scatter of edges above which a reading is none that ends the search
_STRAINED = 6.0  # standard uncertainties of any unknown, likewise
_OTHER = 0.02  # share of a side's edges at another rod that makes a different reading
_FEW = 2  # edges that make none: a stray in place of a missed edge
_CLOSE = 30.0  # log odds of one side alone within which both sides are adjusted together
_PAIRS = 4  # of readings, adjusted together
_TOGETHER = 30e-3  # s: chains let go at once are not further apart, if it can be helped
_TRIED = 12  # guesses of a side at a time
_MOST = 20  # and all in all: what is no fall must not take for ever
_QUICK = 3  # guesses that are looked at
_INSTANTS = 12  # at which two falls are compared
_SAME = 1.0  # how far apart they may be, in what a vote may be off
_TAIL = 8.0  # standard deviations beyond which a normal distribution's tail is its first term
_ROUNDS, _STEPS = 3, 15  # of matching and of adjusting them
_PULLS = 0.7, 0.5
"""By what share one object's acceleration may be less than stated, and more."""
_CLOCKS = (-2.0, -1.0, 1.0, 2.0)  # standard uncertainties of the clock that are tried


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
    found: dict[str, list[Reading]] = {}
    shares: dict[str, float] = {}
    # The free chain first: it tells what the air does to both, and when they were let go.
    near, kappa, clock, told = window, prior_air(protocol)[0], 0.0, False
    for record in reversed(records):
        side = _Side(protocol, record, clock_u, components, told)
        readings = side.readings(near, kappa, clock)
        if near != window and not _convincing(readings):
            readings = _best([*readings, *side.readings(window, kappa, clock)])
        found[record.role] = readings
        shares[record.role] = readings[0].share if readings else side.most_votes(window)
        if _convincing(readings):
            sure = adjusted(readings[0].fit, record.role)
            kappa, clock, told = sure.kappa, sure.clock, True
            near = _around([adjusted(one.fit, record.role).release for one in readings], window)
    if not all(found.values()):
        return Identification(None, shares)
    return _together(protocol, records, found, clock_u, components)


def read_side(
    protocol: Protocol, record: ChainRecord, clock_u: float, components: Components
) -> Reading | None:
    """Read one side quickly, near where its edges are if they come one by one as expected."""
    side = _Side(protocol, record, clock_u, components)
    near, kappa = around_order(protocol, record), prior_air(protocol)[0]
    tried = side.guesses(near, kappa, 0.0, near_alpha(record))
    found = side.judged(itertools.islice(tried, _QUICK))
    return found[0] if found else None


def read_quickly(
    protocol: Protocol, records: Sequence[ChainRecord], clock_u: float, components: Components
) -> Reading | None:
    """Read a drop like `identify`, but only where each side's edges come as expected."""
    found: dict[str, list[Reading]] = {}
    for record in records:
        reading = read_side(protocol, record, clock_u, components)
        if reading is None:
            return None
        found[record.role] = [reading]
    whole = _together(protocol, records, found, clock_u, components)
    return None if whole.fit is None else weighed(whole.fit)


def around_order(protocol: Protocol, record: ChainRecord, window: Span = EVER) -> Span:
    """Return about when a chain was let go if its edges came one by one as expected."""
    return _around(in_order(record, protocol.drop.value, protocol.gravity.value), window)


def well_read(reading: Reading) -> bool:
    """Whether nearly all that could be is matched, with no more scatter or strain than usual."""
    return _convincing([reading]) and _strain(reading.fit) < _STRAINED


def _convincing(readings: Sequence[Reading], clear: float = _FAIR) -> bool:
    if not readings:
        return False
    best = readings[0]
    calm = best.fit.estimate.scatter < _CALM
    most = sum(possible(record) for record in best.fit.model.records.values())
    return calm and best.share >= _LEAST and best.fit.matched >= clear * most


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


@dataclass(frozen=True, slots=True)
class _Side:
    """One chain's edges, to be read by themselves.

    Attributes
    ----------
    told
        Whether what the air does is known already.
    begun
        Falls that were adjusted, as they were guessed: nothing is adjusted twice.
    models
        That of the first guess: what was made of the trains is not made again for others.
    """

    protocol: Protocol
    record: ChainRecord
    clock_u: float
    components: Components
    told: bool = True
    begun: list[Trajectory] = field(default_factory=list)
    models: list[DropModel] = field(default_factory=list)

    def readings(self, window: Span, kappa: float, clock: float) -> list[Reading]:
        """Judge the guesses within a window, those first that are known to be near."""
        record, found = self.record, list[Reading]()
        hint = around_order(self.protocol, record, window)
        searches = [(hint, near_alpha(record)), (hint, ANY_ALPHA), (window, ANY_ALPHA)]
        if record.ratios is None:
            del searches[1]
        for span, alphas in dict.fromkeys(searches):
            found = _best([*found, *self.judged(self.guesses(span, kappa, clock, alphas))])
            if _convincing(found, _CLEAR if alphas != ANY_ALPHA else _FAIR) and (
                self.told or _strain(found[0].fit) < _STRAINED
            ):
                return found
        if possible(record) < _LEAST * record.expected:
            return found  # whatever the air and the clock are
        if self.protocol.one_object:
            # Friction, rolling and a slope that is not as stated are what such a drop is for.
            pulls = [self.guesses(window, kappa, clock, pull=pull) for pull in self._pulls()]
            found = _best([*found, *self.judged(merged(*pulls))])
            if _convincing(found):
                return found
        near = near_alpha(record)
        others = [self.guesses(hint, one, clock, near) for one in (() if self.told else AIRS)]
        top = float(np.max(self.record.chain.chain.heights)) + self.protocol.drop.value
        # In a share of its time a chain falls twice that share of its way.
        if 2.0 * self.clock_u * top > slack_of(self.record):
            clocks = [clock + self.clock_u * n for n in _CLOCKS]
            others += [self.guesses(hint, kappa, one, near) for one in clocks]
        return _best([*found, *self.judged(merged(*others))]) if others else found

    def guesses(
        self,
        window: Span,
        kappa: float,
        clock: float,
        alphas: Span = ANY_ALPHA,
        pull: float = 0.0,
    ) -> Iterator[Guess]:
        drop, gravity = self.protocol.drop, self.protocol.gravity.value + pull
        found = votes(self.record, drop, gravity, kappa, clock, window, alphas, self.least)
        return (replace(one, pull=pull) for one in found) if pull else found

    def _pulls(self) -> list[float]:
        """Accelerations to try beside the stated one, so near that votes overlap."""
        gravity = self.protocol.gravity.value
        lowest = min(float(train.levels.min(initial=0.0)) for train in self.record.trains)
        fall = math.sqrt(2.0 * max(self.protocol.drop.value - lowest, 0.0) / gravity)
        step = 2.0 * LONGEST / max(fall, LONGEST)
        below, above = (int(share / step) for share in _PULLS)
        return [gravity * step * n for n in sorted(range(-below, above + 1), key=abs) if n]

    @property
    def least(self) -> float:
        """Votes without which nothing becomes a reading, however it is adjusted."""
        return _LEAST * self.record.expected - _MARGIN

    def most_votes(self, window: Span) -> float:
        """Share of the expected edges that vote for the same fall, at most."""
        drop, gravity = self.protocol.drop, self.protocol.gravity.value
        tried = votes(self.record, drop, gravity, window=window, alphas=near_alpha(self.record))
        most = next((one.votes for one in tried), 0)
        return min(1.0, most / max(1, self.record.expected))

    def judged(self, tried: Iterable[Guess]) -> list[Reading]:
        """Adjust one guess after another while a better one may still come."""
        found: list[Reading] = []
        for one in itertools.islice(tried, _TRIED):
            if len(self.begun) >= _MOST:
                break
            enough = [r for r in found if r.fit.estimate.scatter < _CALM]
            if enough and one.votes + _MARGIN < max(reading.fit.matched for reading in enough):
                break
            if one.votes < self.least:
                break
            model = DropModel(
                self.protocol,
                [self.record],
                {self.record.role: one},
                self.clock_u,
                self.components,
                self.models[:1],
            )
            if not self.models:
                self.models.append(model)
            if self._known(model, one, enough):
                continue
            matches = first_match(model)
            # Of edges that are rods alike, the same adjustment follows.
            if any(not _apart(matches, reading.fit.matches) for reading in enough):
                continue
            fit = settle(model, matches, rounds=_ROUNDS, steps=_STEPS, done=ROUGHLY)
            evidence = log_evidence(fit) if fit.matched else 0.0
            if evidence > 0.0:  # likelier than that all edges are strays and every rod was missed
                found.append(Reading(fit, evidence))
        return _best(found)

    def _known(self, model: DropModel, guess: Guess, readings: Iterable[Reading]) -> bool:
        """Whether a fall is one that was adjusted, before or after, to a part of a rod's way."""
        (role,) = model.records
        latest = max(train.times.max(initial=guess.release) for train in self.record.trains)
        times = np.linspace(guess.release, float(latest), _INSTANTS)
        heights = model.trajectory(role, model.first()).heights(times)[0]
        others = [one.fit.model.trajectory(role, one.fit.x) for one in readings]
        others += self.begun
        slack = _SAME * slack_of(self.record)
        if any(float(np.abs(heights - one.heights(times)[0]).max()) < slack for one in others):
            return True
        self.begun.append(model.trajectory(role, model.first()))
        return False


def _best(readings: Iterable[Reading]) -> list[Reading]:
    """Order readings, the likeliest first, and leave out what is the same as a likelier one."""
    found: list[Reading] = []
    for reading in sorted(readings, key=lambda one: -one.evidence):
        if all(different(reading.fit, other.fit) for other in found):
            found.append(reading)
    return found


def different(one: Fit, other: Fit) -> bool:
    """Whether two readings give really different rods to the same edges of a side."""
    return _apart(one.matches, other.matches)


def _apart(one: Matches, other: Matches) -> bool:
    for role, matches in one.items():
        mine, theirs = np.concatenate(matches), np.concatenate(other[role])
        matched = int(np.count_nonzero((mine >= 0) | (theirs >= 0)))
        if np.count_nonzero(mine != theirs) > max(_FEW, _OTHER * matched):
            return True
    return False


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
        one.votes,
    )


def _together(
    protocol: Protocol,
    records: Sequence[ChainRecord],
    found: Mapping[str, Sequence[Reading]],
    clock_u: float,
    components: Components,
) -> Identification:
    """Adjust the best readings of all sides together, and weigh them against each other."""
    roles: list[str] = [record.role for record in records]
    pairs = sorted(
        itertools.product(*(found[role] for role in roles)),
        key=lambda pair: -_likely(protocol, pair),
    )
    most = _likely(protocol, pairs[0])
    close = [pair for pair in pairs if most - _likely(protocol, pair) < _CLOSE][:_PAIRS]
    tried: list[Reading] = []
    for pair in close:
        if len(pair) == 1:
            # One side is all there is: the same, to the end.
            fit = pair[0].fit
            tried.append(weighed(settle(fit.model, fit.matches, x=fit.x)))
            continue
        begin: dict[str, Guess] = {
            role: adjusted(one.fit, role) for role, one in zip(roles, pair, strict=True)
        }
        matches = {role: one.fit.matches[role] for role, one in zip(roles, pair, strict=True)}
        sides = [one.fit.model for one in pair]
        model = DropModel(protocol, records, begin, clock_u, components, sides)
        tried.append(weighed(settle(model, matches, x=_begun(model, pair))))
    best, *rest = _best(tried)
    if not best.evidence > 0.0:
        return Identification(None, _shares(best.fit))
    odds = best.evidence - rest[0].evidence if rest else math.inf
    if len(pairs) > len(close):
        odds = min(odds, most - _likely(protocol, pairs[len(close)]))
    other = rest[0].fit if rest else None
    return Identification(best.fit, _shares(best.fit), odds, best.evidence, other)


def _begun(model: DropModel, sides: Sequence[Reading]) -> Array:
    """Unknowns of both sides together, as far as each side has told them by itself.

    Each side's equations at its own estimate, one below the other: were they linear, this would be
    the solution of all.
    """
    at = model.unknowns
    rows: list[EquationRows] = []
    for side in sides:
        (role,), own, estimate = side.fit.matches, side.fit.model.unknowns, side.fit.estimate
        if role not in estimate.rows:
            continue
        x = estimate.x.copy()
        for name in (f"{role} release", "alpha"):  # are counted from what was found
            if name in own:
                x[own[name]] = 0.0
        slopes, left, columns = estimate.rows[role].after(-x)
        places = np.array([n for name in own.blocks for n in range(at[name].start, at[name].stop)])
        if role == "free" and "side" in at:  # where a side begins is one number by itself
            slopes = np.column_stack([slopes, slopes[:, columns == own["drop"].start]])
            places = np.append(places[columns], at["side"].start)
        else:
            places = places[columns]
        rows.append(EquationRows(slopes, left, places))
    return at.sd * square_root(rows, at.sd, np.zeros(len(at))).step()


def weighed(fit: Fit) -> Reading:
    """Weigh a fit of all sides."""
    evidence = log_evidence(fit) + _simultaneous(fit.model.protocol, _begins(fit))
    return Reading(fit, evidence if math.isfinite(evidence) else -math.inf)


def _begins(fit: Fit) -> list[Guess]:
    return [adjusted(fit, role) for role in fit.model.records]


def _shares(fit: Fit) -> dict[str, float]:
    return {
        role: count_matched(fit.matches[role]) / max(1, record.expected)
        for role, record in fit.model.records.items()
    }


def _likely(protocol: Protocol, pair: Sequence[Reading]) -> float:
    begins = [one for reading in pair for one in _begins(reading.fit)]
    return sum(one.evidence for one in pair) + _simultaneous(protocol, begins)


def _simultaneous(protocol: Protocol, begins: Iterable[Guess]) -> float:
    """Log prior of how far apart two releases are: a Cauchy of the skew that is accepted."""
    releases = [one.release for one in begins]
    apart = (max(releases) - min(releases)) / protocol.accept.release_skew
    return -math.log1p(apart**2)
