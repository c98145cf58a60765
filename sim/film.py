"""Films of resolved falls, as `rig.films` reads them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .resolved.hanging import board_height, hang

if TYPE_CHECKING:
    from .resolved.scene import Chain, Fall

SKIPPED_S, SHOWN_S = 0.02, 0.005
"""Between two moments before the first touch, and after it."""


def film(chain: Chain, fall: Fall) -> dict[str, Any]:
    """Take pictures of a chain's fall onto a board: places to 0.1 mm, times to 10 µs."""
    board = chain.board
    assert board is not None
    begin = fall.frames_s[0]
    before = np.arange(fall.times[0], begin, SKIPPED_S)
    stride = max(1, round(SHOWN_S / float(np.diff(fall.frames_s).min())))
    # Until frames begin rods neither turn nor leave their places in the chain.
    rigid = fall.places[0] + np.zeros((before.size, 1, 1))
    top = np.interp(before, fall.times, fall.heights[:, -1])
    rigid[:, 2] += (top - fall.places[0, 2, -1])[:, None]
    places = np.concatenate([rigid, fall.places[::stride]])
    axes = np.concatenate([fall.axes[:1].repeat(before.size, axis=0), fall.axes[::stride]])
    arms = chain.rods.length / 2.0 * axes
    left_ends, right_ends = ((places + side * arms).transpose(0, 2, 1) for side in (-1.0, 1.0))
    return {
        "incline_deg": round(float(np.degrees(board.incline)), 6),
        "board_m": board_height(chain, board),
        "radii_m": (chain.rods.diameters / 2.0).tolist(),
        "rest_m": hang(chain).strings.rest.T.round(5).tolist(),
        "touched_s": [round(t, 5) if t < np.inf else None for t in fall.touched_s.tolist()],
        "times_s": np.concatenate([before, fall.frames_s[::stride]]).round(5).tolist(),
        "left": left_ends.astype(float).round(4).tolist(),
        "right": right_ends.astype(float).round(4).tolist(),
    }
