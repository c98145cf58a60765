"""From a protocol file to a checked `Protocol`, or to every problem in it at once.

What a file does not name is not loaded either: the readers of its parts are imported where used.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import InputError
from rig.files import read_input
from rig.protocol import fields
from rig.protocol.chains import read_chains
from rig.protocol.fields import FieldFaults, Range, Section
from rig.protocol.protocol import (
    AT_REST,
    PPS_U,
    STANDARD_GRAVITY,
    Accept,
    Contact,
    InclinedTrack,
    Plan,
    Priors,
    Protocol,
    ReleasePulse,
)
from rig.protocol.yamltree import Mapping, Place, ScalarNode, load
from rig.units import Dimension, Quantity

if TYPE_CHECKING:
    import os

    from rig.model.surface import Surface
    from rig.protocol.fields import Converter
    from rig.protocol.protocol import Drag, Gates, RodChain
    from rig.protocol.yamltree import Node

MAX_BYTES = 1_000_000
KEYS = (
    "protocol", "title", "chains", "surface", "track", "drop", "initial_speed", "gravity", "site",
    "drag", "contact", "gates", "priors", "reference", "release", "plan", "accept", "blind",
    "notes",
)  # fmt: skip
DATUMS = ("contact", "board")
DROP = Range(Dimension.LENGTH, 0.0, 100.0, "m")
INITIAL_SPEED = Range(Dimension.SPEED, 0.0, 1000.0, "m/s")
CONTACT = Range(Dimension.LENGTH, -0.1, 0.1, "mm")
GRAVITY = Range(Dimension.ACCELERATION, 1e-3, 1000.0, "m/s^2")
LATITUDE = Range(Dimension.ANGLE, -90.0, 90.0, "deg")
HEIGHT = Range(Dimension.LENGTH, -500.0, 9000.0, "m")
INCLINE = Range(Dimension.ANGLE, 0.1, 90.0, "deg")
ROLLING = Range(Dimension.NUMBER, 0.0, 1.0, "1")
REFERENCE = Range(Dimension.NUMBER, 0.0, 1e-3, "ppm")


def read(path: str | os.PathLike[str]) -> Protocol:
    """Read a protocol file.

    Parameters
    ----------
    path
        The file; UTF-8, at most `MAX_BYTES`.

    Returns
    -------
    Protocol
        Checked; lengths in metres, times in seconds, angles in degrees.

    Raises
    ------
    InputError
        If the file cannot be read, or with every problem found in it.
    """
    source = str(path)
    try:
        data = read_input(path, MAX_BYTES + 1)
    except FileNotFoundError:
        hint = "rig new FILE.yaml writes a protocol; ready protocols are in protocols/"
        raise InputError(f"{source}: there is no such file", hint) from None
    except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{source!r}: cannot be read: {reason}") from None
    if len(data) > MAX_BYTES:
        raise InputError(f"{source}: larger than {MAX_BYTES} bytes; a protocol is a text file")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line = before.count(b"\n") + 1
        column = len(before[before.rfind(b"\n") + 1 :].decode("utf-8")) + 1
        faults = FieldFaults(source)
        faults.add(Place(line, column), "", "not UTF-8 text; save the file as UTF-8")
        raise InputError(problems=faults.problems.values()) from None
    return parse(text, source)


def parse(text: str, source: str = "protocol", *, kept: bool = False) -> Protocol:
    """Read a protocol from its text.

    Parameters
    ----------
    text
        The file's text.
    source
        Its name, for messages and for the session.
    kept
        Whether a session keeps this text, which cannot be changed any more: an order of turns,
        which means nothing to a single chain, is passed over there.

    Returns
    -------
    Protocol
        Checked, with `text` and `source` in it.

    Raises
    ------
    InputError
        With every problem found.
    """
    if len(text) > MAX_BYTES:
        raise InputError(f"{source}: larger than {MAX_BYTES} bytes; a protocol is a text file")
    faults = FieldFaults(source)
    protocol = _protocol(load(text, source), faults, text, kept=kept)
    if faults.problems or protocol is None:
        raise InputError(problems=faults.problems.values())
    return protocol


def _protocol(node: Node, faults: FieldFaults, text: str, *, kept: bool) -> Protocol | None:
    """Read the root mapping; ``None`` (and faults) if anything is wrong."""
    root = fields.mapping(node, "", faults)
    if root is None:
        return None
    top = Section(root, "", faults, KEYS)
    top.take("protocol", _version, required="1")
    title = top.take("title", fields.string, Path(faults.source).stem)
    top.take("notes", fields.string, "")
    gravity = _gravity(top)
    has_surface, has_gates = "surface" in top, "gates" in top
    chains = top.take(
        "chains",
        _chains(seen_by_gates=has_gates, struck=has_surface),
        required="{A: {rods: 25, …}}",
    )
    count = _count(top.values.get("chains"))
    if not has_surface and count > 1:
        message = f"found {count} chains; without a surface one is accepted"
        top.fault("chains", message)
    surface = _surface(top, chains) if has_surface else None
    example = "180 mm ± 2 mm" if has_surface or has_gates else ""
    drop = top.take("drop", fields.quantity(DROP), Quantity(0.0), required=example)
    start = top.take("initial_speed", fields.quantity(INITIAL_SPEED), AT_REST)
    track = top.take("track", _track(chains, struck=has_surface))
    drag = _drag(top, chains) if "drag" in top else None
    contact = top.take("contact", _contact(chains, struck=has_surface), Contact())
    reference = top.take("reference", fields.exact(REFERENCE), PPS_U)
    release, plan, accept = _settings(top, turns=kept or count > 1)
    blind = top.take("blind", fields.boolean, default=False)
    gates = _gates(top, chains, drop, contact, plan) if has_gates else None
    priors = top.take("priors", _priors, Priors())
    if title is None or chains is None or gravity is None or drop is None:
        return None
    if release is None or plan is None or accept is None or start is None or reference is None:
        return None
    if priors is None or contact is None:
        return None
    return Protocol(
        title=title,
        chains=chains,
        gravity=gravity if track is None else track.along(gravity),
        drop=drop,
        surface=surface,
        track=track,
        gates=gates,
        release=release,
        plan=plan,
        accept=accept,
        initial_speed=start,
        drag=drag,
        contact=contact,
        reference_u=reference,
        priors=priors,
        blind=bool(blind),
        text=text,
        source=faults.source,
    )


def _version(node: Node, key: str, faults: FieldFaults) -> int | None:
    """Convert the version of the file format: there is one so far."""
    if isinstance(node, ScalarNode) and node.plain and node.text == "1":
        return 1
    faults.add(node.place, key, f"found {node}; accepted: 1")
    return None


def _settings(
    top: Section, *, turns: bool
) -> tuple[ReleasePulse | None, Plan | None, Accept | None]:
    """Read ``release``, ``plan`` and ``accept``."""
    if not any(key in top for key in ("release", "plan", "accept")):
        return ReleasePulse(), Plan(), Accept()
    from rig.protocol.settings import read_settings  # noqa: PLC0415 - see above

    return read_settings(top, turns=turns)


def _priors(node: Node, key: str, faults: FieldFaults) -> Priors | None:
    from rig.protocol.priors import read_priors  # noqa: PLC0415 - see above

    return read_priors(node, key, faults)


def _surface(top: Section, chains: dict[str, RodChain] | None) -> Surface | None:
    from rig.protocol.surface import read_surface  # noqa: PLC0415 - see above

    # Of a chain that could not be read nobody knows whether it gives its α.
    needed = chains is not None and any(rods.chain.alpha is None for rods in chains.values())
    return top.take("surface", read_surface(needs_restitution=needed))


def _drag(top: Section, chains: dict[str, RodChain] | None) -> Drag | None:
    from rig.protocol.drag import read_drag  # noqa: PLC0415 - see above

    return top.take("drag", read_drag(chains.values() if chains else ()))


def _contact(chains: dict[str, RodChain] | None, *, struck: bool) -> Converter[Contact]:
    """Return the converter to where rods strike."""

    @fields.of_keys("datum", "level", "strike")
    def convert(section: Section) -> Contact | None:
        if not struck:
            section.refuse("the scene has no surface; leave contact out")
            return None
        usual = Contact()
        datum = section.take("datum", fields.choice(*DATUMS), DATUMS[0])
        level = section.take("level", fields.quantity(CONTACT), usual.level)
        strike = section.take("strike", fields.quantity(CONTACT), usual.strike)
        if datum == "board" and not _shaped(section, chains):
            return None
        if datum is None or level is None or strike is None:
            return None
        return Contact(level, strike, datum == "board")

    return convert


def _shaped(section: Section, chains: dict[str, RodChain] | None) -> bool:
    """Whether all chains say what tells where their rods touch a board."""
    from rig.protocol.contact import lacking_geometry  # noqa: PLC0415 - see above

    lacking = {name: lacking_geometry(rods) for name, rods in (chains or {}).items()}
    for name, keys in lacking.items():
        if keys:
            message = f"datum: board needs chains.{name}.{keys[0]}; state it"
            section.fault("datum", message)
    return not any(lacking.values())


def _gates(
    top: Section,
    chains: dict[str, RodChain] | None,
    drop: Quantity | None,
    contact: Contact | None,
    plan: Plan | None,
) -> Gates | None:
    from rig.protocol.gates import check_clear, read_gates  # noqa: PLC0415 - see above

    surface, count = "surface" in top, _count(top.values.get("chains"))
    found = read_gates(top.values["gates"], top.faults, surface=surface, chains=count)
    if found is None:
        return None
    gates, located = found
    if chains is not None and drop is not None and "drop" in top:
        inclines = plan.inclines if plan and contact and contact.from_board else ()
        check_clear(located, chains.values(), drop, top.faults, surface=surface, inclines=inclines)
    return gates


def _track(chains: dict[str, RodChain] | None, *, struck: bool) -> Converter[InclinedTrack]:
    """Return the converter to what one object goes down."""

    @fields.of_keys("incline", "rolling_inertia")
    def convert(section: Section) -> InclinedTrack | None:
        if struck or (chains is not None and any(c.chain.rods > 1 for c in chains.values())):
            section.refuse("a track is for one object without a surface; leave track out")
            return None
        incline = section.take("incline", fields.quantity(INCLINE), required="5 deg ± 0.1 deg")
        rolling = section.take("rolling_inertia", fields.exact(ROLLING), 0.0)
        return None if incline is None or rolling is None else InclinedTrack(incline, rolling)

    return convert


def _chains(*, seen_by_gates: bool, struck: bool) -> Converter[dict[str, RodChain]]:
    """Return the converter to the chains."""

    def convert(node: Node, _key: str, faults: FieldFaults) -> dict[str, RodChain] | None:
        return read_chains(node, faults, seen_by_gates=seen_by_gates, struck=struck)

    return convert


def _count(node: Node | None) -> int:
    """Return how many chains the file names, whether or not they can be read."""
    if not isinstance(node, Mapping):
        return 1
    return len({key.text for key, _ in node.entries if isinstance(key, ScalarNode)})


def _gravity(top: Section) -> Quantity | None:
    """Read ``gravity`` or ``site``; a scene without a surface measures it, and needs neither."""
    if "gravity" in top and "site" in top:
        first, second = sorted(("gravity", "site"), key=lambda key: top.keys[key])
        message = f"{first} is also given, on line {top.keys[first].line}; keep one of them"
        top.fault(second, message, at_key=True)
    elif "surface" in top and "gravity" not in top and "site" not in top:
        message = "missing; write gravity: 9.81 m/s^2, or site: {latitude: 61.19 deg, height: 30 m}"
        top.fault("gravity", message)
    site = top.take("site", _site)
    given = top.take("gravity", fields.quantity(GRAVITY), STANDARD_GRAVITY)
    return site if "site" in top and "gravity" not in top else given


@fields.of_keys("latitude", "height")
def _site(section: Section) -> Quantity | None:
    """Convert latitude and height to gravity."""
    latitude = section.take("latitude", fields.exact(LATITUDE), required="61.19 deg")
    height = section.take("height", fields.exact(HEIGHT), required="30 m")
    if latitude is None or height is None:
        return None
    from rig.protocol.site import gravity_at  # noqa: PLC0415 - see above

    return gravity_at(latitude, height)
