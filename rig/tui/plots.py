"""What the plots show, as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.result import GOOD
from rig.measurands import RELEASE_SKEW, acceleration_in, averaged
from rig.tui.motion import motions, separation
from rig.tui.plotting import Picture, Series

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from rig.analysis.result import DropResult, Measured
    from rig.analysis.session import Analysis
    from rig.records import Job
    from rig.results.live import SessionView
    from rig.tui.motion import ChainFall, Table

_MARKS = {"impact": ("×", "primary"), "free": ("+", "secondary")}
_BEFORE_S = 0.02
_WITH_BARS = 40  # numbers in a chart: the bars of more stand in each other's way
_MOST = 300  # marks of a chain: more would stand on each other
_LAID = 12  # drops over each other
_TIME = "t (ms)"


def chain_pictures(
    found: tuple[ChainFall, ...], skew_s: float | None = None
) -> tuple[Picture | None, Picture | None]:
    """Draw z(t) of each chain and Δz(t), with the model's curves; `None` for what is not there.

    Parameters
    ----------
    found
        The chains of a drop.
    skew_s
        What was measured of the release: Δz is then that of chains let go together, or else as it
        fell; z(t) always is as it fell.
    """
    if not found:
        return None, None
    measured = [float(fall.times[-1]) for fall in found if fall.times.size]
    expected = [float(fall.model.time[-1]) for fall in found if fall.model is not None]
    end = max(0.0, *measured, *expected) + _BEFORE_S
    series, left, pair = [], [], len(found) > 1
    for one in found:
        times, heights = one.curve(end)
        series.append(Series("line", times * 1e3, heights * 1e2, "accent",
                             label=f"model, {one.role} side" if pair else "model"))  # fmt: skip
    for one in reversed(found):  # the struck chain above the free one
        mark, color = _MARKS[one.role]
        thin = slice(None, None, 1 + one.times.size // _MOST)
        times, heights = one.times[thin], one.heights[thin]
        series.append(Series("dots", times * 1e3, heights * 1e2, color, mark,
                             one.role if pair else "measured"))  # fmt: skip
        if one.model is not None and times.size:
            off = heights - one.model.heights(times - one.delay_s)[0]
            left.append(Series("dots", times * 1e3, off * 1e3, color, mark))
    limits = (0.0, end * 1e3)
    chains = Picture("z (cm) as it fell", _TIME, tuple(series), limits,
                     residuals=tuple(left), residual_label="minus model (mm)")  # fmt: skip
    if not pair:
        return chains, None
    gap = separation(found, end, skew_s)
    how = "as it fell" if skew_s is None else "corrected"
    off = gap.gaps - gap.expected if gap.expected.size else gap.expected
    apart = Picture(
        f"Δz {how} (cm)",
        _TIME,
        (
            Series("line", gap.curve * 1e3, gap.model * 1e2, "accent", label="model"),
            Series("dots", gap.times * 1e3, gap.gaps * 1e2, "success", "+", "measured"),
        ),
        limits,
        residuals=(Series("dots", gap.times[: off.size] * 1e3, off * 1e3, "success", "+"),),
        residual_label="minus model (mm)",
    )
    return chains, apart


def drop_pictures(
    view: SessionView, job: Job, edges: Table | None = None
) -> tuple[Picture | None, Picture | None]:
    """Draw a recorded drop, or its first `edges`, with rods and skew as the analysis found them."""
    result, hz = view.results[job], view.scales[job].hz
    skew = result.quantities.get(RELEASE_SKEW.name)
    found = motions(
        view.protocol,
        view.plan[job.run],
        view.drops[job].edges if edges is None else edges,
        hz,
        result.matches or None,
    )
    return chain_pictures(found, None if skew is None else skew.value)


def laid_over(view: SessionView, jobs: Sequence[Job], job: Job) -> Picture | None:
    """Draw Δz(t) of several drops over each other, as if let go together, one above the others.

    `None` where nothing of it was measured. Of very many drops some are left out.
    """
    others = [other for other in jobs[:: 1 + len(jobs) // _LAID] if other != job]
    curves: list[Series] = []
    for one in (*others, job):
        apart = (
            drop_pictures(view, one)[1]
            if RELEASE_SKEW.name in view.results[one].quantities
            else None
        )
        if apart is None:
            continue
        model, dots = apart.series
        if one == job:
            curves += [model, dots._replace(label=f"run {one.run}")]
        else:
            some = f"{len(others)} others" if not curves else ""
            curves.append(dots._replace(color="foreground", marker="·", label=some))
    title = "Δz corrected (cm)"
    return Picture(title, _TIME, tuple(curves)) if curves else None


def run_picture(view: SessionView, jobs: Sequence[Job], job: Job) -> Picture | None:
    """Draw what several drops measured, in order of the runs, one of them above the others."""
    row = next((row for row in averaged() if row.name in view.results[job].quantities), None)
    if row is None:
        return None
    points = {
        one: (one.run, *point)
        for one in jobs
        if (point := _point(view.results[one].quantities.get(row.name), row.scale))
    }
    others = [point for one, point in points.items() if one != job]
    mine = [point for one, point in points.items() if one == job]
    series = (_bars(others, "secondary", "●", "others ± U"),
              _bars(mine, "primary", "●", f"run {job.run} ± U"))  # fmt: skip
    return _over_runs(f"{row.label} ({row.unit})", view, series)


def _bars(points: Sequence[tuple[int, float, float]], color: str, mark: str, label: str) -> Series:
    """Draw run, value and U95 of several runs."""
    return Series("bars", [x for x, *_ in points], [y for _, y, _ in points], color, mark, label,
                  [u for *_, u in points])  # fmt: skip


def _over_runs(title: str, view: SessionView, series: Sequence[Series]) -> Picture:
    """Draw series over all runs of the plan."""
    count = len(view.plan)
    return Picture(title, "run", tuple(series), (0.5, count + 0.5), x_ticks=_whole(count))


def inclined(analysis: Analysis, curves: Mapping[str, Any]) -> list[Picture]:
    """Draw Δz and V against inclination beside the model: the paper's Fig. 3, growing.

    Parameters
    ----------
    curves
        The model, as `rig.analysis.curves.model_curves` gives it.
    """
    found = []
    runs = [one for one in analysis.runs if one.verdict in GOOD]
    for row in averaged():
        name, scale = row.name, row.scale
        curve = curves.get(name)
        if curve is None:
            continue
        dots = [
            (one.run.incline_deg, one.quantities[name].value * scale)
            for one in runs
            if name in one.quantities
        ]
        means = [line for line in analysis.summary if name in line.means]
        inclines = [line.incline_deg for line in means]
        bars = [line.means[name].expanded for line in means]
        beside = [line for line in means if name in line.predicted]
        off = [line.means[name].value - line.predicted[name].value for line in beside]
        found.append(
            Picture(
                f"{row.label} ({row.unit})",
                "incline (°)",
                (
                    *_model_lines(curves, name, scale),
                    Series("dots", [x for x, _ in dots], [y for _, y in dots],
                           "secondary", "·", "runs"),
                    Series("bars", inclines, [line.means[name].value * scale for line in means],
                           "primary", "●", "mean ± U", [bar * scale for bar in bars]),
                ),
                residuals=(
                    Series("bars", [line.incline_deg for line in beside],
                           [one * row.fine_scale for one in off], "primary", "●",
                           errors=[line.means[name].expanded * row.fine_scale for line in beside]),
                ),
                residual_label=f"means − model ({row.fine})",
            )
        )  # fmt: skip
    return found


def _model_lines(curves: Mapping[str, Any], name: str, scale: float) -> Iterator[Series]:
    """One line, or one for each of two unlike chains."""
    chains = [segment.partition(", ")[2] for segment in curves["segments"]]
    for chain in dict.fromkeys(chains):
        at = [n for n, one in enumerate(chains) if one == chain]
        yield Series(
            "line",
            [curves["incline_deg"][n] for n in at],
            np.array([curves[name][n] for n in at], dtype=np.float64) * scale,  # none is nan
            "accent",
            label=f"model, {chain}" if chain else "model",
        )


def control_pictures(view: SessionView) -> list[Picture]:
    """Draw the control charts: of skew with its limits, and of gravity beside the expected one.

    Returns
    -------
    list of Picture
        Those of quantities that this scene has.
    """
    runs = view.analysis.runs
    found = []
    if view.protocol.two_chains:
        row = RELEASE_SKEW
        limit = view.protocol.accept.release_skew * row.scale
        lines = ((0.0, "foreground", ""), (limit, "warning", f"limit ±{limit:g}"),
                 (-limit, "warning", ""))  # fmt: skip
        points = [(one, _point(one.quantities.get(row.name), row.scale)) for one in runs]
        found.append(_chart(f"{row.label} ({row.unit})", view, lines, points))
    points = [(one, _gravity(one)) for one in runs]
    if any(point for _, point in points):
        expected = ((view.protocol.gravity.value, "accent", "protocol"),)
        what = "g in free fall" if view.protocol.track is None else "a along the track"
        found.append(_chart(f"{what} (m/s²)", view, expected, points))
    return found


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


def _point(measured: Measured | None, scale: float = 1.0) -> tuple[float, float] | None:
    """Value and U95."""
    return None if measured is None else (measured.value * scale, measured.expanded * scale)


def _gravity(one: DropResult) -> tuple[float, float] | None:
    row = acceleration_in(one.quantities)
    return _point(one.gravity if row is None else one.quantities[row.name])


def _chart(
    title: str,
    view: SessionView,
    lines: Sequence[tuple[float, str, str]],
    points: Sequence[tuple[DropResult, tuple[float, float] | None]],
) -> Picture:
    """Draw one number a run, with U95, in order of the runs."""
    ends = (0.5, len(view.plan) + 0.5)
    series = [Series("line", ends, (level, level), color, label=label)
              for level, color, label in lines]  # fmt: skip
    for counts, color, mark, label in ((True, "primary", "●", "counts ± U"),
                                       (False, "error", "×", "void")):  # fmt: skip
        some = [
            (one.run.number, *point)
            for one, point in points
            if point and (one.verdict in GOOD) is counts
        ]
        drawn = _bars(some, color, mark, label)
        if len(points) > _WITH_BARS:
            drawn = drawn._replace(kind="dots", label=label.removesuffix(" ± U"), errors=())
        series.append(drawn)
    return _over_runs(title, view, series)


def _whole(count: int) -> list[float]:
    """At most about eight whole numbers up to a count."""
    step = next(step for step in (1, 2, 5, 10, 20, 50, 100, 200, 500, 10**9) if count <= 8 * step)
    return [float(number) for number in range(max(1, step), count + 1, step)]
