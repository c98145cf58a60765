"""Drawing of figures with matplotlib, with labels beside the series, for files and pages."""

import io
import re
import textwrap
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from html import escape
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rig.arrays import Array
from rig.ctrl_c import ctrl_c_waits
from rig.report.canvas import Kind
from rig.report.figure import Chart, Panel, Trace
from rig.report.looks import COLORS, INK, MODEL, PAPER, SECOND, SIZE

_LETTER, _TYPED = 0.57 * SIZE, 0.61 * SIZE
"""Mean width of the digits and letters of the fonts in question, and those of a typewriter."""
_LINE = 1.25 * SIZE
_GAP_PT, _RIGHT_PT, _NEAR_PT = 8.0, 9.0, 4.0
_DIGITS = 6  # most digits of numbers on an axis
_PLACES = 16  # candidate positions of a label along a series
_CROWDED = 500  # cost of touching another label, in hidden points
_AWAY, _FAR_PT = (16.0, 24.0, 32.0, 40.0, 48.0, 56.0), 20.0
"""Distances of labels from a line, and the further distance worth a hidden point, points."""
_FAINT: dict[str, Any] = {"alpha": 0.2, "linewidth": 0.0}
_PAGE = (
    (r"<metadata>.*?</metadata>|<defs>\s*<style.*?</defs>|<!--.*?-->", ""),
    (r'(<svg[^>]*?) width="[^"]*" height="[^"]*"', r"\1"),
    (r'<g id="[^"]*"', "<g"),
    (r" ?(font: |font-family|font-size)[^;\"]*;?|\n *", " "),
    (r' transform="rotate\(-0 [^"]*"|<g */>', ""),
    (r">\s+<", "><"),
)
"""What SVG has that a page with its own style sheet does not need."""
_UNSAID: dict[Kind, tuple[str, ...]] = {
    "svg": ("Date", "Creator", "Format", "Type"),
    "png": ("Software",),
    "pdf": ("Creator", "Producer", "CreationDate"),
}
_AREAS = ("bar", "band", "map", "levels")
_LINES = ("line", "dash", "level", "limit")
_LOOKS = tomllib.loads(Path(__file__).with_name("roles.toml").read_text("utf-8"))
_LOOKS["ring"]["markerfacecolor"] = COLORS[PAPER][0]


@contextmanager
def style() -> Iterator[None]:
    """Apply the common style of figures inside the block, and defer Ctrl-C."""
    with ctrl_c_waits(), mpl.rc_context(fname=Path(__file__).with_suffix(".mplstyle")):
        yield


def plot(chart: Chart, width: float | None = None) -> Figure:
    """Return a figure drawn with a width in points, by default its own."""
    width = width or chart.width
    letters = int(width / _TYPED)
    foot = [
        line.replace("  ", "\u00a0\u00a0")
        for words in chart.foot
        for line in textwrap.wrap(words, letters, drop_whitespace=len(words) > letters) or [""]
    ]
    panels = chart.panels
    shared = [panel.x == follower.x for panel, follower in pairwise(panels)]
    below = [_GAP_PT if joined else _GAP_PT + 2.6 * _LINE for joined in shared]
    below.append((3 + len(foot)) * _LINE)
    top = sum(below) + sum(each.height for each in panels)
    height = top + (1 + chart.simulated) * _LINE
    left = max(
        _LINE * (1.5 + panel.y.label.count("\n"))
        + _LETTER * max([_DIGITS, *map(len, panel.y.names.values())])
        for panel in panels
    )
    with style():
        figure = Figure(figsize=(width / 72.0, height / 72.0), dpi=72.0)
        stamp = "SIMULATED DATA" if chart.simulated else ""
        figure.text(0.995, 1.0, stamp, ha="right", va="top", color=COLORS[SECOND][0])
        figure.text(0.005, 4.0 / height, "\n".join(foot), va="bottom", family="monospace")
        for panel, gap, joined in zip(panels, below, [*shared, False], strict=True):
            top -= panel.height
            box = left, top, width - left - _RIGHT_PT, panel.height
            axes = figure.add_axes(tuple(np.array(box) / (width, height, width, height)))
            top -= gap
            before = zip(figure.axes[:-1], panels, strict=False)
            for other in [other for other, earlier in before if earlier.x == panel.x][:1]:
                axes.sharex(other)
            _set_up(axes, panel, numbered=not joined)
            for trace in panel.series:
                _draw(axes, trace)
            axes.autoscale_view()
            if panel.whole and np.ptp(axes.get_xlim()) < 1.0:
                axes.margins(x=10.0)  # for a single run
        for panel, axes in zip(panels, figure.axes, strict=True):
            _name_series(axes, panel)
    return figure


