"""One fall as its edges tell it: where the object or chain was, when, and how fast.

Each shadow of a known rod in a known beam is a point: its middle in time, and the rod's width over
its duration. Release, acceleration and Δz are those of the session's results.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.result import GOOD
from rig.measurands import FALL_TIME, RELEASE_SKEW, SEPARATION, SPEED, acceleration_in
from rig.model.fall import kicks
from rig.model.motion import Motion
from rig.model.rods import rod_impacts
from rig.protocol.contact import as_struck, at_contact
from rig.report.figure import Chart, Panel, PlotAxis, residual_panel, series
from rig.report.looks import MODEL, MUTED
from rig.report.numbers import plus_minus

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from fractions import Fraction

    from numpy.typing import NDArray

    from rig.analysis.result import DropResult
    from rig.protocol.protocol import Protocol, Run, Side
    from rig.records import Drop

    Array = NDArray[np.float64]

_MOMENTS = 200
_TIME = PlotAxis("time since release (s)")
_FROM_FIRST = PlotAxis("time since the first beam (s)")
_TOP = PlotAxis("height of the top rod z (m)")
_LEFT = "Lower panel: points less line, in units of U."


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
    protocol: Protocol, drop: Drop, hz: float | Fraction, result: DropResult, *, simulated: bool
) -> Iterator[Chart]:
    """Yield the pictures of one good drop: its fall first, then what shows the impacts."""
    if result.verdict not in GOOD or protocol.gates is None:
        return
    struck, free = (passages(protocol, drop, hz, result, side) for side in ("impact", "free"))
    head = f"Run {result.run.number}"
    if result.run.impact is None:
        if free.time.size > 2:
            panels = _object_panels(protocol, free, result)
            words = f"{head}, beam by beam. Line: the motion with the fitted acceleration. {_LEFT}"
            yield Chart("The fall", words, panels, simulated)
        return
    values = {name: value.value for name, value in result.quantities.items()}
    if struck.time.size < 3 or not {FALL_TIME.name, SPEED.name} <= values.keys():
        return
    head += f" at {result.run.incline_deg:g}°"
    landed = struck.time[-1] + struck.height[-1] / values[SPEED.name]
    released = landed - values[FALL_TIME.name]
    struck = struck._replace(time=struck.time - released)
    motion = motion_by_model(protocol, result.run)
    top = motion.at(0.0).height_m + protocol.chains[result.run.impact].chain.length
    at = np.linspace(0.0, motion.end_s, _MOMENTS)
    model, there = _model(motion, at), _model(motion, struck.time)
    u = 2.0 * np.hypot(protocol.gates.height_u, protocol.gates.datum_u)
    if free.time.size > 2 and RELEASE_SKEW.name in values:
        half = 0.5 * protocol.gravity.value
        since = free.time - released - values[RELEASE_SKEW.name]
        # The free chain's way, from all its passages, at the moments of the striking one's.
        ahead = np.mean(free.height + half * since**2) - half * struck.time**2 - struck.height
        u = np.hypot(u, struck.speed * result.quantities[RELEASE_SKEW.name].expanded)
        axis = PlotAxis("separation Δz (cm)")
        curve = [
            series("model", at, model["ahead"], "line", MODEL, scale=100.0),
            series("rods in beams", struck.time, ahead, "points", scale=100.0),
            series("Δz at level", [landed - released], [values[SEPARATION.name]], "mean",
                   u=[result.quantities[SEPARATION.name].expanded], scale=100.0),
        ]  # fmt: skip
        left = ahead - there["ahead"]
        title, words = "Separation against time", "how far the striking chain is ahead, if both"
        words += " are released at once"
    else:
        axis, left = _TOP, struck.height - (top - there["fallen"])
        curve = [
            series("model", at, top - model["fallen"], "line", MODEL),
            series("rods in beams", struck.time, struck.height, "points"),
        ]
        u = np.hypot(u, 2.0 * protocol.drop.u)
        title, words = "Height against time", "the top rod"
    panels = [Panel(_TIME, axis, curve, 100.0), residual_panel(_TIME, struck.time, left / u)]
    yield Chart(title, f"{head}: {words}. {_LEFT}", panels, simulated)
    fallen = np.array([0.0, top])
    squares = [
        series("free fall", 2.0 * motion.gravity * fallen, top - fallen, "dash", MUTED),
        series("model", model["speed"] ** 2, top - model["fallen"], "line", MODEL),
        series("", free.speed**2, free.height, "points", MUTED),
        series("rods in beams", struck.speed**2, struck.height, "points"),
    ]
    words = "the top rod (the paper's Fig. 4). Steps are impacts of single rods."
    panels = [Panel(PlotAxis("squared speed V² (m²/s²)"), _TOP, squares, 150.0)]
    yield Chart("Height against squared speed", f"{head}: {words}", panels, simulated)


def motion_by_model(protocol: Protocol, run: Run) -> Motion:
    """Return the model's fall of a run that strikes."""
    assert run.impact is not None
    protocol = at_contact(protocol, run.incline_deg, run.impact)
    assert protocol.surface is not None
    chain, drop = as_struck(protocol, run.incline_deg, run.impact)
    impacts = rod_impacts(protocol.surface, chain, run.incline_deg)
    gains = kicks(chain, [impact.alpha for impact in impacts], [impact.gamma for impact in impacts])
    start = protocol.initial_speed.value
    return Motion(chain, gains, drop.value, protocol.gravity.value, start)


def _object_panels(protocol: Protocol, seen: Passages, result: DropResult) -> list[Panel]:
    """Draw z(t) and v(t) of an object, with the acceleration as the slope, and what is left."""
    row = acceleration_in(result.quantities)
    assert row is not None
    assert protocol.gates is not None
    pull = result.quantities[row.name].value
    (rods,) = protocol.chains.values()
    time = seen.time - seen.time[0]
    # Height and speed at the first beam are as they fit best; the acceleration is the result.
    line = np.poly1d([-0.5 * pull, *np.polyfit(time, seen.height + 0.5 * pull * time**2, 1)])
    speed = -line.deriv()
    value = plus_minus(result.quantities[row.name], row.scale, row.decimals)
    at = np.linspace(0.0, time[-1], _MOMENTS)
    u_height = 2.0 * protocol.gates.height_u
    u_speed = 2.0 * seen.speed * rods.width_u / rods.widths[0]
    where = "height z (m)" if protocol.track is None else "place on the track z (m)"
    return [
        Panel(_FROM_FIRST, PlotAxis(where), [
            series("", at, line(at), "line", MODEL),
            series("beams", time, seen.height, "ring"),
        ], 100.0),
        residual_panel(_FROM_FIRST, time, (seen.height - line(time)) / u_height),
        Panel(_FROM_FIRST, PlotAxis("speed v (m/s)"), [
            series(f"slope {row.symbol} = {value} {row.unit}", at, speed(at), "line", MODEL),
            series("width over shadow time", time, seen.speed, "ring"),
        ], 100.0),
        residual_panel(_FROM_FIRST, time, (seen.speed - speed(time)) / u_speed),
    ]  # fmt: skip


def _model(motion: Motion, times: Array) -> Mapping[str, Array]:
    """Return what the model says at some moments: m fallen, m/s, m ahead."""
    begin = motion.at(0.0).height_m
    instants = [motion.at(min(max(time, 0.0), motion.end_s)) for time in times.tolist()]
    return {
        "fallen": np.array([begin - instant.height_m for instant in instants]),
        "speed": np.array([instant.speed_m_s for instant in instants]),
        "ahead": np.array([instant.separation_m for instant in instants]),
    }
