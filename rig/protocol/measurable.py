"""What keeps a drop from being measured, said before anything is hung.

The rig drops chains from rest, in air as it is; a recording ends at some time; a board has so many
inputs and outputs.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

from rig.boards import BOARDS, LONGEST_RECORD_MS, Capabilities
from rig.errors import InputError, Problem
from rig.protocol.protocol import AT_REST, SIDES, Gate, Gates, Protocol
from rig.protocol.yamltree import load, place_of
from rig.reasons import make_error

LEAST_RECORD_MS = 1500
"""Long enough for the drops of most labs, and then the same for all."""
_SURE = 3.0  # standard uncertainties by which everything may make a fall longer
_AIR = 1.5  # light rods, with a terminal speed of 10 m/s, take 1.4 times as long for 25 m
_MARGIN_S = 0.25  # for the mechanism that lets go


def longest_fall(protocol: Protocol) -> float:
    """Time from the release to the last edge, if every uncertainty makes it longer, s.

    That of free fall through √(2 h/g): an impact only makes a chain faster, α being above zero.
    """
    chains, gates, gravity = protocol.chains.values(), protocol.gates, protocol.gravity
    lowest = min((gate.height for gate in gates.gates), default=0.0) if gates else 0.0
    reach = max(
        rods.chain.length + max(rods.widths) / 2.0 + _SURE * rods.position_u for rods in chains
    )
    u = math.hypot(protocol.drop.u, *((gates.height_u, gates.datum_u) if gates else ()))
    weakest = max(gravity.value - _SURE * gravity.u, gravity.value / 2.0)
    return math.sqrt(2.0 * (protocol.drop.value + reach + _SURE * u - lowest) / weakest)


def record_ms(protocol: Protocol) -> int:
    """How long after the release a drop is recorded, ms; at least `LEAST_RECORD_MS`.

    The chain may hang until the pulse ends, and the air makes the fall longer. More than
    `LONGEST_RECORD_MS` is too much for any board.
    """
    fall_s, skew_s = _AIR * longest_fall(protocol), protocol.accept.release_skew
    wanted_s = fall_s + protocol.release.pulse + skew_s + _MARGIN_S
    return max(LEAST_RECORD_MS, math.ceil(wanted_s * 1e3))


def unmeasurable(protocol: Protocol) -> list[str]:
    """Return the reasons why a drop can only be predicted; none if it can be measured."""
    if protocol.initial_speed == AT_REST:
        return []
    return [f"initial_speed: the rig releases {protocol.vocabulary.body} from rest"]


def with_gates(protocol: Protocol, channels: Collection[int]) -> Protocol:
    """Return a scene with those of its gates alone that are at some channels."""
    if protocol.gates is None:
        return protocol
    gates = tuple(gate for gate in protocol.gates.gates if gate.channel in channels)
    return replace(protocol, gates=replace(protocol.gates, gates=gates))


def check_gates(protocol: Protocol) -> Gates:
    """Return the gates of a scene.

    Raises
    ------
    InputError
        It has none, so nothing can be measured.
    """
    if protocol.gates is None or not protocol.gates.gates:
        raise make_error(InputError, "no_gates", source=protocol.source)
    return protocol.gates


def check_measurable(protocol: Protocol) -> None:
    """Refuse a protocol that can only be predicted.

    Raises
    ------
    InputError
        With every reason.
    """
    if reasons := "; ".join(unmeasurable(protocol)):
        hint = "rig predict shows the prediction; leave these keys out to measure"
        raise InputError(f"{protocol.source}: prediction only, by {reasons}", hint)


def too_long(protocol: Protocol) -> Problem | None:
    """Say that a fall takes more time than any board can record, when it does."""
    if record_ms(protocol) <= LONGEST_RECORD_MS:
        return None
    message = (
        f"from here a drop takes up to {longest_fall(protocol):.3g} s and needs a recording of "
        f"{record_ms(protocol) / 1e3:.3g} s; boards record for at most "
        f"{LONGEST_RECORD_MS / 1e3:g} s: shorten the drop"
    )
    return _locate(protocol, message, "drop")


def _locate(protocol: Protocol, message: str, *path: str | int) -> Problem:
    """Return a problem at the place of the file that a path leads to."""
    place = place_of(load(protocol.text, protocol.source), *path)
    steps = (f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
    key = "".join(steps).removeprefix(".")
    return Problem(protocol.source, place.line, place.column, key, message)


def passing_rods(protocol: Protocol, gate: Gate) -> dict[str, int]:
    """Count for each chain the rods that pass a gate: those that hang above it."""
    drop = protocol.drop.value
    return {
        name: sum(drop + height > gate.height for height in rods.chain.heights)
        for name, rods in protocol.chains.items()
    }


def most_edges(protocol: Protocol) -> int:
    """Count the edges of a drop whose rods all pass, with the chain on each side that has more."""
    sides = map(protocol.gates.on, SIDES) if protocol.gates else ()
    passing = ([passing_rods(protocol, gate) for gate in gates] for gates in sides)
    most = (max(sum(rods[name] for rods in side) for name in protocol.chains) for side in passing)
    return 2 * sum(most)


def lacking(protocol: Protocol, board: Capabilities) -> list[Problem]:
    """Say what a protocol wants of a board that it does not have, in the order of the file."""
    problems = []

    def want(kind: str, least: float, value: str, has: str, *path: str | int) -> None:
        if getattr(board, kind) < least:
            able = [timer.one for timer in BOARDS.values() if getattr(timer, kind) >= least]
            advice = f", or use {' or '.join(able)}" if able else ""
            message = f"found {value}; the board ({board.name}) has {has}: change this{advice}"
            problems.append(_locate(protocol, message, *path))

    release = protocol.release
    has = f"releases 0 to {board.releases - 1}"
    want("releases", release.channel + 1, str(release.channel), has, "release", "channel")
    has = f"pulses of at most {board.longest_pulse * 1e3:g} ms"
    want("longest_pulse", release.pulse, f"{release.pulse * 1e3:g} ms", has, "release", "pulse")
    edges = most_edges(protocol)
    want("most_edges", edges, f"{edges} edges a drop", f"memory for {board.events}", "gates")
    has = f"gates 0 to {board.gates - 1}"
    for side in SIDES:
        for n, gate in enumerate(protocol.gates.on(side) if protocol.gates else ()):
            path = ("gates", side, n, "channel")
            want("gates", gate.channel + 1, str(gate.channel), has, *path)
    return sorted(problems)


def check_recordable(protocol: Protocol, board: Capabilities | None = None) -> None:
    """Refuse a protocol whose drops no board, or not this one, can make and record.

    Other timers have no such limits: what they recorded need only be measurable.

    Raises
    ------
    InputError
        With every problem.
    """
    check_measurable(protocol)
    problems = [too_long(protocol), *(lacking(protocol, board) if board else ())]
    if any(problems):
        raise InputError(problems=filter(None, problems))
