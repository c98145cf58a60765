"""The paper's figures, drawn anew from its equations."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from rig.measurands import SEPARATION, SPEED
from rig.model import paper
from rig.model.fall import free_fall_speed
from rig.report.figure import Chart, Panel, PlotAxis, series
from rig.report.looks import INK, MODEL, MUTED, SECOND

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from rig.report.figure import Role, Trace

    Columns = Mapping[str, list[float]]
    _Kind = tuple[Callable[[], dict[str, list[float]]], Callable[[Columns, Columns], list[Panel]]]

_INCLINE = PlotAxis("incline of the surface (°)")
_NO_LINE = "No line from just above 0° to arctan μ = 11.3°: the rods would not slide there."
_centimetres = partial(series, scale=100.0)


def paper_figure(
    number: int, resolved: Columns | None = None
) -> tuple[Chart, dict[str, list[float]]]:
    """Draw one of the paper's figures.

    Parameters
    ----------
    number
        3 (Δz and V against inclination), 4 (height against V²) or 6 (against rod inertia).
    resolved
        What falls in the resolved world give for it, to be drawn too; see
        `rig.bench.resolved_paper`. Of figures 3 and 4 only.

    Returns
    -------
    figure, columns
        The figure, with what the text says of it and the equations do not below it; and its
        numbers.
    """
    compute, draw = _KINDS[number]
    columns = compute()
    claims = [claim for claim in paper.claims() if claim.figure == number]
    foot = [
        *([_NO_LINE] if number == 3 else []),
        "Where the paper's text and its equations differ:",
        *(f"· {claim.text}; equations: {claim.equations}" for claim in claims),
    ]
    title = f"Figure {number} of the paper, from its equations"
    return Chart(title, title, draw(columns, resolved or {}), foot=foot), columns


def _figure_3(columns: Columns, resolved: Columns) -> list[Panel]:
    """Δz above, V below; of resolved falls the means with their standard deviations."""
    panels = []
    for row in (SEPARATION, SPEED):
        traces = [*_inclines(columns, row.name, row.scale)]
        if resolved:
            words = f"{resolved['falls'][0]:g} resolved falls ± SD"
            traces.append(
                series(
                    words,
                    resolved["incline_deg"],
                    resolved[row.name],
                    "square",
                    u=resolved[row.key("sd")],
                    scale=row.scale,
                )
            )
        panels.append(Panel(_INCLINE, PlotAxis(row.axis), traces, 150.0))
    speed = free_fall_speed(paper.UNIFORM, paper.DROP, paper.GRAVITY)
    in_text = paper.TEXT_FREE_FALL_SPEED
    traces += [
        series(f"free fall in the text, {in_text:.2f} m/s", (), (in_text,), "limit", SECOND),
        series("free fall by the equations", (), (speed,), "limit", MUTED),
    ]
    return panels


def _inclines(columns: Columns, name: str, scale: float) -> Iterator[Trace]:
    for pile, words in ((0.0, "rods on the surface"), (1.0, "on a pile")):
        rows = [row for row, flag in enumerate(columns["pile"]) if flag == pile]
        inclines, values = ([columns[key][row] for row in rows] for key in ("incline_deg", name))
        # The rods do not slide between level and arctan μ: no line across.
        start = 1 if not pile and inclines[0] == 0.0 else 0
        if start:
            yield series("", inclines[:1], values[:1], "mean", MODEL, scale=scale)
        role: Role = "dash" if pile else "line"
        yield series(words, inclines[start:], values[start:], role, MODEL, scale=scale)


def _figure_4(columns: Columns, resolved: Columns) -> list[Panel]:
    """Height against V², with the separation at the end; the paper's own point is hollow."""
    end, measured = columns["free_speed2"][-1], paper.MEASURED_GRADED_SEPARATION
    traces = [
        *_falls(columns, "strikes the surface at 40°", "falls freely", MODEL),
        _centimetres("Δz = 17 cm measured", [end], [measured], "ring", SECOND),
        *(_falls(resolved, "resolved rods, one fall", "", SECOND) if resolved else ()),
    ]
    return [Panel(PlotAxis("V² (m²/s²)"), PlotAxis("height of the top rod (cm)"), traces, 170.0)]


def _falls(columns: Columns, struck: str, free: str, color: int) -> Iterator[Trace]:
    yield _centimetres(struck, columns["speed2"], columns["height_m"], "line", color)
    yield _centimetres(
        free, columns["free_speed2"], columns["free_height_m"], "dash", INK if free else color
    )


def _figure_6(columns: Columns, _: Columns) -> list[Panel]:
    """Against ξ, with the closed forms beside the discrete model."""
    axis = PlotAxis("rotational inertia of the rods, ξ (uniform rods: 1/3)")
    inertia = columns["inertia"]
    return [
        Panel(
            axis,
            PlotAxis(row.axis),
            [
                series(
                    "discrete model", inertia, columns[row.name], "line", MODEL, scale=row.scale
                ),
                series(
                    f"Eq. {number}",
                    inertia,
                    columns[f"eq{number}_{row.name}"],
                    "dash",
                    scale=row.scale,
                ),
            ],
            130.0,
        )
        for row, number in ((SEPARATION, 15), (SPEED, 14))
    ]


_KINDS: dict[int, _Kind] = {
    3: (paper.figure_3, _figure_3),
    4: (paper.figure_4, _figure_4),
    6: (paper.figure_6, _figure_6),
}
