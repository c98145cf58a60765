"""The observation equations: where the matched edges should be, given all unknowns."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from rig.analysis.air import prior_air
from rig.analysis.annealing import PART, Guess, Pairing, SideFall
from rig.analysis.components import SHARPEST, Components, stated
from rig.analysis.discrepancy import LOWEST_START, STRETCHES, Discrepancy
from rig.analysis.equations import STRAY, Equations, Expected, Residuals, Seen
from rig.analysis.trajectory import (
    COMMON,
    DRAG,
    GRAVITY,
    RELEASE,
    START,
    free_trajectory,
    struck_trajectory,
)
from rig.analysis.unknowns import Unknowns, side_slopes
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.trajectory import Trajectory
    from rig.analysis.unknowns import Unknown
    from rig.arrays import Array, Flags, Index
    from rig.protocol.protocol import Protocol


T = TypeVar("T")

_TOLD = 0.5
"""Of the prior uncertainty of where a rod strikes, what edges leave of it on the way to the best
fit: with 0.3 or 0.7 a joint fit takes as many rounds, with none or all of it twice as many."""


class DropModel:
    """One drop: its unknowns, and the equations that tie them to edges.

    Parameters
    ----------
    protocol
        The scene.
    records
        The chains with their trains.
    guesses
        First guess for each side, by role.
    clock_u
        Relative standard uncertainty of the time scale.
    components
        How much everything scatters; as the protocol states it if not given.

    See `DropModel.of`, which is quicker where many drops are alike.

    Attributes
    ----------
    owners
        What follows the names of common unknowns, by whose they are, where not all drops that are
        fitted together have the same rig: see `rig.analysis.several`.
    """

    def __init__(
        self,
        protocol: Protocol,
        records: Sequence[ChainRecord],
        guesses: Mapping[str, Guess],
        clock_u: float,
        components: Components | None = None,
    ) -> None:
        assert protocol.gates is not None
        self.protocol = protocol
        self._kappa: float
        self.kappa_u: float
        self._kappa, self.kappa_u = prior_air(protocol)
        self.records: dict[str, ChainRecord] = {record.role: record for record in records}
        self.guesses = guesses
        self.clock_u: float = clock_u
        self.components: Components = components or stated(protocol)
        self.suspects: tuple[Unknown, ...] = ()
        self.owners: Mapping[str, str] = {}
        self.expected: dict[str, Expected] = {
            role: Expected.of(record, protocol) for role, record in self.records.items()
        }
        self.pairings: dict[str, Pairing] = _pairings(records)
        if "impact" in self.records:
            record, edges = self.records["impact"], self.expected["impact"]
            self.discrepancy = Discrepancy.of(record, edges, protocol, self._kappa)
        self._held: dict[tuple[str, str], tuple[object, Any]] = {}
        self.unknowns = Unknowns(self)
        self.slopes = {role: side_slopes(self, role) for role in self.records}

    @classmethod
    def of(
        cls,
        protocol: Protocol,
        records: Sequence[ChainRecord],
        guesses: Mapping[str, Guess] | None,
        clock_u: float,
        components: Components | None = None,
    ) -> DropModel:
        """Return a drop's model; what all drops of its condition have in common is made once.

        Parameters
        ----------
        guesses
            `None` for a drop that begins as stated.
        """
        content = tuple(map(_expectations, records))
        return _model_of(_Condition(protocol, content, tuple(records))).changed(
            records={record.role: record for record in records},
            pairings=_pairings(records),
            guesses=_stated_guesses(protocol, records) if guesses is None else guesses,
            clock_u=clock_u,
            components=components or stated(protocol),
        )

    def changed(self, **attributes: Any) -> DropModel:
        """Return the same drop with something else about it, and priors that follow."""
        model = copy(self)
        vars(model).update(attributes, _held={})
        model.unknowns = Unknowns(model)
        if "suspects" in attributes:
            model.slopes = {role: side_slopes(model, role) for role in model.records}
        return model

    def informed(self, components: Components, clock_u: float, x: Array) -> DropModel:
        """Return the same drop with other priors, that of impulses relative to the α found.

        Parameters
        ----------
        x
            Unknowns; α becomes part of the guess, so that its unknown is set to zero in place.
        """
        guesses = dict(self.guesses)
        if "impact" in guesses:
            at, struck = self.unknowns["alpha"], guesses["impact"]
            guesses["impact"] = replace(struck, alpha=struck.alpha + float(x[at][0]))
            x[at] = 0.0
        return self.changed(components=components, clock_u=clock_u, guesses=guesses)

    def side(self, role: str) -> SideFall:
        """Take a side as it begins, with what else moves its edges as their scatter."""
        record, scales = self.records[role], self.components
        sd = np.hypot(scales.floor, scales.departure if record.ratios is not None else 0.0)
        variance = sd**2 + (self.slopes[role].levels ** 2) @ self.unknowns.sd**2
        about = self.protocol, record, self.pairings[role], self.clock_u, scales
        return SideFall.of(*about, np.sqrt(variance))

    def under(self, protocol: Protocol) -> DropModel:
        """Return the same drop with the priors of another protocol, alike but for these."""
        # Its heights stay: they may be counted from a contact point that is this drop's own.
        current, gates, level = self.protocol, self.protocol.gates, protocol.contact.level
        assert protocol.gates is not None
        assert gates is not None
        kappa, kappa_u = prior_air(protocol)
        return self.changed(
            components=stated(protocol),
            protocol=replace(
                protocol,
                drop=Quantity(current.drop.value, protocol.drop.u),
                gates=replace(protocol.gates, gates=gates.gates),
                contact=replace(current.contact, level=replace(current.contact.level, u=level.u)),
                stated=current.stated,
            ),
            _kappa=kappa,
            kappa_u=kappa_u,
            # Widths of rods and their places have priors of their own.
            records={
                role: replace(record, chain=protocol.chains[record.chain.name])
                for role, record in self.records.items()
            },
        )

    def shaken(self, shifts: Mapping[str, Array]) -> DropModel:
        """Return the same drop with its edges moved in time, by so many seconds each."""
        return self.changed(
            pairings={
                role: replace(pairing, times=pairing.times + shifts[role])
                for role, pairing in self.pairings.items()
            }
        )

    def first(self) -> Array:
        """Unknowns as the first guess has them, shape ``(unknowns,)``."""
        x = np.zeros(len(self.unknowns))
        starts = [guess.start for guess in self.guesses.values()]
        # Their mean: how much lower each one hangs begins at zero.
        x[self.unknowns["drop"]] = sum(starts) / len(starts) - self.protocol.drop.value
        clocks = [guess.clock for guess in self.guesses.values()]
        x[self.unknowns["clock"]] = sum(clocks) / len(clocks)
        if "free" in self.guesses and self.protocol.surface is None:
            x[self.unknowns["gravity"]] = self.guesses["free"].pull
        if "drag" in self.unknowns:
            kappa = max(guess.kappa for guess in self.guesses.values())
            x[self.unknowns["drag"]] = kappa - self._kappa
        return x

    def rate(self, x: Array) -> float:
        """How much later each moment is than it was stamped, as a factor."""
        return 1.0 + float(self.unknowns.rate @ x)

    def kappa(self, x: Array) -> float:
        """κ of the first chain as a whole, 1/m."""
        return self._kappa + float(x[self.unknowns["drag"]][0])

    def _last(self, kind: str, role: str, key: object, make: Callable[[], T]) -> T:
        """Return what was last made, where it is asked for again: matching and adjusting do so."""
        held = self._held.get((kind, role))
        if held is None or held[0] != key:
            held = self._held[kind, role] = key, make()
        value: T = held[1]
        return value

    def trajectory(self, role: str, x: Array) -> Trajectory:
        """Path of one side for given unknowns."""
        return self._last("path", role, x.tobytes(), lambda: self._trajectory(role, x))

    def _trajectory(self, role: str, x: Array) -> Trajectory:
        record, parameters = self.records[role], self.slopes[role].path @ x
        parameters[RELEASE] += self.guesses[role].release
        parameters[START] += self.protocol.drop.value
        parameters[GRAVITY] += self.protocol.gravity.value
        parameters[DRAG] += self._kappa
        release, start, gravity, kappa = parameters[:COMMON].tolist()
        if not gravity > 0.0:
            gravity = math.nan  # nothing falls: no number, so that no fit ends there
        if record.ratios is None:
            return free_trajectory(release, start, gravity, kappa, record.air)
        start = max(start, LOWEST_START)
        gains, places = parameters[COMMON:].reshape(2, -1)
        gains += self.guesses[role].alpha
        places += record.strikes
        return struck_trajectory(
            release, start, gravity, gains, record.ratios, places, kappa, record.air
        )

    def stretch(self, x: Array) -> Array:
        """Size of each mode of the stretch, m."""
        own, usual = (x[self.unknowns[name]] for name in STRETCHES)
        return own + usual

    def all_levels(self, role: str, x: Array) -> Array:
        """Where the reference point should be at every expected edge of all trains, m."""

        def levels() -> Array:
            return self.expected[role].levels + self.slopes[role].levels @ x

        return self._last("levels", role, x.tobytes(), levels)

    def _matched(self, role: str, matches: Sequence[Index]) -> Seen:
        """Collect the matched edges; a matching stays for many steps of an adjustment."""

        def seen() -> tuple[Sequence[Index], Seen]:
            pairing = self.pairings[role]
            pick, edge = pairing.observed(matches)
            seen = self.expected[role].seen(pick, pairing.times[edge], pairing.burst[edge])
            return matches, seen  # held, so that no other is the same

        return self._last("matched", role, id(matches), seen)[1]

    def residuals(self, role: str, x: Array, matches: Sequence[Index]) -> Residuals:
        """What the unknowns leave over of one side's matched edges."""
        seen = self._matched(role, matches)
        times = seen.times * self.rate(x)
        height, speed = self.trajectory(role, x).heights(times)
        values = height - self.all_levels(role, x)[seen.pick]
        loose = _loose(self.trajectory(role, x), times, seen)
        return Residuals(values, self._sigma(seen, speed, loose), speed, seen.burst == 0.0, loose)

    def parted(self, role: str, rows: Residuals, matches: Sequence[Index]) -> Residuals:
        """Take from some residuals of each what the one before tells of it."""
        rows = rows._replace(values=rows.values.copy(), sigma=rows.sigma.copy())
        self._part(self._matched(role, matches), rows.loose > 0.0, rows.values, rows.sigma)
        return rows

    def _part(self, seen: Seen, struck: Flags, values: Array, sigma: Array) -> Array:
        """Make both sides of a rod independent, in place; return `Equations.told`.

        They are off together at a beam: of the second what the first tells is taken away (Cholesky
        of two by two).
        """
        together = seen.paired[:-1] & struck[:-1] & struck[1:]
        first, shared = np.flatnonzero(together), self.components.departure**2
        carried = np.zeros(values.size)
        carried[first + 1] = share = shared / sigma[first] ** 2
        values[first + 1] -= share * values[first]
        sigma[first + 1] = np.sqrt(sigma[first + 1] ** 2 - share * shared)
        return carried

    def _sigma(self, seen: Seen, speed: Array, loose: Array) -> Array:
        """Standard deviation of where each edge was seen, m."""
        scales = self.components
        variance = scales.floor**2 + speed**2 * (scales.jitter**2 + seen.burst**2)
        variance += (scales.landed * np.where(seen.alone, 0.0, seen.landed)) ** 2
        sigma: Array = np.sqrt(variance + scales.departures(loose))
        return sigma

    def _stamps(self, role: str, x: Array, seen: Seen) -> tuple[Array, Array, Array, Array]:
        """When each edge should have been stamped, by how much later that is than it was, s.

        Then the level that it is of, and how loose the chain was.
        """
        path = self.trajectory(role, x)
        levels = self.all_levels(role, x)[seen.pick]
        stamps = seen.times * self.rate(x)
        height, speed = path.heights(stamps)
        off = height - levels
        loose = _loose(path, stamps, seen)
        near = np.abs(off) <= STRAY * self._sigma(seen, speed, loose)
        late = np.divide(off, speed, out=np.zeros_like(off), where=near & (speed > 0.0))
        return stamps + late, late, levels, loose

    def _strike_u(self, role: str) -> Array:
        """How well it is known at which height each rod strikes, see `Trajectory.sights`.

        To a part of a rod's width at least, whatever is stated: further off no step leads.
        """
        _, places = np.split(self.slopes[role].path[COMMON:], 2)
        sd, width = np.sqrt(places**2 @ self.unknowns.sd**2), min(self.records[role].chain.widths)
        return np.clip(_TOLD * sd, SHARPEST, width / PART)

    def equations(self, role: str, x: Array, matches: Sequence[Index]) -> Equations:
        """Observation equations of one side for its matched edges.

        They are set up where an edge should have been stamped, not where it was: derivatives that
        knew of a stamp's own error would make a slow clock, with which all errors are smaller,
        look likelier.
        """
        acts, seen = self.slopes[role], self._matched(role, matches)
        path = self.trajectory(role, x)
        times, late, levels, loose = self._stamps(role, x, seen)
        moving = acts.path[:, acts.columns[: acts.moving]]
        height, speed, moved = path.sights(times, moving, self._strike_u(role))
        values = height - levels + speed * late
        sigma = self._sigma(seen, speed, loose)
        slopes = -acts.levels[seen.pick[:, None], acts.columns]
        slopes[:, : acts.moving] += moved
        # Of a slow clock the true time is later, and the chain lower by then.
        rates = self.unknowns.rate[acts.columns[acts.clocks]]
        slopes[:, acts.clocks] -= np.outer(speed * times / self.rate(x), rates)
        carried = self._part(seen, loose > 0.0, values, sigma)
        second = np.flatnonzero(carried)
        slopes[second] -= carried[second, None] * slopes[second - 1]
        residuals = Residuals(values, sigma, speed, seen.burst == 0.0, loose)
        return Equations(residuals, carried, slopes, acts.columns)


