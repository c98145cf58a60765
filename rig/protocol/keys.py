"""Every key of a protocol file, in one table: what it may be, what it is by default, what it means.

The reader checks a file by this table, `rig check --keys` prints it, `rig check --schema` makes the
JSON Schema of editors from it, and `rig check` and `rig sweep` take ranges and words from it. A new
key is a row here, and whatever uses it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from rig.boards import GATES, RELEASES
from rig.units import Dimension, Quantity, format_quantity, parse

ANY = "*"
"""Stands in a path for names that the file chooses: of chains."""
EACH = "[]"
"""Stands in a path for each item of a list."""
BOOLEANS = dict.fromkeys(("true", "True", "TRUE"), True)
BOOLEANS |= dict.fromkeys(("false", "False", "FALSE"), False)
"""As YAML 1.2 writes them (core schema, section 10.3.2)."""


@dataclass(frozen=True, slots=True)
class Range:
    """A quantity: accepted values in base units, and the unit in which to say so.

    `exact` refuses a written uncertainty; it is empty where one is accepted.
    """

    dimension: Dimension
    low: float
    high: float
    unit: str
    open_low: bool = False
    exact: str = "no uncertainty is accepted here"

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high and not (self.open_low and value == self.low)

    def __str__(self) -> str:
        low, high = (format_quantity(Quantity(x), self.unit) for x in (self.low, self.high))
        return f"above {low}, up to {high}" if self.open_low else f"{low} to {high}"


class Whole(NamedTuple):
    """Whole numbers from `low` to `high`."""

    low: int
    high: int

    def __str__(self) -> str:
        between = f"{self.low} to {self.high}"
        return f"a whole number, {between}" if self.low < self.high else str(self.low)


class OneOf(NamedTuple):
    """One of these words."""

    words: tuple[str, ...]

    def __str__(self) -> str:
        return ", ".join(self.words)


class OneOrMore(NamedTuple):
    """One value or a list of them."""

    each: Range

    def __str__(self) -> str:
        return f"{self.each}; one or a list"


class Either(NamedTuple):
    """A value of one of these kinds, which are written differently."""

    kinds: tuple[Accepted, ...]

    def __str__(self) -> str:
        return "; or ".join(map(str, self.kinds))


class ListOf(NamedTuple):
    """A list, whose items have keys of their own or are values."""

    each: Range | None = None

    def __str__(self) -> str:
        return "a list" if self.each is None else f"a list of values, {self.each}"


class Mapped(NamedTuple):
    """Keys with values: those of the table, or names that the file chooses."""

    def __str__(self) -> str:
        return "keys"


class Text(NamedTuple):
    """Any text."""

    def __str__(self) -> str:
        return "text"


Accepted = Range | Whole | OneOf | OneOrMore | Either | ListOf | Mapped | Text


class Key(NamedTuple):
    """One key.

    Attributes
    ----------
    path
        From the root, parts joined by dots; see `ANY` and `EACH`.
    accepted
        What it may be.
    default
        What it is where it is left out, as written in a file; empty where it then is not there.
    meaning
        In words.
    example
        As written in a file.
    required
        Whether it must be there.
    in_words
        Whether the default follows from something else, which it names.
    scene
        What a scene needs for this key to matter: empty, or one of `rig.protocol.describe.SCENES`.
    source
        Where the default comes from.
    """

    path: str
    accepted: Accepted
    default: str
    meaning: str
    example: str
    required: bool = False
    in_words: bool = False
    scene: str = ""
    source: str = ""


LENGTH, TIME, ANGLE = Dimension.LENGTH, Dimension.TIME, Dimension.ANGLE
SPEED, MASS, NUMBER = Dimension.SPEED, Dimension.MASS, Dimension.NUMBER
_MAP, _TEXT, _LIST = Mapped(), Text(), ListOf()
MOST_RODS = 1000
_COUNT = Whole(1, MOST_RODS)
_DIAMETER = Range(LENGTH, 1e-6, 1.0, "mm")
_MASS = Range(MASS, 1e-9, 1000.0, "kg")
_SMALL = Range(LENGTH, 0.0, 0.1, "mm")
# An effective restitution below zero is a pile that gives way (the paper finds −0.37).
_RESTITUTION = Range(NUMBER, -1.0, 1.0, "1", exact="")
_CONTACT = Range(LENGTH, -0.1, 0.1, "mm", exact="")
_CHANNEL = Whole(0, GATES - 1)
_COMMON_U = "state the uncertainty of all gates as height_uncertainty"
_BEAM = Range(LENGTH, 0.0, 100.0, "m", open_low=True, exact=_COMMON_U)
_SHARE = Range(NUMBER, 0.0, 1.0, "%")
_MULTIPLE = Range(NUMBER, 0.0, 10.0, "%")

KEYS: tuple[Key, ...] = (
    Key("protocol", Whole(1, 1), "", "version of this format", "1", required=True),
    Key("title", _TEXT, "the file's name", "title of session and reports", "Two like chains",
        in_words=True),
    Key("notes", _TEXT, "", "free text, kept with the session", "Chains weighed in May."),
    Key("blind", OneOf(tuple(BOOLEANS)), "false", "hide results until `rig unblind`", "true"),
    # That of the CGPM of 1901; on the ground anywhere g is from 9.764 to 9.834 (C. Hirt et al.,
    # 2013), so at most 0.043 off and evenly likely so (GUM 4.3.7).
    Key("gravity", Range(Dimension.ACCELERATION, 1e-3, 1000.0, "m/s^2", exact=""),
        "9.80665 ± 0.025 m/s^2",
        "local acceleration of free fall, ± its standard uncertainty; or `site`. Required with a "
        "surface; otherwise only compared with the result",
        "9.8124 m/s^2 ± 0.0002 m/s^2"),
    Key("site", _MAP, "", "gravity from the lab's place, by WGS 84", ""),
    Key("site.latitude", Range(ANGLE, -90.0, 90.0, "deg"), "", "geodetic latitude", "61.19 deg",
        required=True),
    Key("site.height", Range(LENGTH, -500.0, 9000.0, "m"), "", "above sea level", "30 m",
        required=True),
    Key("drop", Range(LENGTH, 0.0, 100.0, "m", exact=""), "0 m",
        "height of the lowest rod's, or object's, middle before release, ±: above the contact "
        "point; without a surface above any fixed level", "180 mm ± 2 mm"),
    Key("initial_speed", Range(SPEED, 0.0, 1000.0, "m/s", exact=""), "0 m/s",
        "downward speed at the release", "0.5 m/s"),

    Key("chains", _MAP, "", "one chain or two, by name", "", required=True),
    Key("chains.*.like", _TEXT, "", "another chain, whose values are used here too", "A"),
    Key("chains.*.rods", Either((_COUNT, _LIST)), "",
        "number of equal rods, or groups from the bottom up; 1 is one object, such as a ball",
        "25", required=True),
    Key("chains.*.rods.[].count", _COUNT, "1", "rods in a group", "5"),
    Key("chains.*.rods.[].diameter", _DIAMETER, "the chain's", "diameter of a group's rods",
        "12.7 mm", in_words=True),
    Key("chains.*.rods.[].mass", _MASS, "the chain's", "mass of each rod of a group", "14 g",
        in_words=True),
    Key("chains.*.length", Range(LENGTH, 1e-3, 100.0, "m"), "",
        "from the lowest rod's middle to the highest rod's middle", "1165 mm"),
    Key("chains.*.spacing", Either((OneOf(("equal-pitch", "equal-gaps")),
                                    ListOf(Range(LENGTH, 1e-6, 10.0, "m")))), "equal-pitch",
        "equal distances of middles, equal gaps, or listed from middle to middle", "equal-gaps"),
    Key("chains.*.diameter", _DIAMETER, "",
        "of the rods; of one object its length along the motion; needed with gates", "12.7 mm"),
    Key("chains.*.mass", _MASS, "as the cross-sections", "mass of each rod", "14 g", in_words=True),
    Key("chains.*.masses", Either((ListOf(_MASS), _MAP)), "",
        "masses from the bottom up, or a profile", ""),
    Key("chains.*.masses.exponential", _MAP, "", "the same ratio from rod to rod", ""),
    Key("chains.*.masses.exponential.bottom", _MASS, "", "of the lowest rod", "12 g",
        required=True),
    Key("chains.*.masses.exponential.top", _MASS, "", "of the highest rod", "3 g", required=True),
    Key("chains.*.masses.table", _LIST, "", "points, interpolated linearly", ""),
    Key("chains.*.masses.table.[].height", Range(LENGTH, 0.0, 100.0, "m"), "",
        "above the lowest rod", "0 mm", required=True),
    Key("chains.*.masses.table.[].mass", _MASS, "", "of a rod there", "12 g", required=True),
    Key("chains.*.rod_length", Range(LENGTH, 1e-6, 10.0, "m"), "",
        "length of every rod; for drag, and to check that ends do not touch", "310 mm"),
    Key("chains.*.tilt", Range(ANGLE, 0.0, 80.0, "deg"), "0 deg",
        "of the rods against level, alternating", "10 deg"),
    # From all mass in the middle to half of it at each end.
    Key("chains.*.inertia", Range(NUMBER, 0.0, 0.25, "1", open_low=True), "1/12",
        "moment of inertia of a rod about its middle over m L²: 1/12 a thin rod, 1/4 two weights "
        "at its ends", "1/20"),
    Key("chains.*.alpha", Range(NUMBER, 0.0, 1.0, "1", exact=""), "by Eqs. 8, 9 and 12",
        "impact coefficient α of every rod, ±; replaces β and μ", "0.15 ± 0.01", in_words=True),
    Key("chains.*.gamma", Range(NUMBER, 0.0, 1e6, "1"), "by Eq. 10, or 0 where alpha is given",
        "end correction γ of every rod", "0", in_words=True),
    Key("chains.*.position_uncertainty", _SMALL, "0.3 mm",
        "standard uncertainty of each rod's place in the chain", "0.2 mm"),
    Key("chains.*.width_uncertainty", _SMALL, "0.1 mm",
        "standard uncertainty of the rods' common width", "0.05 mm"),

    Key("surface", _MAP, "", "what the chain strikes; without it all fall freely", ""),
    Key("surface.restitution", _RESTITUTION, "",
        "restitution β, ±; needed unless every chain has an alpha", "0.50 ± 0.05"),
    Key("surface.friction", Range(NUMBER, 0.0, 10.0, "1", exact=""), "0", "friction μ, ±",
        "0.20 ± 0.03"),
    Key("surface.pile", _MAP, "", "rods that gather on a nearly level board", ""),
    Key("surface.pile.below", Range(ANGLE, 0.0, 90.0, "deg", open_low=True), "",
        "inclines with a pile", "30 deg", required=True),
    Key("surface.pile.restitution", _RESTITUTION, "",
        "effective β there, ±; negative if the pile gives way", "-0.37", required=True),
    Key("contact", _MAP, "", "where rods strike, above the gates' zero", ""),
    Key("contact.datum", OneOf(("contact", "board")), "contact",
        "zero of `drop` and the gates' heights: a touching rod's middle, or the board below the "
        "chain (then diameter, length and tilt give the contact height)", "board"),
    # Gates are set to a millimetre above where a rod touches, and the last rods of 25 strike up to
    # 20 mm above it on a board at 40° and more, on those before them.
    Key("contact.level", _CONTACT, "0.0 ± 1.0 mm",
        "middle of a rod that touches an empty surface, ±; with `board` a correction",
        "1.2 mm ± 0.5 mm"),
    Key("contact.strike", _CONTACT, "0 ± 10 mm",
        "height above `level` at which the highest rod strikes, on rods that lie there, ±",
        "8 mm ± 5 mm"),

    Key("track", _MAP, "", "for one object; drop and gates are lengths along the track", ""),
    Key("track.incline", Range(ANGLE, 0.1, 90.0, "deg", exact=""), "", "of the track, ±",
        "5 deg ± 0.1 deg", required=True),
    Key("track.rolling_inertia", Range(NUMBER, 0.0, 1.0, "1"), "0",
        "moment of inertia over m r²: 0 slides, 0.4 ball, 0.5 cylinder", "0.4"),

    Key("drag", _MAP, "", "known air resistance: coefficient or terminal speed", ""),
    Key("drag.coefficient", Range(NUMBER, 0.0, 10.0, "1", open_low=True, exact=""), "",
        "drag coefficient of a rod, ±", "1.1 ± 0.2"),
    # Dry, 20 °C, 1013.25 hPa.
    Key("drag.air_density", Range(Dimension.DENSITY, 0.0, 100.0, "kg/m^3", open_low=True),
        "1.204 kg/m^3", "with the coefficient", "1.15 kg/m^3"),
    Key("drag.terminal_speed", Range(SPEED, 0.01, 1e4, "m/s", exact=""), "",
        "of every part of a chain, ±", "25 m/s ± 2 m/s"),

    Key("gates", _MAP, "", "photogates; without them only predictions", ""),
    Key("gates.impact", _LIST, "", "gates of the striking chain", ""),
    Key("gates.free", _LIST, "", "gates of the free chain, or of an object", ""),
    Key("gates.impact.[].channel", _CHANNEL, "", "input of the board", "3", required=True),
    Key("gates.impact.[].height", _BEAM, "", "height of the beam above the zero of `drop`", "25 mm",
        required=True),
    Key("gates.free.[].channel", _CHANNEL, "", "input of the board", "3", required=True),
    Key("gates.free.[].height", _BEAM, "", "height of the beam above the zero of `drop`", "25 mm",
        required=True),
    Key("gates.height_uncertainty", _SMALL, "0.3 mm",
        "standard uncertainty of a beam above its post's zero", "0.2 mm"),
    # Read off a ruler to the nearest mm: ±0.5 mm, evenly likely (GUM 4.3.7).
    Key("gates.datum_uncertainty", _SMALL, "0.3 mm", "standard uncertainty of a post's zero",
        "0.1 mm"),
    # A GPS receiver's pulse per second: modules state 0.1 ppm or better with a fix.
    Key("reference", Range(NUMBER, 0.0, 1e-3, "ppm"), "0.1 ppm",
        "relative standard uncertainty of a wired 1 Hz reference", "0.5 ppm"),

    Key("release", _MAP, "", "the actuator", ""),
    Key("release.channel", Whole(0, RELEASES - 1), "0", "output of the board", "1"),
    # A coil that is held longer than this burns; one pulsed shorter does not pull.
    Key("release.pulse", Range(TIME, 0.001, 2.0, "ms"), "80 ms", "length of the pulse", "60 ms"),
    Key("plan", _MAP, "", "the runs", ""),
    Key("plan.incline", OneOrMore(Range(ANGLE, 0.0, 90.0, "deg")), "0 deg",
        "inclines of the surface", "40 deg"),
    Key("plan.repeats", Whole(1, 10_000), "1", "runs at each incline", "12"),
    Key("plan.order", OneOf(("ABBA", "alternate", "fixed")), "ABBA",
        "order in which the chains strike", "alternate"),
    Key("plan.randomize", OneOf(("none", "incline", "all")), "none",
        "shuffle the inclines, or all runs", "incline"),
    Key("plan.seed", Whole(0, 2**63 - 1), "0", "of that shuffle", "7"),
    Key("plan.settle", Range(TIME, 0.0, 3600.0, "s"), "10 s",
        "wait before each release, for chains to come to rest", "20 s"),
    Key("accept", _MAP, "", "limits beyond which a run is `void`", ""),
    Key("accept.release_skew", Range(TIME, 0.0, 10.0, "ms", open_low=True), "5 ms",
        "between the two releases", "3 ms"),
    Key("accept.missed_edges", _SHARE, "5 %", "of all expected edges", "2 %"),
    Key("accept.unexplained_edges", _SHARE, "10 %",
        "of all received edges, those of no rod and no known disturbance", "5 %"),

    Key("priors", _MAP, "", "assumed standard uncertainties of what is not measured", ""),
    Key("priors.edge_floor", _SMALL, "0.1 mm", "unmodelled scatter of an edge", "0.1 mm",
        source="rods made to ISO 2768-1 f: ±0.15 mm, uniform, is 0.09 mm"),
    Key("priors.jitter", Range(TIME, 0.0, 0.1, "µs"), "2 µs", "scatter of one time stamp", "2 µs",
        source="an edge that waits for another interrupt of a 16 MHz AVR: some µs"),
    Key("priors.hang", _SMALL, "0.3 mm", "scatter of the start height from run to run", "0.3 mm",
        source="hung by hand against a mark: ±0.5 mm, uniform, is 0.29 mm (GUM 4.3.7)"),
    Key("priors.side", _SMALL, "0.5 mm",
        "height difference of the two sides, the same in every run", "0.5 mm",
        scene="two chains", source="two marks, each read to 1 mm: √2 · 0.29 mm, rounded up"),
    Key("priors.beam_offset", _SMALL, "1 mm",
        "distance of a beam from the rods' middle; matters where rods are tilted", "1 mm",
        scene="tilted rods", source="a beam of 3 mm aimed by eye: ±1.7 mm, uniform"),
    Key("priors.off_centre", _SMALL, "1 mm",
        "the same from run to run: where a chain hangs along its beams", "1 mm",
        scene="tilted rods", source="hung by hand: ±1.7 mm, uniform"),
    Key("priors.swing", Range(SPEED, 0.0, 1.0, "m/s"), "0.1 m/s",
        "speed of the lowest rod as the chain is released", "0.1 m/s",
        scene="rods that strike", source="a chain of 1 m that visibly swings by 3 cm"),
    Key("priors.departure", _SMALL, "0.25 mm",
        "distance of a rod from its place in the chain after impacts", "0.25 mm",
        scene="surface", source="resolved falls: 0.2 mm with dead, 0.4 mm with lively strings"),
    Key("priors.last_rods", _SMALL, "0.5 mm",
        "the same for the last rods: added, divided by their number", "0.5 mm",
        scene="surface", source="resolved falls: 0.2 mm with damped, 2.4 mm with lively strings"),
    Key("priors.impulses", _SHARE, "20 %", "scatter of single impulses, relative to α", "20 %",
        scene="surface", source="resolved falls: 18 to 22 %, whatever the strings"),
    Key("priors.impulse_floor", Range(NUMBER, 0.0, 0.5, "1"), "0.003",
        "smallest scatter of single impulses, as α", "0.003",
        scene="surface", source="a guess: about 1 % of α on a level surface"),
    Key("priors.last_impulse", _MULTIPLE, "30 %",
        "further scatter of the last impulse, relative to α", "30 %",
        scene="surface", source="a guess; up to 200 % in resolved falls with lively strings"),
    Key("priors.strings", _MULTIPLE, "50 %",
        "pull of strings in the last impulse of every run, relative to α", "50 %",
        scene="surface", source="a guess: a damped string has a restitution of 30 %"),
    Key("priors.stretch", _SHARE, "2 %",
        "pull of strings on the top rod, relative to α times the chain's length", "2 %",
        scene="surface", source="resolved falls: 4 mm of 1165 mm at α 0.15"),
    Key("priors.late_pull", _MULTIPLE, "25 %",
        "share of the last impulse that comes below the lowest beam", "25 %",
        scene="surface", source="a guess, from resolved falls"),
    Key("priors.drag", Range(NUMBER, 0.0, 10.0, "1"), "0.05",
        "κ of the air, 1/m, where no drag is stated: 0 ± this", "0.05", scene="no drag",
        source="½ρCd/(¼π ρ_rod d²) of 12.7 mm rods: 0.025 aluminium, 0.06 acrylic, 0.09 oak"),
)  # fmt: skip
"""In the order in which a file is written."""

SECTIONS: dict[str, dict[str, Key]] = {}
"""The keys of each mapping, by the mapping's path and their own names."""
for _key in KEYS:
    _section, _, _name = _key.path.rpartition(".")
    SECTIONS.setdefault(_section, {})[_name] = _key


