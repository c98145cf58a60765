"""One fall as its edges tell it: where the object or chain was, when, and how fast.

Each shadow of a known rod in a known beam is a point: its middle in time, and the rod's width over
its duration. Release, acceleration and Δz are those of the session's results.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.result import GOOD
from rig.estimate.curves import motion_by_model
from rig.measurands import FALL_TIME, RELEASE_SKEW, SEPARATION, SPEED, acceleration_in
from rig.report.figure import Panel, PlotAxis, chart, measured, residual_panels, series
from rig.report.looks import MODEL, MUTED
from rig.report.numbers import plus_minus

if TYPE_CHECKING:
    from collections.abc import Iterator
    from fractions import Fraction

    from numpy.typing import NDArray

    from rig.analysis.result import DropResult
    from rig.model.motion import Motion
    from rig.protocol.protocol import Protocol, Side
    from rig.records import Drop
    from rig.report.figure import Chart

    Array = NDArray[np.float64]

_MOMENTS = 200
_TIME = PlotAxis("time since release (s)")
_FROM_FIRST = PlotAxis("time since the first beam (s)")
_TOP = PlotAxis("height of the top rod z (m)")


class Passages(NamedTuple):
    """Middles of shadows on one side, in order of time.

    Attributes
    ----------
    time
        s.
    height, speed
        Of the top rod or object, m and m/s.
    """

    time: Array
    height: Array
    speed: Array


def passages(
    protocol: Protocol, drop: Drop, hz: float | Fraction, result: DropResult, side: Side
) -> Passages:
    """Read where a chain or an object was from the edges that were matched.

    Parameters
    ----------
    hz
        Calibrated ticks per second.
    result
        Which edge is of which rod.
    side
        Of the gates.
    """
    name = result.run.impact if side == "impact" else result.run.free
    gates = {gate.channel: gate for gate in protocol.gates.on(side)} if protocol.gates else {}
    begun: dict[tuple[int, int], float] = {}
    rows = []
    for number, edge in enumerate(drop.edges if name is not None else ()):
        rod = result.matches.get(number)
        if rod is None or edge.channel not in gates:
            continue
        rods = protocol.chains[str(name)]
        shadow, time = (edge.channel, rod), float(edge.tick / hz)
        if edge.blocked:
            begun[shadow] = time
        elif shadow in begun and time > begun[shadow]:
            before = begun.pop(shadow)
            height = gates[edge.channel].height + rods.chain.length - rods.chain.heights[rod]
            rows.append(((time + before) / 2, height, rods.widths[rod] / (time - before)))
    return Passages(*np.array(sorted(rows)).reshape(-1, 3).T)


def fall_figures(
    protocol: Protocol, drop: Drop, hz: float | Fraction, result: DropResult
) -> Iterator[Chart]:
    """Yield the pictures of one good drop: its fall first, then what shows the impacts."""
    if result.verdict not in GOOD or protocol.gates is None:
        return
    struck, free = (passages(protocol, drop, hz, result, side) for side in ("impact", "free"))
    head, values = f"Run {result.run.number}", result.quantities
    if result.run.impact is None:
        if free.time.size > 2:
            yield chart("object", _object_panels(protocol, free, result), run=head)
        return
    if struck.time.size < 3 or not {FALL_TIME.name, SPEED.name} <= values.keys():
        return
    head += f" at {result.run.incline_deg:g}°"
    lasted = values[FALL_TIME.name].value
    released = struck.time[-1] + struck.height[-1] / values[SPEED.name].value - lasted
    struck = struck._replace(time=struck.time - released)
    motion = motion_by_model(protocol, result.run)
    top = motion.at(0.0).height_m + motion.chain.length
    at = np.linspace(0.0, motion.end_s, _MOMENTS)
    (falling, speeds, gaps), (heights, _, gaps_there) = (
        np.transpose([_instant(motion, time) for time in times.tolist()])
        for times in (at, struck.time)
    )
    u = 2.0 * np.hypot(protocol.gates.height_u, protocol.gates.datum_u)
    if free.time.size > 2 and RELEASE_SKEW.name in values:
        half, skew = 0.5 * protocol.gravity.value, values[RELEASE_SKEW.name]
        # The free chain's way, from all its passages, at the moments of the striking one's.
        since = free.time - released - skew.value
        ahead = np.mean(free.height + half * since**2) - half * struck.time**2 - struck.height
        level, u = values[SEPARATION.name], np.hypot(u, struck.speed * skew.expanded)
        name, axis = "separation", PlotAxis("separation Δz (cm)")
        curve = [
            series("model", at, gaps, "line", MODEL, scale=100.0),
            series("rods in beams", struck.time, ahead, "points", scale=100.0),
            measured("Δz at level", [(lasted, level)], "mean", scale=100.0),
        ]
        left = ahead - gaps_there
    else:
        name, axis = "height", _TOP
        curve = [
            series("model", at, falling, "line", MODEL),
            series("rods in beams", struck.time, struck.height, "points"),
        ]
        left, u = struck.height - heights, np.hypot(u, 2.0 * protocol.drop.u)
    panels = [Panel(_TIME, axis, curve, 100.0), *_residuals(_TIME, struck.time, left, u)]
    yield chart(name, panels, run=head)
    fallen = np.array([0.0, top])
    squares = [
        series("free fall", 2.0 * motion.gravity * fallen, top - fallen, "dash", MUTED),
        series("model", speeds**2, falling, "line", MODEL),
        series("", free.speed**2, free.height, "points", MUTED),
        series("rods in beams", struck.speed**2, struck.height, "points"),
    ]
    panels = [Panel(PlotAxis("squared speed V² (m²/s²)"), _TOP, squares, 150.0)]
    yield chart("speed", panels, run=head)


def _object_panels(protocol: Protocol, seen: Passages, result: DropResult) -> list[Panel]:
    """Draw z(t) and v(t) of an object, with the acceleration as the slope, and what is left."""
    row = acceleration_in(result.quantities)
    assert row is not None
    assert protocol.gates is not None
    pull = result.quantities[row.name]
    (rods,) = protocol.chains.values()
    time = seen.time - seen.time[0]
    # Height and speed at the first beam are as they fit best; the acceleration is the result.
    start = np.polyfit(time, seen.height + 0.5 * pull.value * time**2, 1)
    line = np.poly1d([-0.5 * pull.value, *start])
    slope = f"slope {row.symbol} = {plus_minus(pull, row.scale, row.decimals)} {row.unit}"
    where = "height z (m)" if protocol.track is None else "place on the track z (m)"
    u_speed = 2.0 * seen.speed * rods.width_u / rods.widths[0]
    at = np.linspace(0.0, time[-1], _MOMENTS)
    return [
        panel
        for label, motion, name, points, points_name, u in (
            (where, line, "", seen.height, "beams", 2.0 * protocol.gates.height_u),
            ("speed v (m/s)", -line.deriv(), slope, seen.speed, "width over shadow time", u_speed),
        )
        for panel in (
            Panel(
                _FROM_FIRST,
                PlotAxis(label),
                [
                    series(name, at, motion(at), "line", MODEL),
                    series(points_name, time, points, "ring"),
                ],
                100.0,
            ),
            *_residuals(_FROM_FIRST, time, points - motion(time), u),
        )
    ]


def _residuals(axis: PlotAxis, times: Array, left: Array, u: Array | float) -> list[Panel]:
    """Return none where heights and sizes are stated without an uncertainty."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return residual_panels(axis, zip(times, left / u, strict=True))


def _instant(motion: Motion, time: float) -> tuple[float, float, float]:
    """Return where the model has the top rod, m, its speed, m/s, and Δz, m."""
    instant = motion.at(min(max(time, 0.0), motion.end_s))
    return instant.height_m + motion.chain.length, instant.speed_m_s, instant.separation_m