@dataclass(frozen=True)
class _Condition:
    """What a model depends on, but for the edges that came; `records` are of any such drop."""

    protocol: Protocol
    content: tuple[object, ...]
    records: tuple[ChainRecord, ...] = field(compare=False)


@lru_cache(maxsize=64)
def _model_of(condition: _Condition) -> DropModel:
    protocol, records = condition.protocol, condition.records
    return DropModel(protocol, records, _stated_guesses(protocol, records), 0.0)


def _expectations(record: ChainRecord) -> tuple[object, ...]:
    """Everything that a record has but its edges."""
    arrays = [record.air, record.unlike, *(() if record.ratios is None else (record.ratios,))]
    arrays += [part for train in record.trains for part in (train.rods, train.blocks, train.levels)]
    gates = *(train.gate for train in record.trains), *(train.gate for train in record.aside)
    fields = record.role, record.chain, record.alpha, record.incline_deg, record.higher
    return (
        *fields,
        record.condition,
        gates,
        len(record.trains),
        *(array.tobytes() for array in arrays),
    )


def _stated_guesses(protocol: Protocol, records: Sequence[ChainRecord]) -> dict[str, Guess]:
    return {record.role: Guess.stated(protocol, record) for record in records}


def _pairings(records: Sequence[ChainRecord]) -> dict[str, Pairing]:
    return {record.role: Pairing.of(record.trains, record.crossed) for record in records}


def _loose(path: Trajectory, times: Array, seen: Seen) -> Array:
    """How loose a chain is at each edge, see `Trajectory.loose`; the top rod alone is no chain."""
    return np.where(seen.alone, 0.0, path.loose(times))
