"""Every key of a protocol file: what it may be, what it is without being written, what it means.

The page `docs/protocol.md` and the JSON Schema that editors read are made from this one table, and
tests read every example of it with the reader itself.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from rig.boards import GATES, RELEASES
from rig.protocol import chains, drag, gates, masses, reader, rods, settings, spacing, surface
from rig.protocol.fields import BOOLEANS, Range
from rig.protocol.priors import PRIORS
from rig.protocol.protocol import (
    DATUM_U,
    STANDARD_GRAVITY,
    Accept,
    Contact,
    Drag,
    Plan,
    Priors,
    ReleasePulse,
)
from rig.units import Dimension, Quantity, format_quantity

ANY = "*"
"""Stands in a path for names that the file chooses: of chains."""
EACH = "[]"
"""Stands in a path for each item of a list."""


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
    """A value of one of these kinds."""

    kinds: tuple[Accepted, ...]

    def __str__(self) -> str:
        return "; or ".join(map(str, self.kinds))


class ListOf(NamedTuple):
    """A list, whose items have keys of their own or are values."""

    each: Range | None = None

    def __str__(self) -> str:
        return "a list" if self.each is None else f"a list of values, {self.each}"


class Mapped(NamedTuple):
    """Keys with values."""

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
        What it is where it is left out; empty where it then is not there at all.
    meaning
        In words.
    example
        As written in a file.
    required
        Whether it must be there.
    """

    path: str
    accepted: Accepted
    default: str
    meaning: str
    example: str
    required: bool = False


def _said(value: float, unit: str) -> str:
    return format_quantity(Quantity(value), unit)


_PLAN, _PULSE, _ACCEPT, _CONTACT = Plan(), ReleasePulse(), Accept(), Contact()
_MAP, _TEXT = Mapped(), Text()

