"""A drop to scale, as the page moves it: what stands still, and where what falls is when."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rig.tui.indicators import Indicators
from rig.tui.scale import drawing, outline

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.protocol.protocol import Protocol, Run
    from rig.tui.motion import ChainFall

_MOMENTS = 150
_AFTER_S = 0.02
_STILL = {"border": "post", "foreground": "beam"}


def moving_picture(protocol: Protocol, run: Run, falls: Sequence[ChainFall]) -> dict[str, Any]:
    """Return a drop from its release on, in mm and s; before it fell, what hangs there.

    Parameters
    ----------
    falls
        As `rig.tui.motion.motions` gives them.
    """
    fell = any(fall.times.size for fall in falls)
    end_s = max(fall.end_s for fall in falls) + _AFTER_S if fell else 0.0
    times = np.linspace(0.0, end_s, _MOMENTS if fell else 1)
    still = drawing(protocol, run, falls, Indicators(), 0.0)
    bodies = []
    for middle, fall in zip(still.middles, falls, strict=True):
        radius, rods = outline(protocol, fall.rods, still.top_m - still.bottom_m)
        expected = [fall.expected(time) for time in times]
        measured = [fall.measured(time) for time in times]
        seen = [
            model if height is None and fall.times.size else height
            for height, model in zip(measured, expected, strict=True)
        ]
        bodies.append(
            {
                "role": fall.role if len(falls) > 1 else "impact",
                "words": _words(protocol, run, fall),
                "x": round(1e3 * middle),
                "radius": 1e3 * radius,
                "rods": [_mm(rod) for rod in rods],
                "top": _mm([fall.length])[0],
                "lies": fall.lies,
                "model": _mm(expected),
                "seen": _mm(seen),
                "known": [height is not None for height in measured].count(False),
                "last": int(np.searchsorted(times, fall.times[-1])) - 1 if fall.times.size else 0,
            }
        )
    return {
        "width": round(1e3 * still.width_m),
        "bottom": round(1e3 * still.bottom_m),
        "top": round(1e3 * still.top_m),
        "end_s": round(end_s, 4),
        "still": [
            [_STILL[stroke.color], *_mm(stroke[:4])]
            for stroke in still.strokes
            if stroke.color in _STILL
        ],
        "lamps": [
            [lamp.channel, *_mm([lamp.x, lamp.z])]
            for lamp in sorted(still.lamps, key=lambda lamp: (lamp.x, -lamp.z))
        ],
        "bodies": bodies,
    }


def _words(protocol: Protocol, run: Run, fall: ChainFall) -> str:
    """Name what falls, in the words of the scene."""
    words = protocol.vocabulary
    if not words.two_sides:
        return words.body
    return f"{run.impact} strikes" if fall.role == "impact" else f"{run.free} falls freely"


def _mm(lengths_m: Sequence[float | None]) -> list[float | None]:
    return [None if length is None else round(1e3 * length, 1) for length in lengths_m]
