"""Figure of a sweep: curves along a parameter, or maps over two."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from rig.arrays import Array
from rig.measurands import SEPARATION, SPEED, Measurand
from rig.reasons import rig_error
from rig.report.figure import WIDE_PT, Chart, Trace, chart
from rig.report.looks import INK, MUTED
from rig.report.templates import render
from rig.sweep.compute import PILE, Swept
from rig.sweep.layout import Layout
from rig.sweep.variables import VARIABLES

_LEVELS = 7
_SPAN = 0.995
"""Share of the values within the levels: near a singular Eq. 13 speeds are unbounded."""


def check_drawable(layout: Layout) -> None:
    """Refuse a layout of which there is no figure.

    Raises
    ------
    InputError
        Inclines side by side, or more than two axes.
    """
    if layout.layered:
        inclines = [f"{value:g}" for value in layout.values["incline"]]
        raise rig_error("sweep_of_inclines", inclines=", ".join(inclines), last=inclines[-1])
    if len(layout.axes) > 2:
        raise rig_error("sweep_of_axes", axes=len(layout.axes))


def sweep_figure(facts: Mapping[str, Any], layout: Layout, swept: Swept) -> Chart:
    """Return the figure of a sweep of one axis or two.

    Parameters
    ----------
    facts
        Provenance: named below the figure, and complete in the file's metadata.
    layout, swept
        Axes and values of the sweep; the first of two axes is horizontal.

    Returns
    -------
    Chart
        Points without a solution are empty; outside the model's domain lines are dashed. Levels
        cover the values inside the domain.
    """
    rows = (SEPARATION, SPEED) if layout.two_chains else (SPEED,)
    panels = (_panel(row, layout, swept) for row in rows)
    labels = {variable.column: variable.label for variable in VARIABLES.values()}
    foot = str(render("sweep.txt", facts=facts, labels=labels)).split("\n")
    kind = "map" if len(layout.axes) > 1 else "sweep"
    figure = chart(kind, *panels, title=facts["title"])
    record = json.dumps(facts, ensure_ascii=False)
    return replace(figure, caption=foot[-1], foot=foot, width=WIDE_PT, facts=record)


def _panel(row: Measurand, layout: Layout, swept: Swept) -> dict[str, Any]:
    """Return a quantity along an axis, or as a map with an axis for its levels."""
    values: Array = getattr(swept, row.name)
    axes: dict[str, Any] = {"row": row}
    for name, (varied, numbers) in zip("xy", layout.axes.items(), strict=False):
        axes[name] = VARIABLES[varied].label
        axes[f"{name}_axis"] = {"limits": (numbers[0], numbers[-1])}
    if "y" in axes:
        return {**axes, "traces": _map(row, layout, values, swept)}
    # The step from the pile to the surface belongs to neither curve.
    piled = (swept.notes & PILE) > 0
    curves = (np.where(piled == below, values, np.nan) for below in (False, True))
    parts = [{"whole": part, "inside": np.where(swept.in_domain, part, np.nan)} for part in curves]
    return {**axes, "places": next(iter(layout.axes.values())), "parts": parts}


def _map(row: Measurand, layout: Layout, values: Array, swept: Swept) -> Iterator[Trace]:
    """Yield the map, and its levels inside the model's domain."""
    across, up = map(list, layout.axes.values())
    whole = row.scale * values.T
    inside = np.where(swept.in_domain.T, whole, np.nan)
    shown = inside[np.isfinite(inside)]
    shown = shown if shown.size else whole[np.isfinite(whole)]
    if shown.size:
        ends = np.quantile(shown, (1.0 - _SPAN, _SPAN))
        levels = [float(level) for level in MaxNLocator(_LEVELS).tick_values(*ends)]
        yield Trace("", across, up, "map", MUTED, levels, z=whole.ravel().tolist())
        yield Trace("", across, up, "levels", INK, levels, z=inside.ravel().tolist())
