"""What a simpler instrument or a simpler fit makes of the same edges."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from rig.arrays import Array
    from rig.protocol.protocol import Gate, Protocol, Side
    from rig.records import Drop


_FLICKER = 0.3e-3  # s: no rod is that fast


class TimerReading(NamedTuple):
    """What a plain timer with two gates a side reads, SI units."""

    separation_m: float
    speed_m_s: float


class _Passage(NamedTuple):
    """A top rod at the lower gate: when, how high, how fast."""

    time: float
    height: float
    speed: float


def two_gate_timer(protocol: Protocol, drop: Drop, hz: float) -> TimerReading | None:
    """Time the last passage at two gates of each side, the lowest but one that bounces reach.

    Between two gates a rod's mean speed is that at half time; from the lower one it falls freely.
    The timer knows no rods: the last thing that darkened a beam is the top one.

    Returns
    -------
    TimerReading or None
        Nothing where a gate saw nothing or the passages come in the wrong order.
    """
    struck = _passage(protocol, drop, hz, "impact")
    free = _passage(protocol, drop, hz, "free")
    if struck is None or free is None:
        return None
    gravity = protocol.gravity.value
    speed = math.sqrt(struck.speed**2 + 2.0 * gravity * struck.height)
    since = struck.time + 2.0 * struck.height / (struck.speed + speed) - free.time
    height = free.height - (free.speed + 0.5 * gravity * since) * since
    return TimerReading(height, speed)


def _passage(protocol: Protocol, drop: Drop, hz: float, side: Side) -> _Passage | None:
    gates = sorted(protocol.gates.on(side), key=lambda gate: gate.height)[1:3]
    if len(gates) < 2:
        return None
    low, high = (_last(gate, drop, hz) for gate in gates)
    if low is None or high is None or low <= high:
        return None
    fallen, taken = gates[1].height - gates[0].height, low - high
    speed = fallen / taken + 0.5 * protocol.gravity.value * taken
    return _Passage(low, gates[0].height, speed)


def _last(gate: Gate, drop: Drop, hz: float) -> float | None:
    """Return the middle of the last time that a beam was dark, s."""
    edges = [edge for edge in drop.edges if edge.channel == gate.channel]
    if len(edges) < 2:
        return None
    return 0.5 * (edges[-1].tick + edges[-2].tick) / hz


def line_fit(protocol: Protocol, drop: Drop, hz: float) -> TimerReading | None:
    """Fit the top rods' passages at all gates: they know no rods but the last.

    The free chain is a parabola with the place's gravity. Of the other only gates below the last
    rod gap count, where nothing strikes any more; there it is a parabola too.

    Returns
    -------
    TimerReading or None
        Nothing where fewer than two gates of a side saw a passage.
    """
    pitch = min(
        high - low
        for one in protocol.chains.values()
        for low, high in zip(one.chain.heights, one.chain.heights[1:], strict=False)
    )
    struck = _passages(protocol, drop, hz, "impact", pitch)
    free = _passages(protocol, drop, hz, "free", np.inf)
    if struck is None or free is None:
        return None
    gravity = protocol.gravity.value
    height, speed, since = _parabola(*struck, gravity)
    end = float(np.sqrt(max(0.0, speed**2 + 2.0 * gravity * height)))
    hit = since + 2.0 * height / (speed + end)
    at, fast, then = _parabola(*free, gravity)
    left = hit - then
    return TimerReading(at - (fast + 0.5 * gravity * left) * left, end)


def _passages(
    protocol: Protocol, drop: Drop, hz: float, side: Side, highest: float
) -> tuple[Array, Array] | None:
    """Times and heights of the top rod's passages.

    It is the last at every beam but the lowest, where rods bounce: there it is the next after
    that of the beam above.
    """
    gates = sorted(protocol.gates.on(side), key=lambda gate: -gate.height)
    found: list[tuple[float, float]] = []
    for gate in gates:
        dark = _dark(gate, drop, hz)
        if gate is gates[-1] and found:
            dark = [time for time in dark if time > found[-1][0]][:1]
        if dark and gate.height < highest:
            found.append((dark[-1], gate.height))
    if len(found) < 2:
        return None
    times, heights = np.array(found).T
    return times, heights


def _dark(gate: Gate, drop: Drop, hz: float) -> list[float]:
    """Middles of the times that a beam was dark, flickers left out, s."""
    edges = [(edge.tick / hz, edge.blocked) for edge in drop.edges if edge.channel == gate.channel]
    return [
        0.5 * (begin + end)
        for (begin, dark), (end, still) in pairwise(edges)
        if dark and not still and end - begin > _FLICKER
    ]


def _parabola(times: Array, heights: Array, gravity: float) -> tuple[float, float, float]:
    """Height and speed at the last passage, and when that was, by a straight line in h + gt²/2."""
    last = float(times.max())
    since = times - last
    slope, height = np.polynomial.polynomial.polyfit(since, heights + 0.5 * gravity * since**2, 1)[
        ::-1
    ]
    return float(height), -float(slope), last
