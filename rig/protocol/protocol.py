"""Content of a protocol file as plain data: the scene, the gates and the plan of runs.

Lengths are metres, times seconds, angles degrees. Whatever a scene does not have is ``None`` or
empty, and every later stage leaves it out.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product
from math import cos, hypot, radians, sin
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from rig.plain_data import Record, attributes
from rig.protocol.fields import DEFAULTS
from rig.units import Quantity
from rig.vocabulary import FENCE, FREE_CHAIN, OBJECT, ONE_CHAIN, TRACK, TWO_CHAINS, Vocabulary

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from rig.model.chain import Chain
    from rig.model.surface import Surface

Side = Literal["impact", "free"]
Order = Literal["ABBA", "alternate", "fixed"]
# Which chain is on the impact side, repeating. ABBA cancels a drift that is linear in time.
PATTERNS: dict[Order, tuple[int, ...]] = {"ABBA": (0, 1, 1, 0), "alternate": (0, 1), "fixed": (0,)}
STANDARD_GRAVITY: Quantity = DEFAULTS["gravity"]
SIDES: tuple[Side, ...] = ("impact", "free")


@dataclass(frozen=True, slots=True)
class RodChain:
    """A physical chain: its mechanics, and its rods as seen by a beam.

    Attributes
    ----------
    name
        The label on the chain, ``A`` or ``B``.
    chain
        Masses, heights and inertia for the model.
    widths
        Height of each rod as a level beam sees it, ``d / cos(tilt)``, m; bottom up.
    tilt_deg
        Mean tilt of the rods from horizontal.
    position_u
        Standard uncertainty of each rod's place on the string, m.
    width_u
        Standard uncertainty of the effective width common to the rods, m.
    diameters
        Diameters of the rods, m; 0 if unknown; bottom up.
    rod_length
        Length of the rods, m; 0 if unknown.
    weighed
        Whether the masses are in kg; otherwise only their ratios are known.
    """

    name: str
    chain: Chain
    widths: tuple[float, ...]
    tilt_deg: float
    position_u: float
    width_u: float
    diameters: tuple[float, ...]
    rod_length: float
    weighed: bool

    @property
    def missing_keys(self) -> tuple[str, ...]:
        """Optional keys of the rods that the file does not give."""
        thinnest = min(self.diameters, default=0.0)
        values = {"mass": self.weighed, "diameter": thinnest, "rod_length": self.rod_length}
        return tuple(key for key, value in values.items() if not value)


def vocabulary_of(chains: Collection[RodChain], *, struck: bool) -> Vocabulary:
    """Return the vocabulary of a scene with these chains."""
    if all(rods.chain.rods == 1 for rods in chains):
        return OBJECT
    if struck:
        return TWO_CHAINS if len(chains) > 1 else ONE_CHAIN
    strung = any(rods.tilt_deg for rods in chains)
    return FREE_CHAIN if strung or len(chains) > 1 else FENCE


@dataclass(frozen=True, slots=True)
class Gate:
    """One photogate: a level beam at a height above the contact point.

    Attributes
    ----------
    height
        Height, m.
    stated
        Height as in the file, m, if it has another zero there.
    """

    channel: int
    height: float
    side: Side
    stated: float | None = None


@dataclass(frozen=True, slots=True)
class Gates:
    """The photogate array; false if it has no gate.

    Attributes
    ----------
    gates
        All gates, impact side first, in the order of the file.
    height_u
        Standard uncertainty of each beam height above its post's zero, m.
    datum_u
        Standard uncertainty of each post's zero above the contact point, m: all beams of one side
        share it.
    """

    gates: tuple[Gate, ...] = ()
    height_u: float = DEFAULTS["gates.height_uncertainty"]
    datum_u: float = DEFAULTS["gates.datum_uncertainty"]

    def __bool__(self) -> bool:
        return bool(self.gates)

    def on(self, side: Side) -> tuple[Gate, ...]:
        """Gates of one side, in file order."""
        return tuple(gate for gate in self.gates if gate.side == side)

    @property
    def posts(self) -> tuple[Side, ...]:
        """Sides that have gates."""
        return tuple(dict.fromkeys(gate.side for gate in self.gates))

    @property
    def mask(self) -> int:
        """Bit mask of the channels in use."""
        return sum(1 << gate.channel for gate in self.gates)


@dataclass(frozen=True, slots=True)
class Contact:
    """Contact of rods with the surface.

    Attributes
    ----------
    level
        Height at which an undisturbed rod's middle touches the surface, above the zero of the gate
        heights, m.
    strike
        Height of the top rod's strike above `level`, on the rods that lie there, m.
    from_board
        Whether heights are measured from the board: then contact heights follow from the rods'
        geometry, and `level` is a correction.
    """

    level: Quantity = DEFAULTS["contact.level"]
    strike: Quantity = DEFAULTS["contact.strike"]
    from_board: bool = False


class InclinedTrack(NamedTuple):
    """Inclined track down which an object slides or rolls.

    Attributes
    ----------
    incline_deg
        Inclination of the track, degrees.
    rolling_inertia
        I/(m r²) of a rolling object; 0 for a sliding one.
    """

    incline_deg: Quantity
    rolling_inertia: float = DEFAULTS["track.rolling_inertia"]

    def along(self, gravity: Quantity) -> Quantity:
        """Return the acceleration without friction, g sin θ/(1 + I/(m r²)), m/s²."""
        slope = radians(self.incline_deg.value)
        share = 1.0 / (1.0 + self.rolling_inertia)
        by_slope = gravity.value * cos(slope) * radians(self.incline_deg.u)
        u = share * hypot(sin(slope) * gravity.u, by_slope)
        return Quantity(share * gravity.value * sin(slope), u)


class Drag(NamedTuple):
    """Drag proportional to the square of the speed.

    Attributes
    ----------
    coefficient
        C of every rod across the flow; `None` if the terminal speed is given.
    air_density
        kg/m³; used with the coefficient.
    terminal_speed
        Speed at which drag balances the weight of a chain and of each of its parts, m/s.
    """

    coefficient: Quantity | None = None
    air_density: float = DEFAULTS["drag.air_density"]
    terminal_speed: Quantity | None = None

    @property
    def relative_u(self) -> float:
        """Relative standard uncertainty of the drag."""
        if self.terminal_speed is not None:
            return 2.0 * self.terminal_speed.u / self.terminal_speed.value
        return self.coefficient.u / self.coefficient.value if self.coefficient else 0.0


class ReleasePulse(NamedTuple):
    """The actuator: its channel and the length of the pulse in seconds."""

    channel: int = DEFAULTS["release.channel"]
    pulse: float = DEFAULTS["release.pulse"]


@dataclass(frozen=True, slots=True)
class Plan:
    """Layout of the runs, expanded by `Protocol.runs`."""

    inclines: tuple[float, ...] = DEFAULTS["plan.incline"]
    repeats: int = DEFAULTS["plan.repeats"]
    order: Order = DEFAULTS["plan.order"]
    randomize: Literal["none", "incline", "all"] = DEFAULTS["plan.randomize"]
    seed: int = DEFAULTS["plan.seed"]
    settle: float = DEFAULTS["plan.settle"]


@dataclass(frozen=True, slots=True)
class Accept:
    """Limits beyond which a run is void; fixed before any result is seen.

    Attributes
    ----------
    release_skew
        Between both chains, s.
    missed_edges
        Share of the expected edges that may be missing.
    unexplained_edges
        Share of the received edges that may belong to no rod and to no known disturbance.
    """

    release_skew: float = DEFAULTS["accept.release_skew"]
    missed_edges: float = DEFAULTS["accept.missed_edges"]
    unexplained_edges: float = DEFAULTS["accept.unexplained_edges"]


GUESSED = 8.0
"""Degrees of freedom of an uncertainty that is known to 25 % (GUM G.4.2, E.4.3)."""


@dataclass(frozen=True, slots=True)
class Priors:
    """Assumed standard deviations of quantities that are not measured, SI units.

    `rig.protocol.keys.KEYS` has the meaning and source of each.
    """

    edge_floor: float = DEFAULTS["priors.edge_floor"]
    jitter: float = DEFAULTS["priors.jitter"]
    hang: float = DEFAULTS["priors.hang"]
    side: float = DEFAULTS["priors.side"]
    beam_offset: float = DEFAULTS["priors.beam_offset"]
    off_centre: float = DEFAULTS["priors.off_centre"]
    swing: float = DEFAULTS["priors.swing"]
    departure: float = DEFAULTS["priors.departure"]
    last_rods: float = DEFAULTS["priors.last_rods"]
    impulses: float = DEFAULTS["priors.impulses"]
    impulse_floor: float = DEFAULTS["priors.impulse_floor"]
    last_impulse: float = DEFAULTS["priors.last_impulse"]
    strings: float = DEFAULTS["priors.strings"]
    stretch: float = DEFAULTS["priors.stretch"]
    late_pull: float = DEFAULTS["priors.late_pull"]
    drag: float = DEFAULTS["priors.drag"]


@dataclass(frozen=True, slots=True)
class Protocol:
    """One protocol file, checked.

    Attributes
    ----------
    chains
        By name. One chain: a single-chain or free-fall scene. Two: the two-chain experiment.
    gravity
        Acceleration along the path, m/s²; on a track by `InclinedTrack.along`.
    surface
        `None` without impacts, as in the rig's calibration drop.
    track
        `None` for a free fall; otherwise all heights are lengths along the track.
    drop
        Height of the bottom rod's middle above the contact point (with no surface: above the
        datum of the gate heights) before release; `None` without gates that measure it.
    initial_speed
        Downward speed of all chains at release, m/s.
    drag
        Stated drag, if any.
    reference_u
        Relative standard uncertainty of the 1 Hz reference, if one is wired.
    priors
        Priors of all other effects on edges.
    gates
        None of them in a scene that is only predicted.
    blind
        Whether results are withheld until the session is unblinded.
    notes
        Notes of the author.
    text
        The file as read, stored word for word in the session.
    stated
        The original protocol with heights as in its file, if heights here are relative to a run's
        contact point: see `rig.protocol.contact`.
    variants
        The scene in each setting of the keys that the plan varies; empty if it varies none.
    """

    title: str
    chains: dict[str, RodChain]
    gravity: Quantity
    drop: Quantity
    surface: Surface | None
    track: InclinedTrack | None
    gates: Gates
    release: ReleasePulse
    plan: Plan
    accept: Accept
    initial_speed: Quantity
    drag: Drag | None
    contact: Contact
    reference_u: float
    priors: Priors
    blind: bool
    notes: str
    text: str
    source: str
    stated: Protocol | None = None
    variants: Mapping[str, Protocol] = field(default_factory=dict)

    def __hash__(self) -> int:  # equality compares everything; this separates most protocols
        return hash((self.text, self.drop, self.gates))

    @property
    def one_object(self) -> bool:
        """Whether a single body passes the gates: a ball, a card, a glider."""
        return all(rods.chain.rods == 1 for rods in self.chains.values())

    @property
    def thrown(self) -> bool:
        """Whether chains have an initial speed: then drops can only be predicted."""
        return self.initial_speed != Quantity(0.0)

    @property
    def vocabulary(self) -> Vocabulary:
        """Vocabulary of this kind of scene."""
        if self.track:
            return TRACK
        return vocabulary_of(self.chains.values(), struck=self.surface is not None)

    @property
    def zero(self) -> str:
        """Zero of the drop and gate heights, in words."""
        if self.surface is None:
            return "zero of the heights"
        return "board" if self.contact.from_board and self.stated is None else "contact point"

    @property
    def drop_from(self) -> str:
        """Zero and direction of the drop height, in words."""
        return f"above the {self.zero}" if self.track is None else "along the track"

    @property
    def two_chains(self) -> bool:
        """Whether a free chain falls beside the impact chain."""
        return self.surface is not None and len(self.chains) > 1

    @property
    def unlike_chains(self) -> bool:
        """Whether results depend on which of the two chains strikes."""
        in_air = self.drag is not None and self.drag.coefficient is not None
        chains = {
            (rods.chain, in_air and (rods.diameters, rods.rod_length, rods.tilt_deg))
            for rods in self.chains.values()
        }
        return self.two_chains and len(chains) > 1

    @property
    def strikers(self) -> tuple[str, ...]:
        """Chains with separate results as striking chain; for like chains only the first."""
        names = tuple(self.chains)
        return names if self.unlike_chains and self.plan.order != "fixed" else names[:1]

    def with_gates(self, gates: Iterable[Gate]) -> Protocol:
        """Return the protocol with other gates, whose heights are as uncertain."""
        arrays = replace(self.gates, gates=tuple(gates))
        variants = {at: replace(scene, gates=arrays) for at, scene in self.variants.items()}
        return replace(self, gates=arrays, variants=variants)

    @property
    def settings(self) -> Mapping[str, Protocol]:
        """The scene in each setting of the keys that the plan varies; itself if it varies none."""
        return self.variants or {"": self}

    def of(self, run: Run) -> Protocol:
        """Return the scene in the setting of a run."""
        return self.variants.get(run.setting, self)

    def condition(self, run: Run) -> Condition:
        """Return the condition of a run, for averages over runs.

        Without a surface the measurand is gravity, the same in all settings unless they change it.
        """
        scenes = self, *self.variants.values()
        unlike = any(scene.unlike_chains for scene in scenes)
        is_apart = self.surface is not None or len({scene.gravity for scene in scenes}) > 1
        chain = run.impact if unlike else None
        return Condition(run.incline_deg, chain, run.setting if is_apart else "")

    def runs(self) -> tuple[Run, ...]:
        """Return all planned runs.

        At each incline and setting the impact chain of runs 1, 2, 3, 4 … is A, B, B, A …
        (``ABBA``), A, B, A, B … (``alternate``) or always A (``fixed``), A being the chain named
        first. ``randomize: incline`` shuffles inclines and settings together, and leaves each
        block whole; ``randomize: all`` shuffles the runs themselves, so each chain keeps its
        number of impacts in each case.

        Returns
        -------
        tuple of Run
            A run for each incline, setting and repeat, numbered from 1 in the order of execution.
            The same protocol gives the same runs on every machine.
        """
        plan = self.plan
        cases = list(product(plan.inclines, self.settings))
        if plan.randomize == "incline":
            _shuffle(cases, plan.seed)
        pattern = PATTERNS[plan.order]
        drops = [
            (incline, *self._sides(pattern[repeat % len(pattern)]), setting)
            for incline, setting in cases
            for repeat in range(plan.repeats)
        ]
        if plan.randomize == "all":
            _shuffle(drops, plan.seed)
        return tuple(Run(number, *drop) for number, drop in enumerate(drops, start=1))

    def _sides(self, first: int) -> tuple[str | None, str | None]:
        """Return the names of the chains on the impact and the free side."""
        names = list(self.chains)
        if self.surface is None:
            return None, names[0]
        if len(names) == 1:
            return names[0], None
        return names[first], names[1 - first]


class Condition(NamedTuple):
    """Condition that runs must share for their results to be averaged.

    `impact_chain` is the striking chain if results depend on it; `None` for like chains.
    """

    incline_deg: float
    impact_chain: str | None = None
    setting: str = ""

    def __str__(self) -> str:
        chain = self.impact_chain and f"{self.impact_chain} strikes"
        return ", ".join(filter(None, (f"{self.incline_deg:.15g} deg", chain, self.setting)))

    def json(self) -> dict[str, Any]:
        """Return ``incline_deg`` and, if there are any, ``impact_chain`` and ``setting``."""
        return attributes(self, "incline_deg", "impact_chain?", "setting?")


@dataclass(frozen=True, slots=True)
class Run(Record):
    """One planned drop.

    Attributes
    ----------
    number
        1, 2, 3 … in the order of execution.
    incline_deg
        Surface inclination; 0 without a surface.
    impact
        Name of the chain on the impact side; `None` without a surface.
    free
        Name of the chain on the free side; `None` if only the impact chain falls.
    setting
        Values of the keys that the plan varies, in words; empty if it varies none.
    """

    MEMBERS = "run=number incline_deg impact_chain=impact setting?"

    number: int
    incline_deg: float
    impact: str | None
    free: str | None
    setting: str = ""

    @property
    def kind(self) -> Run:
        """The same for all runs that differ only in their number."""
        return replace(self, number=0)

    @property
    def set_up(self) -> str:
        """What is set before the drop, in words: the incline, and the keys that the plan varies."""
        incline = "" if self.impact is None else f"{self.incline_deg:g}°"
        return ", ".join(filter(None, (incline, self.setting)))


def _shuffle(items: list[Any], seed: int) -> None:
    """Shuffle by Fisher and Yates, the same everywhere.

    Python promises the sequence of ``random()`` for a given seed across versions and platforms,
    but not what ``shuffle()`` makes of it.
    """
    import random  # noqa: PLC0415 - most plans are not shuffled

    source = random.Random(seed)
    for last in reversed(range(1, len(items))):
        swap = int(source.random() * (last + 1))
        items[last], items[swap] = items[swap], items[last]
