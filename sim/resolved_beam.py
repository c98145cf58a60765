"""What a beam sees of a resolved fall: when each rod's samples cross its height."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .beam import Shadow

if TYPE_CHECKING:
    from .resolved.scene import Fall, Numbers


def shadows(fall: Fall, height: float, aside: float, widths: Numbers, reach: float) -> list[Shadow]:
    """Everything that rods darken, also on their way back up; times in s after the release.

    Parameters
    ----------
    fall
        What fell.
    height, aside
        Of the beam, m: above the contact level, and along the rods off the chain's middle line.
    widths
        Across each rod, m; shape (N,).
    reach
        From a rod's middle to its end along the level, m.
    """
    away = aside - fall.sideways
    middle = fall.heights + away * fall.slopes - height
    half = 0.5 * widths * np.sqrt(1.0 + fall.slopes**2)
    # Above zero in the light: the rod passes above or below, or does not reach so far.
    light = np.maximum(np.abs(middle) - half, np.abs(away) - reach)
    dark = light < 0.0
    seen: list[Shadow] = []
    for rod in np.flatnonzero(dark.any(axis=0)):
        turns = np.flatnonzero(np.diff(dark[:, rod]))
        before, after = light[turns, rod], light[turns + 1, rod]
        times = fall.times[turns] + before / (before - after) * (fall.times[1] - fall.times[0])
        # A rod that hangs in the beam, or rests in it when the record ends, has no edge there.
        moments = [*times.tolist(), fall.times[-1]] if dark[-1, rod] else times.tolist()
        if dark[0, rod]:
            moments = moments[1:]
        seen += [
            Shadow(start, end, int(rod))
            for start, end in zip(moments[::2], moments[1::2], strict=True)
        ]
    return sorted(seen)
