"""A drop beside the model and free fall, in words and as speed against time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.comparison import compare
from rig.analysis.result import Measured
from rig.measurands import MEASURANDS, SEPARATION, SPEED, averaged
from rig.predictions import predict_incline, predicted_run
from rig.report.numbers import decimals_for, fixed, plus_minus
from rig.tui.motion import model_fall
from rig.tui.plotting import Picture, Series

if TYPE_CHECKING:
    from rig.measurands import Measurand
    from rig.protocol.protocol import Protocol, Run
    from rig.records import Job
    from rig.results.live import SessionView
    from rig.units import Quantity

_BESIDE_S = 0.02
_POINTS = 400  # of a curve whose steps stand 10 ms apart


def expected_words(protocol: Protocol, run: Run) -> str:
    """State the model's prediction for a run; empty where it has no answer."""
    expected = predicted_run(protocol, run)
    values = [
        f"{row.symbol} {plus_minus(stated(expected[row.name]), row.scale)} {row.unit}"
        for row in averaged()
        if row.name in expected
    ]
    return "  ".join(values)


def stated(model: Quantity) -> Measured | float:
    """Take a prediction as a measured value is written: with U95 where it has any."""
    return Measured(model.value, model.u) if model.u else model.value


def why_words(view: SessionView, job: Job) -> str:
    """Compare a drop with the model and with free fall; empty where nothing was measured."""
    run, measured = view.plan[job.run], view.results[job].quantities
    expected = predicted_run(view.protocol, run)
    lines = []
    speed = measured.get(SPEED.name)
    if speed is not None and run.impact is not None:
        free = predict_incline(view.protocol, run.incline_deg, run.impact, run.free).free_fall_speed
        model = expected.get(SPEED.name)
        by_model = f"model {plus_minus(stated(model), SPEED.scale)}, " if model is not None else ""
        by_gates = f"measured {plus_minus(speed, SPEED.scale)} {SPEED.unit}"
        lines.append(f"V: free fall {free:.3f}, {by_model}{by_gates}")
    apart = measured.get(SEPARATION.name)
    fall = model_fall(view.protocol, run, "free") if run.free is not None else None
    if apart is not None and fall is not None and run.free is not None:
        length = view.protocol.chains[run.free].chain.length
        lead = np.diff(fall.times(np.array([apart.value - length, -length])))[0]
        lines.append(
            f"the striking chain {'wins' if lead > 0.0 else 'loses'} by "
            f"{abs(apart.value) * SEPARATION.scale:.1f} {SEPARATION.unit}, "
            f"or {abs(lead) * 1e3:.0f} ms"
        )
    for comparison in compare(view.protocol, [[view.results[job]]]):
        difference = comparison.differences[0]
        error = difference.normalized_error
        if error:
            row = MEASURANDS[comparison.quantity]
            lines.append(_difference(row, abs(difference.value), abs(difference.value / error)))
    return "\n".join(lines)


def _difference(row: Measurand, difference: float, limit: float) -> str:
    """State a difference from the model beside the expanded uncertainty that it has."""
    decimals = decimals_for(limit * row.fine_scale)
    size, normal = (fixed(value * row.fine_scale, decimals) for value in (difference, limit))
    return (
        f"{row.symbol} differs from the model by {size} {row.fine}; "
        f"± {normal} {row.fine} would be normal"
    )


def speed_picture(view: SessionView, job: Job) -> Picture | None:
    """Draw V(t) by the model, a step for each rod that strikes, and what was measured at its end.

    `None` where no chain strikes, or the model has no answer.
    """
    run = view.plan[job.run]
    fall = model_fall(view.protocol, run, "impact") if run.impact is not None else None
    if fall is None or fall.hits is None:
        return None
    end = float(fall.time[-1])
    times = np.linspace(0.0, end, _POINTS)
    series = [Series("line", times * 1e3, fall.heights(times)[1], "accent", label="model")]
    free = model_fall(view.protocol, run, "free")
    if free is not None:
        series.append(Series("line", times * 1e3, free.heights(times)[1], "secondary",
                             label="free fall"))  # fmt: skip
    measured = view.results[job].quantities.get(SPEED.name)
    if measured is not None:
        series.append(Series("bars", [end * 1e3], [measured.value], "primary", "●", "measured ± U",
                             [measured.expanded]))  # fmt: skip
    return Picture("V (m/s)", "t (ms)", tuple(series), (0.0, 1e3 * (end + _BESIDE_S)))
