"""What a protocol file says, as plain data: the scene, the gates and the plan of runs.

Lengths are metres, times seconds, angles degrees. Whatever a scene does not have is ``None`` or
empty, and every later stage leaves it out.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, radians, sin
from typing import TYPE_CHECKING, Literal, NamedTuple

from rig.protocol.fields import DEFAULTS
from rig.units import Quantity
from rig.vocabulary import FENCE, FREE_CHAIN, OBJECT, ONE_CHAIN, TRACK, TWO_CHAINS, Vocabulary

if TYPE_CHECKING:
    from collections.abc import Collection

    from rig.model.chain import Chain
    from rig.model.surface import Surface

Side = Literal["impact", "free"]
Order = Literal["ABBA", "alternate", "fixed"]
AT_REST = Quantity(0.0)
STANDARD_GRAVITY: Quantity = DEFAULTS["gravity"]
PPS_U: float = DEFAULTS["reference"]
SIDES: tuple[Side, ...] = ("impact", "free")


@dataclass(frozen=True, slots=True)
class RodChain:
    """One physical chain: the mechanics of it and what a light beam sees.

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
        Of the rods, m; 0 where unknown; bottom up.
    rod_length
        Of every rod, m; 0 where unknown.
    weighed
        Whether the masses are in kg; else only their ratios mean something.
    """

    name: str
    chain: Chain
    widths: tuple[float, ...]
    tilt_deg: float = DEFAULTS["chains.*.tilt"]
    position_u: float = DEFAULTS["chains.*.position_uncertainty"]
    width_u: float = DEFAULTS["chains.*.width_uncertainty"]
    diameters: tuple[float, ...] = ()
    rod_length: float = 0.0
    weighed: bool = False

    @property
    def missing_keys(self) -> tuple[str, ...]:
        """The keys of the rods that the file leaves open, though a scene may do without them."""
        thinnest = min(self.diameters, default=0.0)
        values = {"mass": self.weighed, "diameter": thinnest, "rod_length": self.rod_length}
        return tuple(key for key, value in values.items() if not value)


def vocabulary_of(chains: Collection[RodChain], *, struck: bool) -> Vocabulary:
    """Return the words of what falls, or strikes a surface."""
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
        m.
    stated
        The same as the file has it, where it is counted from somewhere else there.
    """

    channel: int
    height: float
    side: Side
    stated: float | None = None


@dataclass(frozen=True, slots=True)
class Gates:
    """The photogate array.

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

    gates: tuple[Gate, ...]
    height_u: float
    datum_u: float = DEFAULTS["gates.datum_uncertainty"]

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
    """Where rods strike.

    Attributes
    ----------
    level
        Height at which an undisturbed rod's middle touches the surface, above the zero of the gate
        heights, m.
    strike
        How far above it the top rod strikes: on the rods that lie there, m.
    from_board
        Whether heights are measured from the board: where rods touch it follows from what they
        are like, and `level` is what that leaves out.
    """

    level: Quantity = DEFAULTS["contact.level"]
    strike: Quantity = DEFAULTS["contact.strike"]
    from_board: bool = False


@dataclass(frozen=True, slots=True)
class InclinedTrack:
    """What one object slides or rolls down.

    Attributes
    ----------
    incline_deg
        Of the track, degrees.
    rolling_inertia
        I/(m r²) of what rolls; 0 of what slides.
    """

    incline_deg: Quantity
    rolling_inertia: float = DEFAULTS["track.rolling_inertia"]

    def along(self, gravity: Quantity) -> Quantity:
        """Acceleration without friction, g sin θ/(1 + I/(m r²)), m/s²."""
        slope = radians(self.incline_deg.value)
        share = 1.0 / (1.0 + self.rolling_inertia)
        by_slope = gravity.value * cos(slope) * radians(self.incline_deg.u)
        u = share * hypot(sin(slope) * gravity.u, by_slope)
        return Quantity(share * gravity.value * sin(slope), u)


@dataclass(frozen=True, slots=True)
class Drag:
    """Drag of the air, as the square of the speed.

    Attributes
    ----------
    coefficient
        C of every rod across the flow; `None` where the terminal speed is given.
    air_density
        kg/m³; used with the coefficient.
    terminal_speed
        At which drag balances the weight of a chain and of every part of it, m/s.
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


@dataclass(frozen=True, slots=True)
class ReleasePulse:
    """The actuator: its channel and the length of the pulse in seconds."""

    channel: int = DEFAULTS["release.channel"]
    pulse: float = DEFAULTS["release.pulse"]


@dataclass(frozen=True, slots=True)
class Plan:
    """How the runs are laid out; `rig.protocol.plan.runs` expands it."""

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
"""Degrees of freedom of a scale that is known to a quarter of itself (GUM G.4.2, E.4.3)."""