def drawing_file(drawing: Figure, kind: Kind, description: str = "") -> bytes:
    """Return a matplotlib figure as a file; the same figure gives the same bytes.

    Parameters
    ----------
    description
        Description for the file's metadata.
    """
    written = io.BytesIO()
    metadata: dict[str, Any] = dict.fromkeys(_UNSAID[kind])
    metadata["Subject" if kind == "pdf" else "Description"] = description
    with style():
        drawing.savefig(written, format=kind, metadata=metadata)
    return written.getvalue()


def page_svg(chart: Chart, width: float, kind: str, mark: str = "f") -> str:
    """Return SVG for a page, with a class, unique ids and the page's colours."""
    svg = drawing_file(plot(chart, width), "svg").decode()
    svg = svg[svg.index("<svg") :]
    for pattern, words in _PAGE:
        svg = re.sub(pattern, words, svg, flags=re.DOTALL)
    # One decimal, and no space where a letter separates numbers.
    terse = partial(re.sub, r"(\.\d)\d+| +(?=[A-Zz])|(?<=[A-Z]) +", r"\1")
    svg = re.sub(r"<[^>]*>", lambda tag: terse(tag[0]), svg)
    # Make ids unique: two figures have the same ids, and one may be hidden.
    svg = re.sub(r'(id="|href="#|url\(#)', rf"\g<1>{mark}-", svg)
    rules = ""
    for number, look in enumerate(sorted(set(re.findall(r' style="([^"]*)"', svg)))):
        svg = svg.replace(f' style="{look}"', f' class="{mark}-{number}"')
        rules += f".{mark}-{number}{{{look}}}"
    svg = svg.replace(">", f"><style>{rules}</style>", 1)
    for number, (light, _) in enumerate(COLORS):
        svg = svg.replace(light, f"var(--c{number})")
    return svg.replace(
        "<svg ", f'<svg class="{kind}" role="img" aria-label="{escape(chart.title)}" ', 1
    )


def _set_up(axes: Axes, panel: Panel, *, numbered: bool) -> None:
    """Set limits, ticks and labels of both axes."""
    for axis, about in ((axes.xaxis, panel.x), (axes.yaxis, panel.y)):
        integer = panel.whole and about is panel.x
        axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10], integer=integer))
        if about.names:
            axis.set_ticks([*about.names], [*about.names.values()])
        if about.limits is not None:
            axes.set(**{f"{axis.axis_name}lim": about.limits})
    axes.set(xlabel=panel.x.label if numbered else "", ylabel=panel.y.label)
    axes.tick_params(axis="x", labelbottom=numbered, bottom=numbered)
    axes.grid(visible=not panel.y.names, axis="y")
    axes.set_aspect("equal" if panel.true else "auto")


def _draw(axes: Axes, trace: Trace) -> None:
    x, y, u = (np.array(values, float) for values in (trace.x, trace.y, trace.u))
    color, look = COLORS[trace.color][0], _LOOKS.get(trace.role, {})
    match trace.role:
        case "level" | "limit":
            for value in trace.y:
                axes.axhline(value, color=color, **look)
        case "shade":
            axes.axhspan(*trace.y, color=color, **_FAINT)
        case "gap":
            axes.axvspan(*trace.x, color=color, **_FAINT)
        case "band":
            axes.fill_between(x, y - u, y + u, color=color, **_FAINT)
        case "bar":
            axes.barh(y, x - trace.base, 0.72, trace.base, color=color)
        case "map" | "levels":
            _draw_map(axes, trace)
        case "words" | "cross":  # texts do not affect the scale of y
            cross = trace.role == "cross"
            side, words = (
                ("center", "×") if cross else ("left" if x[0] > 0 else "right", trace.label)
            )
            for place in zip(x, y, strict=True):
                axes.text(*place, words, ha=side, va="center", color=color, clip_on=cross)
            axes.update_datalim(np.column_stack((x, y)), updatex=cross, updatey=False)
        case _:
            options: dict[str, Any] = {"linestyle": "none"} if "marker" in look else {}
            if u.size:
                options |= {"xerr" if trace.across else "yerr": u, "elinewidth": 0.9}
            axes.errorbar(x, y, color=color, **options, **look)


