"""A drop to scale, moment by moment, as the terminal draws it."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rig.protocol.protocol import Protocol, Run
from rig.tui.motion import ChainFall
from rig.tui.scale import drawing

_MOMENTS = 60  # between which the page moves
_AFTER_S = 0.02


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
    first, *_ = drawings = [drawing(protocol, run, falls, (), time) for time in times]
    names = [protocol.vocabulary.body]
    if protocol.vocabulary.two_sides:
        names = [f"{run.impact} strikes", f"{run.free} falls freely"]
    lamps = sorted(first.lamps, key=lambda lamp: (lamp.x, -lamp.z))
    return {
        "end_s": end_s,
        "box": _mm(first.width_m, first.bottom_m, first.top_m),
        "names": [*zip(_mm(*first.middles), names, strict=False)],
        "lamps": [[lamp.channel, *_mm(lamp.x, lamp.z)] for lamp in lamps],
        "moments": [
            [[*_mm(*ends), color] for *ends, color in moment.strokes] for moment in drawings
        ],
        "apart_cm": [moment.apart_m and round(1e2 * moment.apart_m, 1) for moment in drawings],
    }


def _mm(*lengths_m: float) -> list[int]:
    return [round(1e3 * length) for length in lengths_m]
