"""A sweep as a picture: curves along one parameter, or maps over two."""

from __future__ import annotations

import json
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.measurands import SEPARATION, SPEED
from rig.report.canvas import CAPTION, INK, MODEL, MODEL_BAND, MUTED, PASSES, SIZE, canvas
from rig.sweep.compute import PILE
from rig.sweep.variables import VARIABLES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage

    from rig.model.batch import Flags, Floats
    from rig.report.canvas import Canvas
    from rig.sweep.compute import Swept
    from rig.sweep.layout import Axis, Layout

_WRAP = 96


def sweep_figure(facts: Mapping[str, Any], layout: Layout, swept: Swept) -> Canvas:
    """Draw a sweep.

    Parameters
    ----------
    facts
        Its provenance: named below the picture, and whole in the file's metadata.
    layout, swept
        With one axis or two; the first of two goes to the right.

    Returns
    -------
    Canvas
        Where the model has no answer the picture is empty; where the point lies beyond its
        domain, maps are hatched and curves dashed. Colours span what is found inside the domain.
    """
    flat = len(layout.grid.axes) == 2
    shown = [(SEPARATION, swept.separation_m)] if layout.two_chains else []
    shown += [(SPEED, swept.speed_m_s)]
    with canvas(
        (3.4,) if flat else (2.9,) * len(shown),
        9.0 if flat and len(shown) > 1 else 7.0,
        simulated=False,
        columns=len(shown) if flat else 1,
        description=json.dumps(facts, ensure_ascii=False),
        caption=_caption(facts),
        caption_look={**CAPTION, **PASSES},
    ) as drawing:
        panels = drawing.axes
        for panel, (row, found) in zip(panels, shown, strict=True):
            if flat:
                image = _map(panel, layout.grid.axes, row.scale * found, swept.in_domain)
                drawing.figure.colorbar(image, ax=panel, label=row.axis)
            else:
                _curve(panel, layout.grid.axes[0], row.scale * found, swept)
                panel.set_ylabel(row.axis)
        panels[-1].set_xlabel(VARIABLES[layout.grid.axes[0].name].label)
    return drawing


def _caption(facts: Mapping[str, Any]) -> str:
    """Say in a few lines where the picture comes from."""
    labels = {one.column: one.label for one in VARIABLES.values()}
    fixed = "; ".join(_valued(labels[name], value) for name, value in facts["fixed"].items())
    lines = [
        f"{facts['title']}; chain {facts['chain']['name']}",
        f"fixed: {fixed or 'none'}",
        f"{facts['made_by']}; protocol SHA-256 {facts['protocol_sha256'][:16]}…",
        "hatched or dashed: outside the model's domain; empty: the model has no answer",
    ]
    return "\n".join(textwrap.fill(line, _WRAP) for line in lines)


def _valued(label: str, value: float) -> str:
    """Write a parameter as its axis would name it: ``drop = 0.18 m``."""
    name, _, unit = label.partition(" (")
    return f"{name} = {value:g} {unit.removesuffix(')')}".rstrip().replace(" °", "°")


def _curve(panel: Axes, axis: Axis, values: Floats, swept: Swept) -> None:
    for piled in (False, True):
        # The step from the pile to the surface is no part of either curve.
        part = np.where(((swept.notes & PILE) > 0) == piled, values, np.nan)
        panel.plot(axis.values, part, "--", color=MUTED, linewidth=1.2)
        panel.plot(axis.values, np.where(swept.in_domain, part, np.nan), color=MODEL)
    panel.margins(x=0.0)


def _map(panel: Axes, axes: tuple[Axis, ...], values: Floats, inside: Flags) -> AxesImage:
    from matplotlib.colors import LinearSegmentedColormap  # noqa: PLC0415 - see canvas
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415

    across, up = axes
    found = np.isfinite(values)
    # Next to a singular Eq. 13 speeds have no bound, and nothing else would show a difference.
    scale = values[inside] if inside.any() else values[found]
    low, high = (float(scale.min()), float(scale.max())) if scale.size else (0.0, 1.0)
    image = panel.imshow(
        values.T,
        origin="lower",
        aspect="auto",
        extent=(*_sides(across), *_sides(up)),
        interpolation="none",
        vmin=low,
        vmax=high,
        cmap=LinearSegmentedColormap.from_list("model", [MODEL_BAND, MODEL]),
    )
    outside = found & ~inside
    if outside.any():
        hatched = panel.contourf(
            across.values, up.values, outside.T, levels=[0.5, 1.5], colors="none", hatches=["////"]
        )
        hatched.set_edgecolor(MUTED)
        hatched.set_linewidth(0.0)
    levels = [level for level in MaxNLocator(7).tick_values(low, high) if low < level < high]
    if levels:
        lines = panel.contour(
            across.values, up.values, values.T, levels=levels, colors=INK, linewidths=0.5
        )
        panel.clabel(lines, fontsize=SIZE)
    panel.grid(visible=False)
    panel.set_xlabel(VARIABLES[across.name].label)
    panel.set_ylabel(VARIABLES[up.name].label)
    return image


def _sides(axis: Axis) -> tuple[float, float]:
    """Return where an axis begins and ends so that each value is the middle of its cell."""
    half = (axis.values[1] - axis.values[0]) / 2.0
    return axis.values[0] - half, axis.values[-1] + half