def _draw_map(axes: Axes, trace: Trace) -> None:
    x, y, levels = (np.array(values, float) for values in (trace.x, trace.y, trace.u))
    grid = np.ma.masked_invalid(np.reshape(trace.z, (y.size, x.size)))
    style: dict[str, Any] = {"colors": COLORS[trace.color][0], "linewidths": 0.9}
    if trace.role == "map":
        shades = LinearSegmentedColormap.from_list("", [COLORS[PAPER][0], COLORS[MODEL][0]])
        axes.contourf(x, y, grid, levels, extend="both", cmap=shades, alpha=0.6)
        style |= {"linestyles": "dashed"}
    levels = levels[(grid.min() < levels) & (levels < grid.max())] if grid.count() else levels[:0]
    if levels.size:
        lines = axes.contour(x, y, grid, levels, **style)
        if trace.role == "levels":
            axes.clabel(lines, fontsize=SIZE)


def _name_series(axes: Axes, panel: Panel) -> None:
    """Write each series' label beside it, where it hides least."""
    lines = (trace for trace in panel.series if trace.y and trace.role not in _AREAS)
    taken = np.vstack([np.empty((0, 2)), *(_shown(axes, trace) for trace in lines)])
    left, bottom, right, top = axes.bbox.extents
    names = np.empty((0, 4))
    for trace in panel.series:
        if not trace.label or not trace.y or trace.role == "words":
            continue
        bar, places = trace.role == "bar", _shown(axes, trace)
        wide = len(trace.label) * _LETTER
        rows = [-4.0 - row * _LINE for row in range(1, 5)] if bar else [3.0, -SIZE - 2.0, -3.0]
        if trace.role in {"level", "limit"}:  # among bars, a label may be away from its line
            rows += [(2 * up - 1) * away for away in _AWAY for up in (0, 1)]
        offsets = [(dx, dy) for dy in rows for dx in (-wide / 2, 5.0, -wide - 5.0)]
        step = slice(None, None, max(1, len(places) // _PLACES))
        corners = (places[step, None] + offsets).reshape(-1, 2)
        low, high = np.subtract(corners, (0.0, 2.0)), np.add(corners, (wide, SIZE))
        inside = (low[:, 0] >= left) & (high[:, 0] <= right + 6.0) & (high[:, 1] <= top + 4.0)
        if not inside.any():
            continue
        hidden = _meet(low - 1.0, high + 1.0, taken, taken)
        crowded = _meet(low, high, names[:, :2], names[:, 2:]) + (low[:, 1] < bottom)
        far = np.abs(corners[:, 1] - np.repeat(places[step, 1], len(offsets))) / _FAR_PT
        best = np.argmin(np.where(inside, hidden + far + _CROWDED * crowded, np.inf))
        apart = _LETTER, 0.0
        names = np.vstack((names, [*low[best] - apart, *high[best] + apart]))
        place = axes.transData.inverted().transform(corners[best])
        color = COLORS[INK if bar else trace.color][0]
        axes.annotate(trace.label, tuple(place), color=color, annotation_clip=False)


def _meet(low: Array, high: Array, starts: Array, ends: Array) -> Any:
    """Return the number of other boxes that each box overlaps."""
    across, up = np.moveaxis((low[:, None] < ends) & (starts < high[:, None]), 2, 0)
    return (across & up).sum(axis=1)


def _shown(axes: Axes, trace: Trace) -> Array:
    """Return closely spaced points along a series, in drawing coordinates."""
    x, y, u = (np.array(values, float) for values in (trace.x, trace.y, trace.u))
    if trace.role == "bar":
        x, y = (x + trace.base) / 2, y - 0.36
    elif not x.size:
        x, y = np.array(axes.get_xlim()), np.full(2, y.max())
    if u.size and trace.role != "band":
        ends = np.linspace(-1.0, 1.0, 9)[:, None] * u
        x, y = np.ravel(x + ends * trace.across), np.ravel(y + ends * (not trace.across))
    low, high = axes.get_ylim()
    points: Array = axes.transData.transform(np.column_stack([x, y]))
    points = points[(low <= y) & (y <= high) & np.isfinite(x)]
    if trace.role not in _LINES or len(points) < 2:
        return points
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
    places = np.arange(0.0, along[-1], _NEAR_PT)
    return np.column_stack([np.interp(places, along, column) for column in points.T])
