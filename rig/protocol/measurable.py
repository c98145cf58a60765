"""Checks whether a drop can be measured, before anything is set up.

The rig drops chains from rest; the length of a recording is limited, as is a board's number of
inputs and outputs.
"""

import math
from collections.abc import Collection

from rig.boards import BOARDS, LONGEST_RECORD_MS, Capabilities
from rig.errors import InputError, Problem
from rig.protocol.protocol import SIDES, Gate, Protocol
from rig.protocol.yamltree import load, place_of
from rig.reasons import make_reason, rig_error

LEAST_RECORD_MS = 1500
"""Length of a recording that suits most labs, ms."""
_SURE = 3.0  # standard uncertainties by which inputs may prolong a fall
_AIR = 1.5  # factor for drag: with a terminal speed of 10 m/s, 25 m take 1.4 times as long
_MARGIN_S = 0.25  # for the release mechanism


def longest_fall(protocol: Protocol) -> float:
    """Return the longest time from the release to the last edge within the uncertainties, s.

    This is the time of free fall √(2 h/g): an impact only makes a chain faster, as α > 0.
    """
    return max(map(_longest_fall, protocol.settings.values()))


def _longest_fall(protocol: Protocol) -> float:
    chains, gates, gravity = protocol.chains.values(), protocol.gates, protocol.gravity
    lowest = min((gate.height for gate in gates.gates), default=0.0)
    reach = max(
        rods.chain.length + max(rods.widths) / 2.0 + _SURE * rods.position_u for rods in chains
    )
    u = math.hypot(protocol.drop.u, gates.height_u, gates.datum_u)
    weakest = max(gravity.value - _SURE * gravity.u, gravity.value / 2.0)
    return math.sqrt(2.0 * (protocol.drop.value + reach + _SURE * u - lowest) / weakest)


def record_ms(protocol: Protocol) -> int:
    """Return the recording time of a drop after the release, ms; at least `LEAST_RECORD_MS`.

    The chain may hang until the pulse ends, and drag prolongs the fall. No board records more than
    `LONGEST_RECORD_MS`.
    """
    fall_s, skew_s = _AIR * longest_fall(protocol), protocol.accept.release_skew
    wanted_s = fall_s + protocol.release.pulse + skew_s + _MARGIN_S
    return max(LEAST_RECORD_MS, math.ceil(wanted_s * 1e3))


def with_channels(protocol: Protocol, channels: Collection[int]) -> Protocol:
    """Return a scene with only the gates at these channels."""
    return protocol.with_gates(gate for gate in protocol.gates.gates if gate.channel in channels)


def check_gates(protocol: Protocol) -> None:
    """Raise an error for a protocol without gates.

    Raises
    ------
    InputError
        Nothing can be measured.
    """
    if not protocol.gates:
        raise rig_error("no_gates", source=protocol.source)


def check_released(protocol: Protocol) -> None:
    """Raise an error for chains that are thrown, as no rig does that.

    Raises
    ------
    InputError
        The chains have an initial speed.
    """
    if protocol.thrown:
        body = protocol.vocabulary.body
        raise rig_error("not_released", source=protocol.source, body=body)


def check_measurable(protocol: Protocol) -> None:
    """Raise an error for a protocol that can only be predicted.

    Raises
    ------
    InputError
        See `check_gates` and `check_released`.
    """
    check_gates(protocol)
    check_released(protocol)


def too_long(protocol: Protocol) -> Problem | None:
    """Return the problem of a fall longer than any board's recording; `None` otherwise."""
    if record_ms(protocol) <= LONGEST_RECORD_MS:
        return None
    times = {"fall_s": longest_fall(protocol), "needed_s": record_ms(protocol) / 1e3}
    why = make_reason("recording_too_long", **times, limit_s=LONGEST_RECORD_MS / 1e3)
    return _locate(protocol, why.text, "drop")


def _locate(protocol: Protocol, message: str, *path: str | int) -> Problem:
    """Return a problem at the place of a key path in the file."""
    place = place_of(load(protocol.text, protocol.source), *path)
    steps = (f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
    key = "".join(steps).removeprefix(".")
    return Problem(protocol.source, *place, key, message)


def passing_rods(protocol: Protocol, gate: Gate) -> dict[str, int]:
    """Return the number of rods of each chain that hang above a gate and so pass it."""
    drop = protocol.drop.value
    return {
        name: sum(drop + height > gate.height for height in rods.chain.heights)
        for name, rods in protocol.chains.items()
    }


def most_edges(protocol: Protocol) -> int:
    """Return the largest number of edges of a drop, over the chains that may hang on each side."""
    return max(map(_most_edges, protocol.settings.values()))


def _most_edges(protocol: Protocol) -> int:
    sides = map(protocol.gates.on, SIDES)
    passing = ([passing_rods(protocol, gate) for gate in gates] for gates in sides)
    most = (max(sum(rods[name] for rods in side) for name in protocol.chains) for side in passing)
    return 2 * sum(most)


def lacking(protocol: Protocol, board: Capabilities) -> list[Problem]:
    """Return problems for features that a protocol needs and a board lacks, in file order."""
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
        for n, gate in enumerate(protocol.gates.on(side)):
            path = ("gates", side, n, "channel")
            want("gates", gate.channel + 1, str(gate.channel), has, *path)
    return sorted(problems)


def check_recordable(protocol: Protocol, board: Capabilities | None = None) -> None:
    """Raise an error for a protocol whose drops this board, or no board, can record.

    Imported recordings of other timers have no such limits; they need only be measurable.

    Raises
    ------
    InputError
        With every problem.
    """
    check_measurable(protocol)
    problems = [too_long(protocol), *(lacking(protocol, board) if board else ())]
    if any(problems):
        raise InputError(problems=filter(None, problems))
