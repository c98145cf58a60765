"""Both chains to scale at one moment of a drop, as strokes in metres: rods, board, gates, Δz.

Heights are above the contact point, as those of falls and films are.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.protocol.contact import at_contact

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rig.films import Film
    from rig.protocol.protocol import Protocol, Run, Side
    from rig.tui.indicators import Indicators
    from rig.tui.motion import ChainFall

_WIDTH_M = 0.1  # of a rod whose length nobody stated
_MARGIN_M = 0.04


class Stroke(NamedTuple):
    """A straight line from one point to another, m, in a colour of the theme."""

    x: float
    z: float
    to_x: float
    to_z: float
    color: str


class Drawing(NamedTuple):
    """Strokes, and what of the world they show, m; `apart_m` is Δz as far as it was measured."""

    strokes: tuple[Stroke, ...]
    width_m: float
    bottom_m: float
    top_m: float
    apart_m: float | None


def drawing(
    protocol: Protocol,
    run: Run,
    falls: Sequence[ChainFall],
    indicators: Indicators,
    time_s: float,
    film: Film | None = None,
) -> Drawing:
    """Draw each chain as measured, and beside it where the model has it.

    Parameters
    ----------
    falls
        As `rig.tui.motion.motions` gives them.
    indicators
        Of the gates at that moment: those that are blocked light.
    time_s
        Since the release fired.
    film
        Of the striking chain, where a simulation knows how each rod moved: shown as measured.
    """
    protocol = at_contact(protocol, run.incline_deg, run.impact)
    strokes: list[Stroke] = []
    names = {"impact": run.impact, "free": run.free}
    pitch = 2.4 * max(_rod_m(protocol, name) for name in names.values())
    half = 0.5 * pitch
    length = max(rods.chain.length for rods in protocol.chains.values())
    for column, fall in enumerate(falls):
        side: Side = "impact" if fall.role == "impact" else "free"
        name = names[side]
        assert name is not None
        left, right = pitch * (2 * column + 0.5), pitch * (2 * column + 1.5)
        model = _model(fall, time_s)
        if model is not None:
            strokes += _rods(protocol, name, side, right, model, "accent")
        if fall.times.size:
            color = "primary" if side == "impact" else "secondary"
            if film is not None and side == "impact":
                strokes += _filmed(film, left, time_s - fall.delay_s, color)
            else:
                hangs = model is not None and time_s < fall.times[0]
                height = model if hangs and model is not None else _measured(fall, time_s)
                strokes += _rods(protocol, name, side, left, height, color)
        for gate in protocol.gates.on(side) if protocol.gates else ():
            lit = gate.channel in indicators.blocked
            end, color = (left + half, "warning") if lit else (left - 0.7 * half, "foreground")
            strokes.append(Stroke(left - half, gate.height, end, gate.height, color))
        if side == "impact":
            fallen = half * math.tan(math.radians(run.incline_deg))
            strokes.append(Stroke(left - half, fallen, left + half, -fallen, "foreground"))
    width = 2.0 * pitch * max(1, len(falls))
    apart = None
    begun = [fall for fall in falls if fall.times.size and fall.times[0] <= time_s]
    if len(begun) == 2:
        until_s = min(time_s, *(float(fall.times[-1]) for fall in begun))
        low, high = (
            _measured(fall, until_s) + protocol.chains[name].chain.length
            for fall, name in zip(begun, names.values(), strict=True)
            if name is not None
        )
        apart, at = high - low, 0.5 * width
        strokes.append(Stroke(at, low, at, high, "success"))
        strokes += [Stroke(at - 0.03, z, at + 0.03, z, "success") for z in (low, high)]
    top = protocol.drop.value + length + _MARGIN_M
    # A free chain that passes the contact point is shown as far down as one that struck it lies.
    return Drawing(tuple(strokes), width, -0.35 * length, top, apart)


def _rod_m(protocol: Protocol, name: str | None) -> float:
    return _WIDTH_M if name is None else protocol.chains[name].rod_length or _WIDTH_M


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
    protocol: Protocol, name: str, side: Side, x: float, height: float, color: str
) -> Iterator[Stroke]:
    """Rods on their strings; those that struck lie at the contact point."""
    rods = protocol.chains[name]
    half = 0.5 * _rod_m(protocol, name)
    lies = side == "impact" and protocol.surface is not None
    for number, place in enumerate(rods.chain.heights):
        z = height + place
        tilt = math.radians(rods.tilt_deg if number % 2 else -rods.tilt_deg)
        if lies and z < 0.0:
            z, tilt = 0.0, 0.0
        across, up = half * math.cos(tilt), half * math.sin(tilt)
        yield Stroke(x - across, z - up, x + across, z + up, color)


def _filmed(film: Film, x: float, time_s: float, color: str) -> Iterator[Stroke]:
    """Rods with their tilt, in the pile too, and the strings that are slack."""
    moment = film.nearest(time_s)
    both = film.left[moment], film.right[moment]
    for start, end in zip(*both, strict=True):
        yield Stroke(x + start[0], start[2], x + end[0], end[2], color)
    for ends, slack in zip(both, film.slack(moment), strict=True):
        for low, high, loose in zip(ends, ends[1:], slack, strict=False):
            if loose:
                yield Stroke(x + low[0], low[2], x + high[0], high[2], "foreground")