def key_at(path: str) -> Key:
    """Return the key at a path of the table."""
    section, _, name = path.rpartition(".")
    return SECTIONS[section][name]


def range_of(path: str) -> Range:
    """Return the accepted values of a key that is a quantity, or of each in its list."""
    accepted = key_at(path).accepted
    accepted = accepted.each if isinstance(accepted, OneOrMore) else accepted
    assert isinstance(accepted, Range)
    return accepted


def _default(key: Key) -> Any:
    if not key.default or key.in_words:
        return None
    match key.accepted:
        case Range(dimension, exact=exact):
            quantity = parse(key.default, dimension)
            return quantity.value if exact else quantity
        case OneOrMore(each):
            return (parse(key.default, each.dimension).value,)
        case Whole():
            return int(key.default)
        case _:
            return BOOLEANS.get(key.default, key.default)


DEFAULTS: dict[str, Any] = {key.path: _default(key) for key in KEYS}
"""Each key that is left out, by its path, in base units; `None` where it then is not there."""


_BRACKETS = (("", "{", "}"), (f".{EACH}", "[{", "}]"), (f".{ANY}", "{A: {", ", …}}"))


def example(key: Key) -> str:
    """Return an example of a key as a file has it: its own, or its required keys with theirs."""
    if key.example:
        return key.example
    for part, before, after in _BRACKETS:
        if key.path + part in SECTIONS:
            keys = SECTIONS[key.path + part].items()
            text = ", ".join(f"{name}: {example(inner)}" for name, inner in keys if inner.required)
            return f"{before}{text}{after}"
    raise KeyError(key.path)
