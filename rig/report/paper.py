"""The paper's figures, drawn anew from its equations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.measurands import SEPARATION, SPEED
from rig.model import paper
from rig.model.fall import free_fall_speed
from rig.report.figure import Chart, Panel, PlotAxis, Trace
from rig.report.looks import INK, MODEL, MUTED, SECOND

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    Columns = Mapping[str, list[float]]
    _Kind = tuple[Callable[[], dict[str, list[float]]], Callable[[Columns, Columns], list[Panel]]]

_INCLINE = PlotAxis("incline of the surface (°)")
_NO_LINE = "No line from just above 0° to arctan μ = 11.3°: the rods would not slide there."


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
    foot = [_NO_LINE] if number == 3 else []
    foot.append("Where the paper's text and its equations differ:")
    foot += [
        f"· {claim.text}; equations: {claim.equations}"
        for claim in paper.claims()
        if claim.figure == number
    ]
    title = f"Figure {number} of the paper, from its equations"
    return Chart(title, title, draw(columns, resolved or {}), foot=foot), columns


def _figure_3(columns: Columns, resolved: Columns) -> list[Panel]:
    """Δz above, V below; of resolved falls the means with their standard deviations."""
    return [
        Panel(_INCLINE, PlotAxis(row.axis), [
            *_inclines(columns, row.name, row.scale),
            *([Trace(f"{resolved['falls'][0]:g} resolved falls ± SD", resolved["incline_deg"],
                      _scaled(resolved[row.name], row.scale), "square", INK,
                      _scaled(resolved[row.key("sd")], row.scale))] if resolved else []),
            *(_free_falls() if row == SPEED else ()),
        ], 150.0)
        for row in (SEPARATION, SPEED)
    ]  # fmt: skip


def _inclines(columns: Columns, name: str, scale: float) -> Iterator[Trace]:
    for pile, words in ((0.0, "rods on the surface"), (1.0, "on a pile")):
        rows = [row for row, flag in enumerate(columns["pile"]) if flag == pile]
        inclines = [columns["incline_deg"][row] for row in rows]
        values = [columns[name][row] * scale for row in rows]
        # The rods do not slide between level and arctan μ: no line across.
        start = 1 if not pile and inclines[0] == 0.0 else 0
        if start:
            yield Trace("", inclines[:1], values[:1], "mean", MODEL)
        yield Trace(words, inclines[start:], values[start:], "dash" if pile else "line", MODEL)


def _free_falls() -> Iterator[Trace]:
    speed = free_fall_speed(paper.UNIFORM, paper.DROP, paper.GRAVITY)
    in_text = paper.TEXT_FREE_FALL_SPEED
    yield Trace(f"free fall in the text, {in_text:.2f} m/s", (), (in_text,), "limit", SECOND)
    yield Trace("free fall by the equations", (), (speed,), "limit", MUTED)


def _figure_4(columns: Columns, resolved: Columns) -> list[Panel]:
    """Height against V², with the separation at the end; the paper's own point is hollow."""
    end = columns["free_speed2"][-1]
    measured = 100.0 * paper.MEASURED_GRADED_SEPARATION
    series = [*_falls(columns, "strikes the surface at 40°", "falls freely", MODEL)]
    series.append(Trace("Δz = 17 cm measured", [end], [measured], "ring", SECOND))
    series += _falls(resolved, "resolved rods, one fall", "", SECOND) if resolved else ()
    return [Panel(PlotAxis("V² (m²/s²)"), PlotAxis("height of the top rod (cm)"), series, 170.0)]


def _falls(columns: Columns, struck: str, free: str, color: int) -> Iterator[Trace]:
    heights = _scaled(columns["height_m"], 100.0)
    yield Trace(struck, columns["speed2"], heights, "line", color)
    heights = _scaled(columns["free_height_m"], 100.0)
    yield Trace(free, columns["free_speed2"], heights, "dash", INK if free else color)


def _figure_6(columns: Columns, _: Columns) -> list[Panel]:
    """Against ξ, with the closed forms beside the discrete model."""
    axis = PlotAxis("rotational inertia of the rods, ξ (uniform rods: 1/3)")
    return [
        Panel(axis, PlotAxis(row.axis), [
            Trace("discrete model", columns["inertia"], _scaled(columns[row.name], row.scale),
                   "line", MODEL),
            Trace(words, columns["inertia"], _scaled(columns[other], row.scale), "dash", INK),
        ], 130.0)
        for row, other, words in (
            (SEPARATION, f"eq15_{SEPARATION.name}", "Eq. 15"),
            (SPEED, f"eq14_{SPEED.name}", "Eq. 14"),
        )
    ]  # fmt: skip


def _scaled(values: list[float], scale: float) -> list[float]:
    return [scale * value for value in values]


_KINDS: dict[int, _Kind] = {
    3: (paper.figure_3, _figure_3),
    4: (paper.figure_4, _figure_4),
    6: (paper.figure_6, _figure_6),
}