@dataclass(frozen=True, slots=True)
class Priors:
    """What is known beforehand of what nobody measures, as standard deviations in SI units.

    `rig.protocol.keys.KEYS` says of each what it is, and where it comes from.
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
        What pulls along the way, m/s²: of what goes down a track only the share that its slope
        leaves, see `InclinedTrack.along`.
    surface
        `None` where nothing is struck: the rig's calibration drop.
    track
        `None` of what falls; else all heights are lengths along the track.
    drop
        Height of the bottom rod's middle above the contact point (with no surface: above the
        datum of the gate heights) before release; `None` where no gates measure it.
    initial_speed
        Of every chain as it is let go, downward, m/s.
    drag
        `None` where the air is left out.
    reference_u
        Relative standard uncertainty of the 1 Hz reference, where one is wired.
    priors
        Of what the edges are made of, besides.
    gates
        `None` for a scene that is only predicted.
    blind
        Whether numbers are kept back until the session is unblinded.
    notes
        What its author wrote to it.
    text
        The file as read, kept word for word in the session.
    stated
        The protocol that this one is made from, with heights as its file has them, where those of
        this one are counted from a run's contact point: see `rig.protocol.contact`.
    """

    title: str
    chains: dict[str, RodChain]
    gravity: Quantity
    drop: Quantity
    surface: Surface | None = None
    track: InclinedTrack | None = None
    gates: Gates | None = None
    release: ReleasePulse = field(default_factory=ReleasePulse)
    plan: Plan = field(default_factory=Plan)
    accept: Accept = field(default_factory=Accept)
    initial_speed: Quantity = AT_REST
    drag: Drag | None = None
    contact: Contact = field(default_factory=Contact)
    reference_u: float = PPS_U
    priors: Priors = field(default_factory=Priors)
    blind: bool = False
    notes: str = ""
    text: str = ""
    source: str = ""
    stated: Protocol | None = None

    def __hash__(self) -> int:  # all of it is compared, and this tells most of them apart
        return hash((self.text, self.drop, self.gates))

    @property
    def one_object(self) -> bool:
        """Whether a single body passes the gates: a ball, a card, a glider."""
        return all(rods.chain.rods == 1 for rods in self.chains.values())

    @property
    def vocabulary(self) -> Vocabulary:
        """The words of this kind of scene."""
        if self.track:
            return TRACK
        return vocabulary_of(self.chains.values(), struck=self.surface is not None)

    @property
    def zero(self) -> str:
        """What drop and gates' heights are counted from, in words."""
        if self.surface is None:
            return "zero of the heights"
        return "board" if self.contact.from_board and self.stated is None else "contact point"

    @property
    def drop_from(self) -> str:
        """Where the drop is measured, in words."""
        return f"above the {self.zero}" if self.track is None else "along the track"

    @property
    def two_chains(self) -> bool:
        """Whether a free chain falls beside the impact chain."""
        return self.surface is not None and len(self.chains) > 1

    @property
    def unlike_chains(self) -> bool:
        """Whether it changes a result which of the two chains strikes."""
        in_air = self.drag is not None and self.drag.coefficient is not None
        chains = {
            (rods.chain, in_air and (rods.diameters, rods.rod_length, rods.tilt_deg))
            for rods in self.chains.values()
        }
        return self.two_chains and len(chains) > 1

    @property
    def strikers(self) -> tuple[str, ...]:
        """The chains whose strike makes a result of its own; like chains are one, the first."""
        names = tuple(self.chains)
        return names if self.unlike_chains and self.plan.order != "fixed" else names[:1]

    def condition(self, run: Run) -> Condition:
        """Return what a run has in common with those that it is averaged with."""
        return Condition(run.incline_deg, run.impact if self.unlike_chains else None)


class Condition(NamedTuple):
    """What runs have in common whose results are averaged.

    `impact_chain` is the one that strikes where that makes a result of its own; like chains are
    one, and it is `None`.
    """

    incline_deg: float
    impact_chain: str | None = None

    def __str__(self) -> str:
        chain = "" if self.impact_chain is None else f", {self.impact_chain} strikes"
        return f"{self.incline_deg:.15g} deg{chain}"

    def json(self) -> dict[str, float | str]:
        """``incline_deg`` and, if there is one, ``impact_chain``."""
        chain = {} if self.impact_chain is None else {"impact_chain": self.impact_chain}
        return {"incline_deg": self.incline_deg, **chain}


@dataclass(frozen=True, slots=True)
class Run:
    """One planned drop.

    Attributes
    ----------
    number
        1, 2, 3 … in the order of execution.
    incline_deg
        Surface inclination; 0 where there is no surface.
    impact
        Name of the chain on the impact side; `None` where there is no surface.
    free
        Name of the chain on the free side; `None` where only one chain falls.
    """

    number: int
    incline_deg: float
    impact: str | None
    free: str | None
