"""The observation equations: where the matched edges should be, given all unknowns."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.align import Pairing
from rig.analysis.components import Components, above, stated
from rig.analysis.discrepancy import (
    LOWEST_START,
    MODES,
    STRETCHES,
    Discrepancy,
)
from rig.analysis.equations import STRAY, Equations, Expected, Residuals, Seen
from rig.analysis.swing import drawn, lever, swing_sd
from rig.analysis.trajectory import free_trajectory, struck_trajectory
from rig.analysis.unknowns import ANY_GRAVITY, ANYTHING, SideColumns, Unknowns, side_columns
from rig.predictions import air_of
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.pattern import Guess
    from rig.analysis.trajectory import Trajectory
    from rig.protocol.protocol import Protocol

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]
    Index = NDArray[np.intp]

_ALIKE = 0.05
"""Scatter of impulses, relative to α, with which an adjustment begins: more may lead it astray."""


class DropModel:
    """One drop: its unknowns, and the equations that tie them to edges.

    Parameters
    ----------
    protocol
        The scene.
    sides
        The chains with their trains.
    guesses
        First guess for each side, by role.
    clock_u
        Relative standard uncertainty of the time scale.
    components
        How much everything scatters; as the protocol states it if not given.
    sides
        Models of these same records: what was made of their trains need not be made again.
    """

    def __init__(
        self,
        protocol: Protocol,
        records: Sequence[ChainRecord],
        guesses: Mapping[str, Guess],
        clock_u: float,
        components: Components | None = None,
        sides: Sequence[DropModel] = (),
    ) -> None:
        assert protocol.gates is not None
        self.protocol = protocol
        self._kappa, self._kappa_u = prior_air(protocol)
        self.records: dict[str, ChainRecord] = {record.role: record for record in records}
        self.guesses = guesses
        self.clock_u = clock_u
        self.components = components or stated(protocol)
        made: dict[str, DropModel] = {role: one for one in sides for role in one.records}
        self.expected: dict[str, Expected] = {
            role: made[role].expected[role] if role in made else Expected.of(record, protocol)
            for role, record in self.records.items()
        }
        self.pairings: dict[str, Pairing] = {
            role: made[role].pairings[role] if role in made else Pairing.of(record.trains)
            for role, record in self.records.items()
        }
        self.discrepancy: Discrepancy  # where a chain strikes
        if "impact" in made:
            self.discrepancy = made["impact"].discrepancy
        elif "impact" in self.records:
            record, edges = self.records["impact"], self.expected["impact"]
            self.discrepancy = Discrepancy.of(record, edges, protocol, self._kappa)
        slopes: dict[str, float] = {
            record.role: math.tan(math.radians(record.chain.tilt_deg)) for record in records
        }
        posts = protocol.gates.posts
        self._post = np.array([posts.index(gate.side) for gate in protocol.gates.gates])
        self._steepest = max(slopes.values(), default=0.0)
        # A beam is off by as much for a chain of less tilted rods, which shows less.
        self._tilts: dict[str, float] = {
            role: slope / (self._steepest or 1.0) for role, slope in slopes.items()
        }
        self.unknowns = self._unknowns()
        self._local = {role: self._columns(role) for role in self.records}
        # The last path, levels and matches of each side: nothing older is asked for again.
        self._paths: dict[str, tuple[bytes, Trajectory]] = {}
        self._levels: dict[str, tuple[bytes, Array]] = {}
        self._seen: dict[str, tuple[Sequence[Index], Seen]] = {}
        self._fixed: dict[str, tuple[Seen, Index, Array]] = {}

    def _unknowns(self) -> Unknowns:
        """Name everything that is not known, with what is known of it beforehand."""
        protocol, components = self.protocol, self.components
        assert protocol.gates is not None
        gates = len(protocol.gates.gates)
        free_only = protocol.surface is None
        unknowns = Unknowns()
        unknowns.add("clock", "clock", self.clock_u)
        unknowns.add("gravity", "gravity", ANY_GRAVITY if free_only else protocol.gravity.u)
        unknowns.add("drop", "drop height", protocol.drop.u)
        if len(self.records) > 1:
            unknowns.add("side", "side", protocol.priors.side)
        unknowns.add("drag", "air", self._kappa_u)
        datums = [protocol.gates.datum_u] * len(protocol.gates.posts)
        unknowns.add("datum", "datum", datums)
        unknowns.add("beams", "beam heights", [components.gates * protocol.gates.height_u] * gates)
        if self._steepest:
            unknowns.add("ripple", "beam offsets", [components.beam * self._steepest] * gates)
        for role, record in self.records.items():
            chain = record.chain
            places = [components.rods * chain.position_u] * chain.chain.rods
            # Told by the edges alone, so its uncertainty counts as theirs.
            unknowns.add(f"{role} release", "edges", ANYTHING)
            unknowns.add(f"{role} hang", "start height", components.hang)
            unknowns.add(f"{role} rods", "spacing", places)
            if self._steepest:
                aside = protocol.priors.off_centre * self._tilts[role] * self._steepest
                unknowns.add(f"{role} off centre", "beam offsets", aside)
            unknowns.add(f"{role} width", "width", chain.width_u)
            if not free_only and chain.chain.rods > 1:
                sd = components.swing * swing_sd(chain.chain, protocol)
                unknowns.add(f"{role} swing", "swing", sd)
        if "impact" in self.records:
            rods = self.records["impact"].chain.chain.rods
            alpha = abs(self.guesses["impact"].alpha)
            scatter = components.impulses(alpha, above(rods))
            unknowns.add("alpha", "edges", ANYTHING)
            unknowns.add("impulses", "single impulses", scatter)
            contact = protocol.contact
            unknowns.add("contact", "contact", contact.level.u)
            unknowns.add("strike", "contact", contact.strike.u)
            # It falls on as it was off its chain while two were left.
            off = math.hypot(components.departure, 0.5 * components.few)
            unknowns.add("top", "top rod", math.sqrt(2.0) * off)
            unknowns.add("landed", "contact", components.landed)
            self._add_discrepancy(unknowns)
        return unknowns

    def _add_discrepancy(self, unknowns: Unknowns) -> None:
        """Name what the equations leave out."""
        priors, components, record = self.protocol.priors, self.components, self.records["impact"]
        unknowns.add("strings", "single impulses", priors.strings * abs(record.alpha))
        # A half of its variance is the same in all drops.
        size = priors.stretch * math.hypot(record.alpha, priors.impulse_floor)
        size *= components.stretch * record.chain.chain.length
        for name in STRETCHES:
            unknowns.add(name, "stretch", [math.sqrt(0.5) * size] * MODES)
        # No edge tells it; where strings do not bounce, there is none.
        bounce = components.bounce / priors.last_impulse if priors.last_impulse else 1.0
        unknowns.add("late", "late pull", bounce * priors.late_pull)

    def _columns(self, role: str) -> SideColumns:
        """Leave out what the other side alone depends on."""
        record, gates = self.records[role], self.protocol.gates
        assert gates is not None
        here = tuple(train.gate for train in record.trains)
        rods, lower = 0, ()
        if role == "impact":
            rods = record.chain.chain.rods
            lower = tuple(self._drawn().tolist()) if "impact swing" in self.unknowns else ()
        return side_columns(self.unknowns.places, role, here, gates.posts, rods, lower)

    def stiff(self) -> DropModel:
        """Return the same drop with impulses that are nearly alike, the last one too."""
        if "impact" not in self.records:
            return self
        other = copy(self)
        impulse = min(_ALIKE, self.components.impulse)
        none = dict.fromkeys(("bounce", "landed", "stretch"), 0.0)
        other.components = replace(self.components, impulse=impulse, **none)
        other.unknowns = other._unknowns()  # other priors, and the same paths
        return other

    def informed(self, components: Components, clock_u: float, x: Array) -> DropModel:
        """Return the same drop with other priors, that of impulses relative to the α found.

        Parameters
        ----------
        x
            Unknowns; α becomes part of the guess, so that its unknown is set to zero in place.
        """
        guesses = dict(self.guesses)
        if "impact" in guesses:
            at = self.unknowns["alpha"]
            struck = guesses["impact"]
            guesses["impact"] = replace(struck, alpha=struck.alpha + float(x[at][0]))
            x[at] = 0.0
        # Columns and matched edges stay: only priors and where α is counted from are others.
        other = copy(self)
        other.components, other.clock_u, other.guesses = components, clock_u, guesses
        other.unknowns = other._unknowns()
        other._paths = {}
        return other

    def under(self, protocol: Protocol) -> DropModel:
        """Return the same drop with the priors of another protocol, alike but for these."""
        other = copy(self)
        other.components = stated(protocol)
        # Its heights stay: they may be counted from a contact point that is this drop's own.
        mine, gates, level = self.protocol, self.protocol.gates, protocol.contact.level
        assert protocol.gates is not None
        assert gates is not None
        other.protocol = replace(
            protocol,
            drop=Quantity(mine.drop.value, protocol.drop.u),
            gates=replace(protocol.gates, gates=gates.gates),
            contact=replace(mine.contact, level=replace(mine.contact.level, u=level.u)),
            stated=mine.stated,
        )
        other._kappa, other._kappa_u = prior_air(protocol)
        # Widths of rods and their places have priors of their own.
        other.records = {
            role: replace(record, chain=protocol.chains[record.chain.name])
            for role, record in self.records.items()
        }
        other.unknowns = other._unknowns()
        other._paths = {}
        return other

    def shaken(self, shifts: Mapping[str, Array]) -> DropModel:
        """Return the same drop with its edges moved in time, by so many seconds each."""
        other = copy(self)
        other._paths, other._seen, other._fixed = {}, {}, {}
        other.expected = {
            role: expected._replace(times=expected.times + shifts[role])
            for role, expected in self.expected.items()
        }
        return other

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

    def kappa(self, x: Array) -> float:
        """κ of the first chain as a whole, 1/m."""
        return self._kappa + float(x[self.unknowns["drag"]][0])

    def trajectory(self, role: str, x: Array) -> Trajectory:
        """Path of one side for given unknowns."""
        # Matching, adjusting and judging ask for the same one again and again.
        asked = x.tobytes()
        known = self._paths.get(role)
        if known is None or known[0] != asked:
            known = self._paths[role] = asked, self._trajectory(role, x)
        return known[1]

    def _trajectory(self, role: str, x: Array) -> Trajectory:
        at = self.unknowns
        release = self.guesses[role].release + float(x[at[f"{role} release"]][0])
        start = self.protocol.drop.value + float(x[at["drop"]][0] + x[at[f"{role} hang"]][0])
        if role == "free" and "side" in at:
            start += float(x[at["side"]][0])
        gravity = self.protocol.gravity.value + float(x[at["gravity"]][0])
        kappa, record = self.kappa(x), self.records[role]
        if not gravity > 0.0:
            gravity = math.nan  # nothing falls: no number, so that no fit ends there
        if role == "free":
            return free_trajectory(release, start, gravity, kappa, record.air)
        assert record.ratios is not None
        start = max(start, LOWEST_START)
        places = record.strikes + x[at["impact rods"]]
        # Results are at the stated level: where the top rod would be if others struck elsewhere.
        places[:-1] -= x[at["contact"]]
        places[-1] += x[at["top"]][0]
        if "impact swing" in at:
            places -= x[at["impact swing"]] * self._drawn()
        gains = self.guesses[role].alpha + x[at["alpha"]] + x[at["impulses"]]
        gains += x[at["strings"]] / above(places.size) ** 2
        return struck_trajectory(
            release, start, gravity, gains, record.ratios, places, kappa, record.air
        )

    def spread(self, role: str, derivatives: Array) -> Array:
        """Derivatives by a trajectory's parameters → by all unknowns.

        Parameters
        ----------
        derivatives
            Shape ``(…, parameters)``.

        Returns
        -------
        ndarray
            Shape ``(…, unknowns)``.
        """
        local = self._local[role]
        found = np.zeros((*derivatives.shape[:-1], len(self.unknowns)))
        found[..., local.columns[: local.moving]] = derivatives @ local.path
        return found

    def _drawn(self) -> Array:
        """`drawn` of each rod of the chain that strikes, as it strikes."""
        record = self.records["impact"]
        return drawn(lever(record.chain.chain), self.protocol, -record.strikes)

    def stretch(self, x: Array) -> Array:
        """Size of each mode of the stretch, m."""
        own, usual = (x[self.unknowns[name]] for name in STRETCHES)
        return own + usual

    def all_levels(self, role: str, x: Array) -> Array:
        """Where the reference point should be at every expected edge of all trains, m."""
        asked = x.tobytes()
        known = self._levels.get(role)
        if known is None or known[0] != asked:
            known = self._levels[role] = asked, self._all_levels(role, x)
        return known[1]

    def _all_levels(self, role: str, x: Array) -> Array:
        at, edges = self.unknowns, self.expected[role]
        found: Array = edges.levels - edges.sign * x[at[f"{role} width"]]
        found += (x[at["beams"]] + x[at["datum"]][self._post])[edges.gate]
        found -= x[at[f"{role} rods"]][edges.rods]
        if "ripple" in at:
            found -= self._tilts[role] * edges.turn * x[at["ripple"]][edges.gate]
        if f"{role} off centre" in at:
            found -= edges.turn * x[at[f"{role} off centre"]]
        if f"{role} swing" in at:
            found += x[at[f"{role} swing"]] * edges.drawn
        if role == "impact":
            found -= edges.alone * x[at["top"]][0]
            found -= edges.landed * x[at["landed"]][0]
            found += self.discrepancy.stretch @ self.stretch(x)
        return found

    def _matched(self, role: str, matches: Sequence[Index]) -> Seen:
        """Collect the matched edges; a matching stays for many steps of an adjustment."""
        known = self._seen.get(role)
        if known is None or known[0] is not matches:
            known = self._seen[role] = matches, self.expected[role].seen(matches)
        return known[1]

    def residuals(self, role: str, x: Array, matches: Sequence[Index]) -> Residuals:
        """What the unknowns leave over of one side's matched edges."""
        seen = self._matched(role, matches)
        times = seen.times * (1.0 + x[self.unknowns["clock"]])
        height, speed = self.trajectory(role, x).heights(times)
        values = height - self.all_levels(role, x)[seen.pick]
        loose = _loose(self.trajectory(role, x), times, seen)
        return Residuals(values, self._sigma(seen, speed, loose), speed, seen.burst == 0.0, loose)

    def independent(self, role: str, x: Array, matches: Sequence[Index]) -> Residuals:
        """Return `residuals` with of each what the one before tells of it taken away."""
        return self.parted(role, self.residuals(role, x, matches), matches)

    def parted(self, role: str, left: Residuals, matches: Sequence[Index]) -> Residuals:
        """Make `independent` of some residuals."""
        left = left._replace(values=left.values.copy(), sigma=left.sigma.copy())
        self._part(self._matched(role, matches), left.loose > 0.0, left.values, left.sigma)
        return left

    def _part(self, seen: Seen, struck: Flags, values: Array, sigma: Array) -> Array:
        """Make both sides of a rod independent, in place; return `Equations.told`.

        They are off together at a beam: of the second what the first tells is taken away (Cholesky
        of two by two).
        """
        together = seen.paired[:-1] & struck[:-1] & struck[1:]
        first, shared = np.flatnonzero(together), self.components.departure**2
        told = np.zeros(values.size)
        told[first + 1] = share = shared / sigma[first] ** 2
        values[first + 1] -= share * values[first]
        sigma[first + 1] = np.sqrt(sigma[first + 1] ** 2 - share * shared)
        return told

    def _sigma(self, seen: Seen, speed: Array, loose: Array) -> Array:
        """Standard deviation of where each edge was seen, m."""
        known = self.components
        variance = known.floor**2 + speed**2 * (known.jitter**2 + seen.burst**2)
        found: Array = np.sqrt(variance + known.departures(loose))
        return found

    def _stamps(self, role: str, x: Array, seen: Seen) -> tuple[Array, Array, Array, Array]:
        """When each edge should have been stamped, by how much later that is than it was, s.

        Then the level that it is of, and how loose the chain was.
        """
        path = self.trajectory(role, x)
        levels = self.all_levels(role, x)[seen.pick]
        stamps = seen.times * (1.0 + float(x[self.unknowns["clock"]][0]))
        height, speed = path.heights(stamps)
        off = height - levels
        loose = _loose(path, stamps, seen)
        near = np.abs(off) <= STRAY * self._sigma(seen, speed, loose)
        late = np.divide(off, speed, out=np.zeros_like(off), where=near & (speed > 0.0))
        return stamps + late, late, levels, loose

    def equations(self, role: str, x: Array, matches: Sequence[Index]) -> Equations:
        """Observation equations of one side for its matched edges.

        They are set up where an edge should have been stamped, not where it was: derivatives that
        knew of a stamp's own error would make a slow clock, with which all errors are smaller,
        look likelier.
        """
        at, local, seen = self.unknowns, self._local[role], self._matched(role, matches)
        rate, path = 1.0 + float(x[at["clock"]][0]), self.trajectory(role, x)
        times, late, levels, loose = self._stamps(role, x, seen)
        height, speed, moved = path.sights(times, local.path)
        values = height - levels + speed * late
        sigma = self._sigma(seen, speed, loose)
        slopes = np.zeros((times.size, local.columns.size))
        places, fixed = self._fixed_slopes(role, seen)
        slopes.ravel()[places] = fixed
        slopes[:, : local.moving] += moved
        # Of a slow clock the true time is later, and the chain lower by then.
        slopes[:, local.at[at["clock"].start]] -= speed * times / rate
        told = self._part(seen, loose > 0.0, values, sigma)
        second = np.flatnonzero(told)
        slopes[second] -= told[second, None] * slopes[second - 1]
        left = Residuals(values, sigma, speed, seen.burst == 0.0, loose)
        return Equations(left, told, slopes, local.columns)

    def _fixed_slopes(self, role: str, seen: Seen) -> tuple[Index, Array]:
        """Return what of the slopes is the same wherever the chain is: flat places, and values."""
        known = self._fixed.get(role)
        if known is not None and known[0] is seen:
            return known[1:]
        at, of = self.unknowns, self._local[role].at
        columns: list[tuple[Index | int, Array | float]] = [
            (at[f"{role} rods"].start + seen.rods, 1.0),
            (at[f"{role} width"].start, seen.sign),
            (at["beams"].start + seen.gate, -1.0),
            (at["datum"].start + self._post[seen.gate], -1.0),
        ]
        if "ripple" in at:
            columns.append((at["ripple"].start + seen.gate, self._tilts[role] * seen.turn))
        if f"{role} off centre" in at:
            columns.append((at[f"{role} off centre"].start, seen.turn))
        if f"{role} swing" in at:
            columns.append((at[f"{role} swing"].start, -seen.drawn))
        if role == "impact":
            columns.append((at["top"].start, seen.alone.astype(np.float64)))
            columns.append((at["landed"].start, seen.landed))
            modes = -self.discrepancy.stretch[seen.pick].T
            for name in STRETCHES:
                columns += [(at[name].start + n, mode) for n, mode in enumerate(modes)]
        edges = seen.times.size
        places = np.empty((len(columns), edges), dtype=np.intp)
        values = np.empty((len(columns), edges))
        for n, (column, value) in enumerate(columns):
            places[n], values[n] = of[column], value
        places += np.arange(edges) * self._local[role].columns.size
        self._fixed[role] = seen, places, values
        return places, values


def _loose(path: Trajectory, times: Array, seen: Seen) -> Array:
    """How loose a chain is at each edge, see `Trajectory.loose`; the top rod alone is no chain."""
    return np.where(seen.alone, 0.0, path.loose(times))


def prior_air(protocol: Protocol) -> tuple[float, float]:
    """κ of the first chain as a whole as it is known beforehand, 1/m, and its uncertainty."""
    if protocol.drag is None:
        return 0.0, protocol.priors.drag
    kappa = air_of(protocol, next(iter(protocol.chains)))[0]
    return kappa, kappa * protocol.drag.relative_u
