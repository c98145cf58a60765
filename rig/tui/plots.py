"""What the plots show, as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.result import GOOD
from rig.measurands import RELEASE_SKEW, SEPARATION, SPEED, acceleration_in, averaged
from rig.predictions import predicted_run
from rig.tui.motion import model_fall, motions, separation
from rig.tui.plotting import Picture, Series

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from rig.analysis.result import DropResult, Measured
    from rig.analysis.session import Analysis
    from rig.records import Job
    from rig.results.live import SessionView
    from rig.tui.motion import ChainFall, Table

    Point = tuple[float, float, float]

_MARKS = {"impact": ("×", "primary"), "free": ("+", "secondary")}
_BEFORE_S = 0.02
_WITH_BARS = 40  # numbers in a chart: the bars of more stand in each other's way
_MOST = 300  # marks of a chain: more would stand on each other
_LAID = 12  # drops over each other
_STEPS = 400  # of a curve whose steps stand 10 ms apart
_TIME = "t (ms)"


def fall_pictures(
    falls: tuple[ChainFall, ...], skew_s: float | None = None, gap_u: float = 0.0
) -> list[Picture]:
    """Draw Δz(t) of two chains, then z(t), with the model's curves.

    Parameters
    ----------
    falls
        The chains of a drop.
    skew_s
        What was measured of the release: Δz is then that of chains let go together, or else as it
        fell; z(t) always is as it fell.
    gap_u
        Expanded uncertainty of the model's Δz at its end, relative. Before, its band is as wide as
        Δz is large: what the impacts leave open grows with what they did.
    """
    if not falls:
        return []
    end = max(fall.end_s for fall in falls) + _BEFORE_S
    series, residuals, pair = [], [], len(falls) > 1
    for fall in falls:
        times, heights = fall.curve(end)
        label = f"model, {fall.role} side" if pair else "model"
        series.append(Series("line", times * 1e3, heights * 1e2, "accent", label=label))
    for fall in reversed(falls):  # the struck chain above the free one
        mark, color = _MARKS[fall.role]
        thin = slice(None, None, 1 + fall.times.size // _MOST)
        times, heights = fall.times[thin], fall.heights[thin]
        label = fall.role if pair else "measured"
        series.append(Series("dots", times * 1e3, heights * 1e2, color, mark, label))
        if fall.model is not None and times.size:
            off = heights - fall.model.heights(times - fall.delay_s)[0]
            residuals.append(Series("dots", times * 1e3, off * 1e3, color, mark))
    pictures = [_against_time("z (cm) as it fell", series, residuals, end)]
    if pair:
        gap = separation(falls, end, skew_s)
        off = gap.gaps - gap.expected if gap.expected.size else gap.expected
        curve, model = gap.curve * 1e3, gap.model * 1e2
        series = [
            Series("line", curve, model, "accent", label="model"),
            Series("dots", gap.times * 1e3, gap.gaps * 1e2, "success", "+", "measured"),
        ]
        if gap_u:
            band = Series("band", curve, model, "border", label="± U", errors=abs(gap_u * model))
            series = [band, *series]
        residuals = [Series("dots", gap.times[: off.size] * 1e3, off * 1e3, "success", "+")]
        label = "as it fell" if skew_s is None else "corrected"
        pictures = [_against_time(f"Δz {label} (cm)", series, residuals, end), *pictures]
    return pictures


def _against_time(
    label: str, series: Sequence[Series], residuals: Sequence[Series], end_s: float
) -> Picture:
    return Picture(label, _TIME, tuple(series), (0.0, end_s * 1e3),
                   residuals=tuple(residuals), residual_label="minus model (mm)")  # fmt: skip


def drop_pictures(view: SessionView, job: Job, edges: Table | None = None) -> list[Picture]:
    """Draw a recorded drop, or its first `edges`, with rods and skew as the analysis found them."""
    result, hz, run = view.results[job], view.scales[job].hz, view.plan[job.run]
    skew = result.quantities.get(RELEASE_SKEW.name)
    edges = view.drops[job].edges if edges is None else edges
    falls = motions(view.protocol, run, edges, hz, result.matches or None)
    expected = predicted_run(view.protocol, run).get(SEPARATION.name)
    gap_u = 2.0 * expected.u / abs(expected.value) if expected and expected.value else 0.0
    speed = speed_picture(view, job)
    pictures = fall_pictures(falls, None if skew is None else skew.value, gap_u)
    return pictures if speed is None else [*pictures, speed]


def laid_over(view: SessionView, jobs: Sequence[Job], job: Job) -> Picture | None:
    """Draw Δz(t) of several drops over each other, as if let go together, one above the others.

    `None` where nothing of it was measured. Of very many drops some are left out.
    """
    rest = [job_beside for job_beside in jobs[:: 1 + len(jobs) // _LAID] if job_beside != job]
    series: list[Series] = []
    for drop in (*rest, job):
        apart = None
        if RELEASE_SKEW.name in view.results[drop].quantities:
            apart = next(iter(drop_pictures(view, drop)), None)
        if apart is None:
            continue
        *_, model, dots = apart.series
        if drop == job:
            series += [model, dots._replace(label=f"run {job.run}")]
        else:
            label = f"{len(rest)} others" if not series else ""
            series.append(dots._replace(color="foreground", marker="·", label=label))
    return Picture("Δz corrected (cm)", _TIME, tuple(series)) if series else None


def _bars(points: Sequence[Point], color: str, mark: str, label: str = "") -> Series:
    """Draw values with their U95."""
    x, y, errors = zip(*points, strict=True) if points else ((), (), ())
    return Series("bars", x, y, color, mark, label, errors)


def inclined(analysis: Analysis, curves: Mapping[str, Any]) -> list[Picture]:
    """Draw Δz and V against inclination beside the model: the paper's Fig. 3, growing.

    Parameters
    ----------
    curves
        The model, as `rig.analysis.curves.model_curves` gives it.
    """
    pictures = []
    for row in averaged():
        name = row.name
        if curves.get(name) is None:
            continue
        runs = [
            (drop.run.incline_deg, *_point(drop.quantities[name], row.scale))
            for drop in analysis.runs
            if drop.verdict in GOOD and name in drop.quantities
        ]
        means = [
            (line.incline_deg, line.means[name], line.predicted.get(name))
            for line in analysis.summary
            if name in line.means
        ]
        bars = [(incline, *_point(mean, row.scale)) for incline, mean, _ in means]
        off = [
            (incline, (mean.value - model.value) * row.fine_scale, mean.expanded * row.fine_scale)
            for incline, mean, model in means
            if model is not None
        ]
        dots = _bars(runs, "secondary", "·", "runs")._replace(kind="dots", errors=())
        series = (*_model_lines(curves, name, row.scale), dots,
                  _bars(bars, "primary", "●", "mean ± U"))  # fmt: skip
        pictures.append(
            Picture(f"{row.label} ({row.unit})", "incline (°)", series,
                    residuals=(_bars(off, "primary", "●"),),
                    residual_label=f"means − model ({row.fine})")
        )  # fmt: skip
    return pictures


def _model_lines(curves: Mapping[str, Any], name: str, scale: float) -> Iterator[Series]:
    """One line, or one for each of two unlike chains."""
    incline_deg = np.array(curves["incline_deg"], dtype=np.float64)
    values = np.array(curves[name], dtype=np.float64) * scale  # none is nan
    chains = np.array([segment.partition(", ")[2] for segment in curves["segments"]])
    for chain in dict.fromkeys(chains.tolist()):
        label = f"model, {chain}" if chain else "model"
        part = chains == chain
        yield Series("line", incline_deg[part], values[part], "accent", label=label)


def control_pictures(view: SessionView) -> list[Picture]:
    """Draw the control charts: of skew with its limits, and of gravity beside the expected one.

    Returns
    -------
    list of Picture
        Those of quantities that this scene has.
    """
    runs = view.analysis.runs
    pictures = []
    if view.protocol.two_chains:
        row = RELEASE_SKEW
        limit = view.protocol.accept.release_skew * row.scale
        levels = ((0.0, "foreground", ""), (limit, "warning", f"limit ±{limit:g}"),
                  (-limit, "warning", ""))  # fmt: skip
        skews = [(drop, drop.quantities.get(row.name)) for drop in runs]
        pictures.append(_chart(f"{row.label} ({row.unit})", view, levels, skews, row.scale))
    gravities = [(drop, _gravity(drop)) for drop in runs]
    if any(gravity for _, gravity in gravities):
        expected = ((view.protocol.gravity.value, "accent", "protocol"),)
        label = "g in free fall" if view.protocol.track is None else "a along the track"
        pictures.append(_chart(f"{label} (m/s²)", view, expected, gravities))
    return pictures


def meaning(label: str) -> str:
    """Say in a line what a control chart is read for."""
    if label.startswith(RELEASE_SKEW.label):
        return (
            "skew: how much later the free chain was released; beyond the limit a drop is void; "
            "a drift means that a release wears"
        )
    if label.startswith("a "):
        return "a: acceleration along the track, with friction; the line is without friction"
    return (
        "g: gravity from each free fall; if the bars miss the protocol's value, check heights "
        "and clock"
    )


def _point(measured: Measured, scale: float = 1.0) -> tuple[float, float]:
    """Value and U95."""
    return measured.value * scale, measured.expanded * scale


def _gravity(drop: DropResult) -> Measured | None:
    row = acceleration_in(drop.quantities)
    return drop.gravity if row is None else drop.quantities[row.name]


def _chart(
    title: str,
    view: SessionView,
    levels: Sequence[tuple[float, str, str]],
    values: Sequence[tuple[DropResult, Measured | None]],
    scale: float = 1.0,
) -> Picture:
    """Draw one number a run, with U95, in order of the runs."""
    ends = (0.5, len(view.plan) + 0.5)
    series = [Series("line", ends, (level, level), color, label=label)
              for level, color, label in levels]  # fmt: skip
    for counts, color, mark, label in ((True, "primary", "●", "counts ± U"),
                                       (False, "error", "×", "void")):  # fmt: skip
        points = [
            (drop.run.number, *_point(value, scale))
            for drop, value in values
            if value and (drop.verdict in GOOD) is counts
        ]
        bars = _bars(points, color, mark, label)
        if len(values) > _WITH_BARS:
            bars = bars._replace(kind="dots", label=label.removesuffix(" ± U"), errors=())
        series.append(bars)
    limits = 0.5, len(view.plan) + 0.5
    return Picture(title, "run", tuple(series), limits, counts=True)


def speed_picture(view: SessionView, job: Job) -> Picture | None:
    """Draw V(t) by the model, a step for each rod that strikes, and what was measured at its end.

    `None` where no chain strikes, or the model has no answer.
    """
    run = view.plan[job.run]
    fall = model_fall(view.protocol, run, "impact") if run.impact is not None else None
    if fall is None or fall.hits is None:
        return None
    end = float(fall.time[-1])
    times = np.linspace(0.0, end, _STEPS)
    series = [Series("line", times * 1e3, fall.heights(times)[1], "accent", label="model")]
    free = model_fall(view.protocol, run, "free")
    if free is not None:
        series.append(Series("line", times * 1e3, free.heights(times)[1], "secondary",
                             label="free fall"))  # fmt: skip
    measured = view.results[job].quantities.get(SPEED.name)
    if measured is not None:
        series.append(Series("bars", [end * 1e3], [measured.value], "primary", "●", "measured ± U",
                             [measured.expanded]))  # fmt: skip
    return Picture("V (m/s)", "t (ms)", tuple(series), (0.0, 1e3 * (end + _BEFORE_S)))
