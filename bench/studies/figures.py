"""Pictures of what the studies of falls and their analysis found."""

from __future__ import annotations

from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from rig.bench.figures import INK, MODEL, MUTED, PAPER, SECOND, canvas
from rig.report.canvas import drawing_file

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.figure import Figure

_ESTIMATOR_PANELS = (("separation_rms_m", 1e3, "rms error of Δz (mm)"),
           ("speed_rms_m_s", 1e3, "rms error of V (mm/s)"))  # fmt: skip
_ROW_IN = 0.17
_LONGEST_LABEL = 24
"""Characters; more gates than that are only counted."""
_VOID_DARKEST = 0.2
"""Share of void drops from which on a layout is drawn as dark as can be."""
_SHADES = "Oranges"
_STYLES = (("o", MUTED), ("s", INK), ("D", MODEL), ("*", SECOND), ("^", MUTED), ("v", INK))


def estimators_figure(found: Sequence[Mapping[str, Any]]) -> str:
    """Draw them; what takes no processor time is a line across.

    Parameters
    ----------
    found
        ``estimators`` of ``./run bench estimators --json``.

    Returns
    -------
    str
        SVG.
    """
    with canvas(3.2, 3.0) as drawing:
        for axes, (field, scale, label) in zip(drawing.axes, _ESTIMATOR_PANELS, strict=True):
            styles = iter(_STYLES)
            for name, group in groupby(found, key=itemgetter("name")):
                points = list(group)
                values = [one[field] * scale for one in points]
                if points[0]["seconds"] is None:
                    axes.axhline(values[0], color=MUTED, linestyle=(0, (1, 2)), label=name)
                    continue
                marker, color = next(styles)
                times = [one["seconds"] or 0.0 for one in points]
                words = f"{name} (M = 10² …)" if points[0]["trials"] else name
                axes.plot(times, values, marker=marker, color=color, linewidth=0.9, label=words)
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_ylabel(label)
        drawing.axes[-1].set_xlabel("processor time per run (s)")
        drawing.axes[0].legend(ncols=2)
    return _stamped(drawing)


def layouts_figure(found: Sequence[Mapping[str, Any]]) -> str:
    """Draw the map of layouts: a row each, a column a disturbance, void and wrong side by side.

    Parameters
    ----------
    found
        ``layouts`` of ``./run bench layouts --json``.

    Returns
    -------
    str
        SVG.
    """
    columns = list(dict.fromkeys(one["disturbance"] for one in found))
    rows = list(dict.fromkeys((one["chain"], one["gates"], one["heights_mm"]) for one in found))
    # Whether wrong rods were accepted is a matter of some or none.
    panels = (
        ("void drops", "void_share", _VOID_DARKEST),
        ("good drops with a wrong rod", "wrong", 1.0),
    )
    with canvas(_ROW_IN * len(rows) + 0.6, width_in=8.0, columns=2, sharex=False) as drawing:
        for axes, (title, field, darkest) in zip(drawing.axes, panels, strict=True):
            values = [one[field] for one in found]
            table = [values[n : n + len(columns)] for n in range(0, len(values), len(columns))]
            axes.imshow(table, cmap=_SHADES, vmin=0.0, vmax=darkest, aspect="auto")
            for row, line in enumerate(table):
                for column, value in enumerate(line):
                    text = f"{value:.0%}" if field == "void_share" else f"{value:d}"
                    color = PAPER if value > 0.6 * darkest else INK if value else MUTED
                    axes.text(
                        column, row, text, ha="center", va="center", fontsize=6.5, color=color
                    )
            axes.set_xticks(range(len(columns)), columns)
            axes.set_yticks([])
            axes.set_title(title, fontsize=9.0)
            axes.grid(visible=False)
        labels = [
            f"{chain}: {heights if len(heights) <= _LONGEST_LABEL else gates}"
            for chain, gates, heights in rows
        ]
        drawing.axes[0].set_yticks(range(len(rows)), labels, fontsize=6.5)
    return _stamped(drawing)


def _stamped(drawing: Figure) -> str:
    """Say what it is in a strip of its own, where it hides nothing and nothing hides it; as SVG."""
    drawing.suptitle("SIMULATED DATA", x=0.995, ha="right", color=SECOND)
    return drawing_file(drawing, "svg").decode()
