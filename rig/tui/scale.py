"""Drawing of a rig to scale at a moment of a drop: chains or object, board, posts and Δz.

The drawing consists of strokes in metres. Heights are above the contact point.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from rig.protocol.contact import of_run
from rig.protocol.protocol import Protocol, Run
from rig.tui.braille import COLUMNS, ROWS, Rows, Sheet, Span

if TYPE_CHECKING:
    from rig.tui.motion import ChainFall

_WIDTH_M = 0.1  # length of a rod without a stated length
_MARGIN_M = 0.04
_BALL = 0.012  # least radius of a ball as a share of the height shown, to be visible
_CORNERS = 17  # corners of a circle
_COLORS = ("border", "foreground", "accent", "primary", "secondary", "success", "warning")


Stroke: TypeAlias = tuple[float, float, float, float, str]
"""A straight line between two points, x before z, m, and its colour of the theme."""


class Lamp(NamedTuple):
    """Channel of a gate, and the start of its beam, m."""

    channel: int
    x: float
    z: float
    lit: bool


class Drawing(NamedTuple):
    """Strokes, and the range of the scene that they show, m.

    `middles` are those of the sides; `apart_m` is Δz if measured so far.
    """

    strokes: Sequence[Stroke]
    width_m: float
    bottom_m: float
    top_m: float
    apart_m: float | None = None
    lamps: Sequence[Lamp] = ()
    middles: Sequence[float] = ()


def drawing(
    protocol: Protocol, run: Run, falls: Sequence[ChainFall], blocked: Sequence[int], time_s: float
) -> Drawing:
    """Return the measured chains over those of the model, between the posts of their gates.

    Parameters
    ----------
    falls
        Falls from `rig.tui.motion.motions`.
    blocked
        Channels of the gates that are blocked at that time, which are highlighted.
    time_s
        Time since the release fired, s.
    """
    protocol = of_run(protocol, run)
    strokes: list[Stroke] = []
    lamps: list[Lamp] = []
    pitch = 2.4 * max((fall.rods.rod_length or _WIDTH_M for fall in falls), default=_WIDTH_M)
    half, length = 0.5 * pitch, max((fall.length for fall in falls), default=0.0)
    heights = [gate.height for gate in protocol.gates.gates] or [0.0]
    low, high = min(heights) - _MARGIN_M, max(heights) + _MARGIN_M
    # A free chain below the contact point is shown down to the depth of a fallen chain.
    bottom = -0.35 * length if protocol.surface else low - length
    top = protocol.drop.value + length + _MARGIN_M
    middles = [pitch * (2.0 * column + 1.2) for column in range(len(falls))]
    for middle, fall in zip(middles, falls, strict=True):
        left, right = middle - half, middle + half
        strokes += [(x, low, x, high, "border") for x in (left, right)]
        for gate in protocol.gates.on(fall.role):
            lit = gate.channel in blocked
            lamps.append(Lamp(gate.channel, left, gate.height, lit))
            end, color = (right, "warning") if lit else (left + 0.2 * half, "foreground")
            strokes.append((left, gate.height, end, gate.height, color))
        expected, measured = fall.model_height(time_s), fall.measured_height(time_s)
        seen = expected if measured is None and fall.times.size else measured
        own = "primary" if fall.role == "impact" else "secondary"
        for height, color in ((expected, "accent"), (seen, own)):
            if height is not None:
                strokes += _rods(protocol, fall, middle, height, color, top - bottom)
        if fall.role == "impact":
            fallen = half * math.tan(math.radians(run.incline_deg))
            strokes.append((left, fallen, right, -fallen, "foreground"))
    width = pitch * (2.0 * max(1, len(falls)) + 0.4)
    # Δz is known while both chains pass gates.
    until_s = min([time_s, *(float(fall.times[-1]) for fall in falls if fall.times.size)])
    tops = [z + fall.length for fall in falls if (z := fall.measured_height(until_s)) is not None]
    apart_m = None
    if len(tops) > 1:
        at, apart_m = 2.2 * pitch, tops[1] - tops[0]
        strokes.append((at, tops[0], at, tops[1], "success"))
        strokes += [(at - 0.03, z, at + 0.03, z, "success") for z in tops]
    return Drawing(strokes, width, bottom, top, apart_m, lamps, middles)


def paint(drawing: Drawing, width: int, height: int) -> Rows:
    """Return the drawing in columns and lines of characters, with words in the last line.

    Dots are square.
    """
    strokes, width_m, bottom, top, apart_m, lamps, _ = drawing
    rows, dots = max(1, height - 1), COLUMNS * width - 1
    scale = min((ROWS * rows - 1) / (top - bottom), dots / width_m)
    left = 0.5 * (dots / scale - width_m)
    sheet = Sheet(width, rows, _COLORS)
    shared: dict[tuple[int, int], list[Lamp]] = {}
    for lamp in sorted(lamps):
        place = round(scale * (top - lamp.z)) // ROWS, round(scale * (left + lamp.x)) // COLUMNS
        shared.setdefault(place, []).append(lamp)
    for (row, column), near in shared.items():
        lit = any(lamp.lit for lamp in near)
        text = ",".join(str(lamp.channel) for lamp in near) + "○●"[lit]
        color = "warning" if lit else "foreground"
        sheet.write(row, max(0, column - len(text)), Span(text, color, bold=lit))
    ends = np.array([places for *places, _ in strokes]).reshape(-1, 2, 2)
    inks = [_COLORS.index(color) for *_, color in strokes]
    sheet.strokes(scale * (np.array([left, top]) + ends * [1.0, -1.0]), inks)
    apart = "" if apart_m is None else f"  Δz {apart_m * 1e2:.1f} cm as it falls"
    measured = {"primary", "secondary"} & {color for *_, color in strokes}
    behind = Span(" behind measured" * bool(measured))
    words = [Span("model", "accent"), behind, Span(apart, "success", bold=True)]
    return [*sheet.rows(), words]


def _rods(
    protocol: Protocol, fall: ChainFall, x: float, height: float, color: str, shown_m: float
) -> Iterator[Stroke]:
    """Yield rods and strings, with struck rods at the contact point, or a round object."""
    rods = fall.rods
    half = 0.5 * (rods.rod_length or _WIDTH_M)
    if protocol.vocabulary.part == "object":
        radius = max(0.5 * rods.widths[0], _BALL * shown_m)
        angles = np.linspace(0.0, 2.0 * math.pi, _CORNERS)
        around = np.column_stack([x + radius * np.cos(angles), height + radius * np.sin(angles)])
        yield from ((*start, *end, color) for start, end in pairwise(around.tolist()))
        return
    lies = fall.role == "impact" and protocol.surface is not None
    for number, place in enumerate(rods.chain.heights):
        z = height + place
        tilt = math.radians(rods.tilt_deg if number % 2 else -rods.tilt_deg)
        if lies and z < 0.0:
            z, tilt = 0.0, 0.0
        across, up = half * math.cos(tilt), half * math.sin(tilt)
        yield x - across, z - up, x + across, z + up, color