KEYS: tuple[Key, ...] = (
    Key("protocol", Whole(1, 1), "", "version of this format", "1", required=True),
    Key("title", _TEXT, "the file's name", "title of session and reports", "Two like chains"),
    Key("notes", _TEXT, "", "free text, kept with the session", "Chains weighed in May."),
    Key("blind", OneOf(tuple(BOOLEANS)), "false", "hide results until `rig unblind`", "true"),
    Key("gravity", reader.GRAVITY, f"{STANDARD_GRAVITY.value} ± {STANDARD_GRAVITY.u} m/s^2",
        "local acceleration of free fall, ± its standard uncertainty; or `site`. Required with a "
        "surface; otherwise only compared with the result",
        "9.8124 m/s^2 ± 0.0002 m/s^2"),
    Key("site", _MAP, "", "gravity from the lab's place, by WGS 84", ""),
    Key("site.latitude", reader.LATITUDE, "", "geodetic latitude", "61.19 deg", required=True),
    Key("site.height", reader.HEIGHT, "", "above sea level", "30 m", required=True),
    Key("drop", reader.DROP, "0 m",
        "height of the lowest rod's, or object's, middle before release, ±: above the contact "
        "point; without a surface above any fixed level", "180 mm ± 2 mm"),
    Key("initial_speed", reader.INITIAL_SPEED, "0 m/s", "downward speed at the release", "0.5 m/s"),

    Key("chains", _MAP, "", "one chain or two, by name", "", required=True),
    Key(f"chains.{ANY}.like", _TEXT, "", "another chain, whose values are used here too", "A"),
    Key(f"chains.{ANY}.rods", Either((Whole(1, rods.MOST_RODS), ListOf())), "",
        "number of equal rods, or groups from the bottom up; 1 is one object, such as a ball",
        "25", required=True),
    Key(f"chains.{ANY}.rods.{EACH}.count", Whole(1, rods.MOST_RODS), "1", "rods in a group", "5"),
    Key(f"chains.{ANY}.rods.{EACH}.diameter", rods.DIAMETER, "the chain's",
        "diameter of a group's rods", "12.7 mm"),
    Key(f"chains.{ANY}.rods.{EACH}.mass", rods.MASS, "the chain's", "mass of each rod of a group",
        "14 g"),
    Key(f"chains.{ANY}.length", chains.LENGTH, "",
        "from the lowest rod's middle to the highest rod's middle", "1165 mm"),
    Key(f"chains.{ANY}.spacing", Either((OneOf(("equal-pitch", "equal-gaps")),
                                         ListOf(spacing.GAP))), "equal-pitch",
        "equal distances of middles, equal gaps, or listed from middle to middle",
        "equal-gaps"),
    Key(f"chains.{ANY}.diameter", rods.DIAMETER, "",
        "of the rods; of one object its length along the motion; needed with gates", "12.7 mm"),
    Key(f"chains.{ANY}.mass", rods.MASS, "as the cross-sections", "mass of each rod", "14 g"),
    Key(f"chains.{ANY}.masses", Either((ListOf(rods.MASS), _MAP)), "",
        "masses from the bottom up, or a profile", ""),
    Key(f"chains.{ANY}.masses.exponential", _MAP, "", "the same ratio from rod to rod", ""),
    Key(f"chains.{ANY}.masses.exponential.bottom", rods.MASS, "", "of the lowest rod", "12 g",
        required=True),
    Key(f"chains.{ANY}.masses.exponential.top", rods.MASS, "", "of the highest rod", "3 g",
        required=True),
    Key(f"chains.{ANY}.masses.table", ListOf(), "", "points, interpolated linearly", ""),
    Key(f"chains.{ANY}.masses.table.{EACH}.height", masses.HEIGHT, "", "above the lowest rod",
        "0 mm", required=True),
    Key(f"chains.{ANY}.masses.table.{EACH}.mass", rods.MASS, "", "of a rod there", "12 g",
        required=True),
    Key(f"chains.{ANY}.rod_length", chains.ROD_LENGTH, "",
        "length of every rod; for drag, and to check that ends do not touch", "310 mm"),
    Key(f"chains.{ANY}.tilt", chains.TILT, "0 deg", "of the rods against level, alternating",
        "10 deg"),
    Key(f"chains.{ANY}.inertia", chains.INERTIA, "1/12",
        "moment of inertia of a rod about its middle over m L²: 1/12 a thin rod, 1/4 two weights "
        "at its ends", "1/20"),
    Key(f"chains.{ANY}.alpha", chains.ALPHA, "by Eqs. 8, 9 and 12",
        "impact coefficient α of every rod, ±; replaces β and μ", "0.15 ± 0.01"),
    Key(f"chains.{ANY}.gamma", chains.GAMMA, "by Eq. 10, or 0 where alpha is given",
        "end correction γ of every rod", "0"),
    Key(f"chains.{ANY}.position_uncertainty", chains.UNCERTAINTY,
        "0.3 mm", "standard uncertainty of each rod's place in the chain", "0.2 mm"),
    Key(f"chains.{ANY}.width_uncertainty", chains.UNCERTAINTY,
        "0.1 mm", "standard uncertainty of the rods' common width", "0.05 mm"),

    Key("surface", _MAP, "", "what the chain strikes; without it all fall freely", ""),
    Key("surface.restitution", surface.RESTITUTION, "",
        "restitution β, ±; needed unless every chain has an alpha", "0.50 ± 0.05"),
    Key("surface.friction", surface.FRICTION, "0", "friction μ, ±", "0.20 ± 0.03"),
    Key("surface.pile", _MAP, "", "rods that gather on a nearly level board", ""),
    Key("surface.pile.below", surface.BELOW, "", "inclines with a pile", "30 deg", required=True),
    Key("surface.pile.restitution", surface.RESTITUTION, "",
        "effective β there, ±; negative if the pile gives way", "-0.37", required=True),
    Key("contact", _MAP, "", "where rods strike, above the gates' zero", ""),
    Key("contact.datum", OneOf(reader.DATUMS), reader.DATUMS[0],
        "zero of `drop` and the gates' heights: a touching rod's middle, or the board below the "
        "chain (then diameter, length and tilt give the contact height)", "board"),
    Key("contact.level", reader.CONTACT, format_quantity(_CONTACT.level, "mm"),
        "middle of a rod that touches an empty surface, ±; with `board` a correction",
        "1.2 mm ± 0.5 mm"),
    Key("contact.strike", reader.CONTACT, format_quantity(_CONTACT.strike, "mm"),
        "height above `level` at which the highest rod strikes, on rods that lie there, ±",
        "8 mm ± 5 mm"),

    Key("track", _MAP, "", "for one object; drop and gates are lengths along the track", ""),
    Key("track.incline", reader.INCLINE, "", "of the track, ±", "5 deg ± 0.1 deg", required=True),
    Key("track.rolling_inertia", reader.ROLLING, "0",
        "moment of inertia over m r²: 0 slides, 0.4 ball, 0.5 cylinder", "0.4"),

    Key("drag", _MAP, "", "known air resistance: coefficient or terminal speed", ""),
    Key("drag.coefficient", drag.COEFFICIENT, "", "drag coefficient of a rod, ±", "1.1 ± 0.2"),
    Key("drag.air_density", drag.DENSITY, _said(Drag().air_density, "kg/m^3"),
        "with the coefficient", "1.15 kg/m^3"),
    Key("drag.terminal_speed", drag.TERMINAL_SPEED, "", "of every part of a chain, ±",
        "25 m/s ± 2 m/s"),

    Key("gates", _MAP, "", "photogates; without them only predictions", ""),
    Key("gates.impact", ListOf(), "", "gates of the striking chain", ""),
    Key("gates.free", ListOf(), "", "gates of the free chain, or of an object", ""),
    *(
        key
        for side in ("impact", "free")
        for key in (
            Key(f"gates.{side}.{EACH}.channel", Whole(0, GATES - 1), "", "input of the board", "3",
                required=True),
            Key(f"gates.{side}.{EACH}.height", gates.HEIGHT, "",
                "height of the beam above the zero of `drop`", "25 mm", required=True),
        )
    ),
    Key("gates.height_uncertainty", gates.HEIGHT_UNCERTAINTY, "0.3 mm",
        "standard uncertainty of a beam above its post's zero", "0.2 mm"),
    Key("gates.datum_uncertainty", gates.HEIGHT_UNCERTAINTY, _said(DATUM_U, "mm"),
        "standard uncertainty of a post's zero", "0.1 mm"),
    Key("reference", reader.REFERENCE, "0.1 ppm",
        "relative standard uncertainty of a wired 1 Hz reference", "0.5 ppm"),

    Key("release", _MAP, "", "the actuator", ""),
    Key("release.channel", Whole(0, RELEASES - 1), str(_PULSE.channel), "output of the board", "1"),
    Key("release.pulse", settings.PULSE, _said(_PULSE.pulse, "ms"), "length of the pulse", "60 ms"),
    Key("plan", _MAP, "", "the runs", ""),
    Key("plan.incline", OneOrMore(settings.INCLINE), "0 deg", "inclines of the surface", "40 deg"),
    Key("plan.repeats", Whole(1, settings.MOST_REPEATS), str(_PLAN.repeats),
        "runs at each incline", "12"),
    Key("plan.order", OneOf(("ABBA", "alternate", "fixed")), _PLAN.order,
        "order in which the chains strike", "alternate"),
    Key("plan.randomize", OneOf(("none", "incline", "all")), _PLAN.randomize,
        "shuffle the inclines, or all runs", "incline"),
    Key("plan.seed", Whole(0, settings.LARGEST_SEED), str(_PLAN.seed), "of that shuffle", "7"),
    Key("plan.settle", settings.SETTLE, _said(_PLAN.settle, "s"),
        "wait before each release, for chains to come to rest", "20 s"),
    Key("accept", _MAP, "", "limits beyond which a run is `void`", ""),
    Key("accept.release_skew", settings.RELEASE_SKEW, _said(_ACCEPT.release_skew, "ms"),
        "between the two releases", "3 ms"),
    Key("accept.missed_edges", settings.SHARE_OF_EDGES, _said(_ACCEPT.missed_edges, "%"),
        "of all expected edges", "2 %"),
    Key("accept.unexplained_edges", settings.SHARE_OF_EDGES,
        _said(_ACCEPT.unexplained_edges, "%"),
        "of all received edges, those of no rod and no known disturbance", "5 %"),

    Key("priors", _MAP, "", "assumed standard uncertainties of what is not measured", ""),
    *(
        Key(f"priors.{name}", row.accepted, _said(getattr(Priors(), name), row.accepted.unit),
            row.words, _said(getattr(Priors(), name), row.accepted.unit))
        for name, row in PRIORS.items()
    ),
)  # fmt: skip
"""In the order in which a file is written."""


