"""A rig to scale at one moment of a drop, as strokes in metres: what falls, board, posts, Δz.

Heights are above the contact point, as those of falls are.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.protocol.contact import at_contact
from rig.tui.braille import COLUMNS, ROWS, Sheet, Span

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rig.protocol.protocol import Protocol, Run, Side
    from rig.tui.indicators import Indicators
    from rig.tui.motion import ChainFall

_WIDTH_M = 0.1  # of a rod whose length nobody stated
_MARGIN_M = 0.04
_BALL = 0.012  # of the height that is shown: a smaller ball would not be seen
_COLORS = ("border", "foreground", "accent", "primary", "secondary", "success", "warning")


class Stroke(NamedTuple):
    """A straight line from one point to another, m, in a colour of the theme."""

    x: float
    z: float
    to_x: float
    to_z: float
    color: str


class Lamp(NamedTuple):
    """Channel of a gate, and where its beam begins, m."""

    channel: int
    x: float
    z: float
    lit: bool


class Drawing(NamedTuple):
    """Strokes, and what of the world they show, m; `apart_m` is Δz as far as it was measured."""

    strokes: tuple[Stroke, ...]
    width_m: float
    bottom_m: float
    top_m: float
    apart_m: float | None
    lamps: tuple[Lamp, ...] = ()


def drawing(
    protocol: Protocol,
    run: Run,
    falls: Sequence[ChainFall],
    indicators: Indicators,
    time_s: float,
) -> Drawing:
    """Draw what falls as measured, over where the model has it, between the posts of its gates.

    Parameters
    ----------
    falls
        As `rig.tui.motion.motions` gives them.
    indicators
        Of the gates at that moment: those that are blocked light.
    time_s
        Since the release fired.
    """
    protocol = at_contact(protocol, run.incline_deg, run.impact)
    strokes: list[Stroke] = []
    lamps: list[Lamp] = []
    names = {"impact": run.impact, "free": run.free}
    pitch = 2.4 * max(_rod_m(protocol, name) for name in names.values())
    half = 0.5 * pitch
    length = max(rods.chain.length for rods in protocol.chains.values())
    gates = protocol.gates.gates if protocol.gates else ()
    top = protocol.drop.value + length + _MARGIN_M
    # A free chain that passes the contact point is shown as far down as one that struck it lies.
    lowest = min((gate.height - length for gate in gates), default=0.0)
    bottom = -0.35 * length if protocol.surface else lowest - _MARGIN_M
    for column, fall in enumerate(falls):
        side = fall.role
        name = names[side] or run.impact
        assert name is not None
        middle = pitch * (2.0 * column + 1.2)
        own = [gate for gate in gates if gate.side == side]
        reach = [gate.height + sign * _MARGIN_M for gate in own for sign in (-1.0, 1.0)]
        for x in (middle - half, middle + half):
            post = Stroke(x, min(reach, default=0.0), x, max(reach, default=0.0), "border")
            strokes += [post] if reach else []
        for gate in own:
            lit = gate.channel in indicators.blocked
            lamps.append(Lamp(gate.channel, middle - half, gate.height, lit))
            end, color = (middle + half, "warning") if lit else (middle - 0.8 * half, "foreground")
            strokes.append(Stroke(middle - half, gate.height, end, gate.height, color))
        model = _model(fall, time_s)
        if model is not None:
            strokes += _rods(protocol, name, side, middle, model, "accent", top - bottom)
        if fall.times.size:
            color = "primary" if side == "impact" else "secondary"
            hangs = model is not None and time_s < fall.times[0]
            height = model if hangs and model is not None else _measured(fall, time_s)
            strokes += _rods(protocol, name, side, middle, height, color, top - bottom)
        if side == "impact":
            fallen = half * math.tan(math.radians(run.incline_deg))
            strokes.append(Stroke(middle - half, fallen, middle + half, -fallen, "foreground"))
    width = 2.0 * pitch * max(1, len(falls)) + 0.4 * pitch
    apart = None
    begun = [fall for fall in falls if fall.times.size and fall.times[0] <= time_s]
    if len(begun) == 2:
        until_s = min(time_s, *(float(fall.times[-1]) for fall in begun))
        low, high = (
            _measured(fall, until_s) + protocol.chains[name].chain.length
            for fall, name in zip(begun, names.values(), strict=True)
            if name is not None
        )
        apart, at = high - low, 2.2 * pitch
        strokes.append(Stroke(at, low, at, high, "success"))
        strokes += [Stroke(at - 0.03, z, at + 0.03, z, "success") for z in (low, high)]
    return Drawing(tuple(strokes), width, bottom, top, apart, tuple(lamps))


def painted(drawing: Drawing, width: int, height: int) -> list[list[Span]]:
    """Draw into so many columns and lines of characters, the last line in words.

    A dot is as high as it is wide.
    """
    rows = max(1, height - 1)
    scale = min(
        (ROWS * rows - 1) / (drawing.top_m - drawing.bottom_m),
        (COLUMNS * width - 1) / drawing.width_m,
    )
    top = drawing.top_m
    left = 0.5 * ((COLUMNS * width - 1) / scale - drawing.width_m)
    sheet = Sheet(width, rows, _COLORS)
    rows_named: dict[tuple[int, int], list[Lamp]] = {}
    for lamp in drawing.lamps:
        place = round(scale * (top - lamp.z)) // ROWS, round(scale * (left + lamp.x)) // COLUMNS
        rows_named.setdefault(place, []).append(lamp)
    for (row, column), lamps in rows_named.items():
        lit = any(lamp.lit for lamp in lamps)
        text = ",".join(str(lamp.channel) for lamp in sorted(lamps)) + "○●"[lit]
        color = "warning" if lit else "foreground"
        sheet.write(row, max(0, column - len(text)), Span(text, color, bold=lit))
    ends = np.array(
        [[(s.x + left, top - s.z), (s.to_x + left, top - s.to_z)] for s in drawing.strokes]
    )
    inks = np.array([_COLORS.index(stroke.color) for stroke in drawing.strokes], dtype=np.int64)
    sheet.strokes(scale * ends.reshape(-1, 2, 2), inks)
    apart = "" if drawing.apart_m is None else f"  Δz {drawing.apart_m * 1e2:.1f} cm as it falls"
    words = [Span("model", "accent"), Span(" behind measured"), Span(apart, "success", bold=True)]
    return [*sheet.rows(), words]


def _rod_m(protocol: Protocol, name: str | None) -> float:
    length = math.nan if name is None else protocol.chains[name].rod_length
    return _WIDTH_M if math.isnan(length) else length


def _measured(fall: ChainFall, time_s: float) -> float:
    """Height of the bottom rod as the gates saw it, at their last word after that."""
    return float(np.interp(time_s, fall.times, fall.heights))


def _model(fall: ChainFall, time_s: float) -> float | None:
    if fall.model is None:
        return None
    at = np.array([max(0.0, time_s - fall.delay_s)])
    if fall.model.hits is not None:
        at = np.minimum(at, fall.model.time[-1])
    return float(fall.model.heights(at)[0][0])


def _rods(
    protocol: Protocol, name: str, side: Side, x: float, height: float, color: str, shown_m: float
) -> Iterator[Stroke]:
    """Rods on their strings; those that struck lie at the contact point. An object is round."""
    rods = protocol.chains[name]
    half = 0.5 * _rod_m(protocol, name)
    if protocol.vocabulary.part == "object":
        radius = max(0.5 * rods.widths[0], _BALL * shown_m)
        around = np.linspace(0.0, 2.0 * np.pi, 13)
        points = np.column_stack([x + radius * np.cos(around), height + radius * np.sin(around)])
        for (from_x, from_z), (to_x, to_z) in pairwise(points.tolist()):
            yield Stroke(from_x, from_z, to_x, to_z, color)
        return
    lies = side == "impact" and protocol.surface is not None
    for number, place in enumerate(rods.chain.heights):
        z = height + place
        tilt = math.radians(rods.tilt_deg if number % 2 else -rods.tilt_deg)
        if lies and z < 0.0:
            z, tilt = 0.0, 0.0
        across, up = half * math.cos(tilt), half * math.sin(tilt)
        yield Stroke(x - across, z - up, x + across, z + up, color)
