"""Reader of protocol files: returns a checked `Protocol`, or reports all problems at once.

`rig.protocol.keys` has the rules for single keys, `rig.protocol.checks` those between keys.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.errors import InputError, Problem
from rig.files import read_input
from rig.protocol import protocol as scene
from rig.protocol.chains import read_chains
from rig.protocol.checks import check_scene
from rig.protocol.fields import Faults, Section, read_value
from rig.protocol.keys import Plain
from rig.protocol.site import gravity_at
from rig.protocol.variants import vary
from rig.protocol.yamltree import Node, load, place_at
from rig.reasons import errors_become, rig_error
from rig.units import Quantity

if TYPE_CHECKING:
    import os

    from rig.model.surface import Surface

MAX_BYTES = 1_000_000


def read(path: str | os.PathLike[str]) -> scene.Protocol:
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
    with (
        errors_become("protocol_unreadable", OSError, ValueError, path=source),  # a zero byte
        errors_become("protocol_absent", FileNotFoundError, path=source),
    ):
        data = read_input(path, MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        raise rig_error("protocol_too_large", path=source, limit=MAX_BYTES)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8")
        place = place_at(before, len(before))
        problem = Problem(source, *place, "", "not UTF-8 text; save the file as UTF-8")
        raise InputError(problems=[problem]) from None
    return parse(text, source)


def parse(text: str, source: str = "protocol", *, kept: bool = False) -> scene.Protocol:
    """Read a protocol from its text.

    Parameters
    ----------
    text
        The file's text.
    source
        Its name, for messages and for the session.
    kept
        Whether the text is stored in a session and cannot change any more: then an order of turns,
        which has no meaning for a single chain, is ignored.

    Returns
    -------
    Protocol
        Checked, with `text` and `source` in it.

    Raises
    ------
    InputError
        The text has problems; lists all.
    """
    if len(text) > MAX_BYTES:
        raise rig_error("protocol_too_large", path=source, limit=MAX_BYTES)
    root, faults = load(text, source), Faults(source)
    scenes = {at: _read_scene(root, text, faults, kept=kept) for at in vary(root, faults)}
    if faults.problems:
        raise InputError(problems=faults.problems.values())
    variants = {at: each for at, each in scenes.items() if each}
    first = next(iter(variants.values()))
    return first if "" in variants else replace(first, variants=variants)


def _read_scene(root: Node, text: str, faults: Faults, *, kept: bool) -> scene.Protocol | None:
    """Return the protocol of a tree; `None` if it is faulty."""
    top = read_value(Plain.MAPPED, root, "", "", faults)
    if top is None:
        return None
    chains, source = read_chains(top), faults.source
    check_scene(top, chains, kept=kept)
    if faults.problems:
        return None
    track = top["track"] and scene.InclinedTrack(**_arguments(top["track"], incline="incline_deg"))
    site, contact = top["site"], top["contact"]
    gravity = gravity_at(site["latitude"], site["height"]) if site else top["gravity"]
    return scene.Protocol(
        title=top["title"] if "title" in top else Path(source).stem,
        chains={name: chain for name, chain in chains.items() if chain is not None},
        gravity=gravity if track is None else track.along(gravity),
        drop=top["drop"],
        surface=top["surface"] and _surface(top["surface"]),
        track=track,
        gates=_gates(top["gates"]) if top["gates"] else scene.Gates(),
        release=scene.ReleasePulse(**_arguments(top["release"])),
        plan=scene.Plan(**_arguments(top["plan"], "vary", incline="inclines")),
        accept=scene.Accept(**_arguments(top["accept"])),
        initial_speed=top["initial_speed"],
        drag=top["drag"] and scene.Drag(**_arguments(top["drag"])),
        contact=scene.Contact(contact["level"], contact["strike"], contact["datum"] == "board")
        if contact
        else scene.Contact(),
        reference_u=top["reference"],
        priors=scene.Priors(**_arguments(top["priors"])),
        blind=top["blind"],
        notes=top["notes"] or "",
        text=text,
        source=source,
    )


def _arguments(section: Section | None, *without: str, **names: str) -> dict[str, Any]:
    """Return the other values of a section by name; `names` maps keys to attribute names."""
    values = section.values.items() if section else ()
    return {names.get(name, name): value for name, value in values if name not in without}


def _surface(section: Section) -> Surface:
    """Return the surface; its restitution is 0 if not given, as no chain then needs it."""
    from rig.model.surface import Pile, Surface  # noqa: PLC0415 - only where something is struck

    restitution, pile = section["restitution"] or Quantity(0.0), section["pile"]
    softer = pile and Pile(pile["below"], pile["restitution"])
    return Surface(restitution, section["friction"], softer)


def _gates(section: Section) -> scene.Gates:
    """Return the gates, impact side first, in the order of the file."""
    sides = ((side, gate) for side in scene.SIDES for gate in section[side] or ())
    gates = (scene.Gate(gate["channel"], gate["height"], side) for side, gate in sides)
    return scene.Gates(tuple(gates), section["height_uncertainty"], section["datum_uncertainty"])
