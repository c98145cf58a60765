"""The fit that most would make by hand: straight lines and parabolas through the last passages."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from rig.bench.rivals import Reading

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.protocol.scene import Gate, Protocol, Side
    from rig.records import Drop

    Array = NDArray[np.float64]

_FLICKER = 0.3e-3  # s: no rod is that fast


def line_fit(protocol: Protocol, drop: Drop, hz: float) -> Reading | None:
    """Fit the top rods' passages at all gates: they know no rods but the last.

    The free chain is a parabola with the place's gravity. Of the other only gates below the last
    rod gap count, where nothing strikes any more; there it is a parabola too.

    Returns
    -------
    Reading or None
        Nothing where fewer than two gates of a side saw a passage.
    """
    assert protocol.gates is not None
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
    return Reading(at - (fast + 0.5 * gravity * left) * left, end)


def _passages(
    protocol: Protocol, drop: Drop, hz: float, side: Side, highest: float
) -> tuple[Array, Array] | None:
    """Times and heights of the top rod's passages.

    It is the last at every beam but the lowest, where rods bounce: there it is the next after
    that of the beam above.
    """
    assert protocol.gates is not None
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