def page() -> str:
    """Write the reference as Markdown."""
    lines = [
        "# The protocol file",
        "",
        "What may stand in a protocol? One YAML file describes one experiment. `rig check FILE`",
        "reads it, `rig check --keys` prints this page, and `rig check --schema` a JSON Schema for",
        "editors. Examples are in [protocols](../protocols).",
        "",
        "Quantities have a unit (`48.5 mm`) and may have a standard uncertainty (`180 mm ± 2 mm`,",
        "`9.8124(2) m/s^2`); *±* marks where. `*` is the name of a chain, `[]` an item of a list.",
        "**Bold** keys are required within their section.",
        "",
        "| key | accepted | without it | meaning | example |",
        "|---|---|---|---|---|",
    ]
    for key in KEYS:
        name = f"**`{key.path}`**" if key.required else f"`{key.path}`"
        example = f"`{key.example}`" if key.example else ""
        lines.append(f"| {name} | {key.accepted} | {key.default} | {key.meaning} | {example} |")
    lines += [
        "",
        "## Where the defaults of `priors` come from",
        "",
        "| key | source |",
        "|---|---|",
    ]
    lines += [f"| `{name}` | {row.source} |" for name, row in PRIORS.items()]
    return "\n".join(lines) + "\n"


def schema() -> dict[str, Any]:
    """Make the JSON Schema (draft 2020-12) of a protocol file."""
    found = _object("", "A protocol of falling chains and photogates")
    found["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    return found


def _object(prefix: str, description: str) -> dict[str, Any]:
    """Schema of the mapping at a path."""
    start = f"{prefix}." if prefix else ""
    inner = {key.path[len(start) :]: key for key in KEYS if key.path.startswith(start)}
    own = {name: key for name, key in inner.items() if "." not in name}
    found: dict[str, Any] = {"type": "object", "description": description}
    if any(name.startswith(f"{ANY}.") for name in inner):
        found["additionalProperties"] = _object(f"{start}{ANY}", "a chain")
        return found | {"minProperties": 1, "maxProperties": 2}
    found["properties"] = {name: _one(key) for name, key in own.items()}
    found["additionalProperties"] = False
    required = [name for name, key in own.items() if key.required]
    # What a chain is like another one in, it need not say again.
    return found | ({"required": required} if required and not prefix.endswith(ANY) else {})


def _one(key: Key) -> dict[str, Any]:
    said = f"{key.meaning}; {key.accepted}" if not isinstance(key.accepted, Mapped) else key.meaning
    if key.default:
        said += f"; without it: {key.default}"
    examples = {"examples": [key.example]} if key.example else {}
    return {"description": said, **_kind(key.path, key.accepted), **examples}


def _kind(path: str, accepted: Accepted) -> dict[str, Any]:
    """Schema of what a key may be."""
    found: dict[str, Any]
    match accepted:
        case Range():
            found = _quantity(accepted)
        case Whole(low, high):
            found = {"type": "integer", "minimum": low, "maximum": high}
        case OneOf(words):
            # YAML reads a bare true as a boolean.
            plain = dict.fromkeys(BOOLEANS[word] for word in words if word in BOOLEANS)
            found = {"enum": [*words, *plain]}
        case OneOrMore(each):
            one = _quantity(each)
            found = {"anyOf": [one, {"type": "array", "items": one, "minItems": 1}]}
        case Either(kinds):
            found = {"anyOf": [_kind(path, kind) for kind in kinds]}
        case ListOf(each):
            items = _object(f"{path}.{EACH}", "an item") if each is None else _quantity(each)
            found = {"type": "array", "items": items, "minItems": 1}
        case Mapped():
            found = _object(path, "")
            del found["description"]
        case Text():
            found = {"type": "string"}
    return found


def _quantity(accepted: Range) -> dict[str, Any]:
    """Schema of a quantity: a text with a unit, or a number where none is needed."""
    kinds = ["string", "number"] if accepted.dimension is Dimension.NUMBER else ["string"]
    return {"type": kinds}
