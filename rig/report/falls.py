"""Height and speed during a fall from single shadows, for figures.

Each shadow of an identified rod in a beam gives a point: the middle of its time, and the rod's
width over its duration T, the speed at that time. The rod's middle is then aT²/8 before the beam
for a constant acceleration a: between impacts, that of gravity. Release, acceleration and Δz are
those of the session's results.
"""

from collections.abc import Iterator
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rig.analysis.result import GOOD, DropResult
from rig.arrays import Array
from rig.estimate.curves import model_fall
from rig.measurands import FALL_TIME, RELEASE_SKEW, SEPARATION, SPEED, acceleration_in
from rig.protocol.contact import of_run
from rig.protocol.protocol import Protocol, Side
from rig.records import Drop
from rig.report.figure import Chart, chart
from rig.report.numbers import with_unit

_MOMENTS = 200
TimedDrop: TypeAlias = tuple[Drop, float | Fraction, DropResult]
"""A drop, calibrated ticks per second, and its result with the matches of edges to rods."""


class Passages(NamedTuple):
    """Points of a top rod or object at the middles of shadows, in order of time.

    Attributes
    ----------
    time
        Time, s.
    height, speed
        Height and speed of the top rod or object, m and m/s.
    """

    time: Array
    height: Array
    speed: Array

    @property
    def squared_speed(self) -> Array:
        """Squared speed of the top rod or object, m²/s²."""
        return self.speed**2


def passages(protocol: Protocol, timed: TimedDrop, side: Side) -> Passages:
    """Return the points of a chain or object from its matched edges.

    Parameters
    ----------
    side
        Side of the gates.
    """
    drop, hz, result = timed
    name = result.run.impact if side == "impact" else result.run.free
    gates = {gate.channel: gate for gate in protocol.gates.on(side)}
    row = acceleration_in(result.quantities)
    pull = result.quantities[row.name].value if row else protocol.gravity.value
    begun: dict[tuple[int, int], float] = {}
    rows, matches = [], result.matches
    for number, edge in enumerate(drop.edges):
        rod = matches.get(number)
        if rod is None or edge.channel not in gates:
            continue
        rods = protocol.chains[str(name)]
        shadow, time = (edge.channel, rod), float(edge.tick / hz)
        if edge.blocked:
            begun[shadow] = time
        elif shadow in begun and time > (before := begun.pop(shadow)):
            lasted = time - before
            beam = gates[edge.channel].height + pull * lasted**2 / 8
            height = beam + rods.chain.length - rods.chain.heights[rod]
            rows.append((before + lasted / 2, height, rods.widths[rod] / lasted))
    return Passages(*np.array(sorted(rows)).reshape(-1, 3).T)


def fall_figures(protocol: Protocol, timed: TimedDrop) -> Iterator[Chart]:
    """Yield the figures of a good drop: its fall first, then those of the impacts."""
    result = timed[-1]
    run, values, head = result.run, result.quantities, f"Run {result.run.number}"
    protocol = of_run(protocol, run)
    if result.verdict not in GOOD:
        return
    struck, free = (passages(protocol, timed, side) for side in ("impact", "free"))
    if run.impact is None:
        if free.time.size > 2:
            yield chart("object", _object(protocol, free, result), run=head)
        return
    if struck.time.size < 3 or not {FALL_TIME.name, SPEED.name} <= values.keys():
        return
    head += f" at {run.set_up}"
    end = values[FALL_TIME.name].value
    released = struck.time[-1] + struck.height[-1] / values[SPEED.name].value - end
    time = struck.time - released
    model, twin = (model_fall(protocol, run, role) for role in ("impact", "free"))
    times = np.linspace(0.0, model.time[-1], _MOMENTS)
    curve, moments = Passages(times, *model.heights(times)), np.clip(time, 0.0, times[-1])
    name, points, expected = "height", struck.height, model.heights(moments)[0]
    u = 2.0 * np.hypot(protocol.gates.height_u, protocol.gates.datum_u)
    if free.time.size > 2 and RELEASE_SKEW.name in values:
        skew = values[RELEASE_SKEW.name]
        # The free chain's path from all its passages, at the times of the striking chain's.
        higher = np.mean(free.height - twin.heights(free.time - released - skew.value)[0])
        points = twin.heights(time)[0] + higher - struck.height
        name, expected = "separation", twin.heights(moments)[0] - expected
        u = np.hypot(u, struck.speed * skew.expanded)
    else:
        u = np.hypot(u, 2.0 * protocol.drop.u)
    levels = np.linspace(curve.height[0], 0.0, _MOMENTS)
    sources = {
        "curve": curve,
        "separation": twin.heights(times)[0] - curve.height,
        "levels": levels,
        "free_fall": twin.passages(levels)[1] ** 2,
        "free": free,
        "struck": struck,
        "time": time,
        "points": points,
        "errors": _errors(points, expected, u),
        "end": [(end, values.get(SEPARATION.name))],
    }
    yield chart(name, sources, run=head)
    yield chart("speed", sources, run=head)


def _object(protocol: Protocol, seen: Passages, result: DropResult) -> dict[str, Any]:
    """Return z(t) and v(t) of an object with the fitted acceleration, and their residuals."""
    row = acceleration_in(result.quantities)
    assert row is not None
    pull = result.quantities[row.name]
    (rods,) = protocol.chains.values()
    time = seen.time - seen.time[0]
    # Height and speed at the first beam are fitted; the acceleration is the session's result.
    start = np.polyfit(time, seen.height + 0.5 * pull.value * time**2, 1)
    height = np.poly1d([-0.5 * pull.value, *start])
    speed, u_speed = -height.deriv(), 2.0 * seen.speed * rods.width_u / rods.widths[0]
    at = np.linspace(0.0, time[-1], _MOMENTS)
    return {
        "height": "height" if protocol.track is None else "place on the track",
        "slope": f"slope {row.symbol} = {with_unit(pull, row)}",
        "curve": {"time": at, "height": height(at), "speed": speed(at)},
        "seen": {
            **seen._asdict(),
            "time": time,
            "height_error": _errors(seen.height, height(time), 2.0 * protocol.gates.height_u),
            "speed_error": _errors(seen.speed, speed(time), u_speed),
        },
    }


def _errors(values: Array, expected: Array, u: Array | float) -> Array:
    """Return residuals in units of U; not finite without a U."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray((values - expected) / u)
