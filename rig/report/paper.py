"""The paper's figures, drawn anew from its equations."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from rig.measurands import SEPARATION, SPEED
from rig.model import paper
from rig.model.fall import free_fall_speed
from rig.report.canvas import INK, MODEL, MUTED, SECOND, canvas

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.axes import Axes

    from rig.report.canvas import Canvas

    Columns = Mapping[str, list[float]]
    _Kind = tuple[Callable[[], dict[str, list[float]]], Callable[[list[Axes], Columns], None], int]

_WRAP = 96


def paper_figure(
    number: int, resolved: Columns | None = None
) -> tuple[Canvas, dict[str, list[float]]]:
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
    drawing, columns
        The figure, with what the text says of it and the equations do not below it; and its
        numbers.
    """
    compute, draw, panels = _KINDS[number]
    columns = compute()
    with canvas((2.9,) * panels, simulated=False, caption=_caption(number)) as drawing:
        draw(drawing.axes, columns)
        if resolved is not None:
            _RESOLVED[number](drawing.axes, resolved)
    return drawing, columns


def _caption(number: int) -> str:
    lines = ["Where the paper's text and its equations differ:"]
    for claim in paper.claims():
        if claim.figure == number:
            said = f"· {claim.text}; equations: {claim.equations}"
            lines += textwrap.wrap(said, _WRAP, subsequent_indent="   ")
    note = "No line from just above 0° to arctan μ = 11.3°: the rods would not slide there."
    return "\n".join([*([note] if number == 3 else []), *lines])


def _figure_3(axes: list[Axes], columns: Columns) -> None:
    """Δz above, V below."""
    for panel, row in ((axes[0], SEPARATION), (axes[1], SPEED)):
        for pile, style, words in ((0.0, "-", "rods on the surface"), (1.0, "--", "on a pile")):
            rows = [i for i, flag in enumerate(columns["pile"]) if flag == pile]
            # The rod does not slide between level and arctan μ: no line across.
            inclines = [columns["incline_deg"][i] for i in rows]
            values = [columns[row.name][i] * row.scale for i in rows]
            start = 1 if not pile and inclines[0] == 0.0 else 0
            if start:
                panel.plot(inclines[:1], values[:1], "o", color=MODEL, markersize=4)
            panel.plot(inclines[start:], values[start:], style, color=MODEL, label=words)
        panel.set_ylabel(row.axis)
    axes[0].legend(loc="upper right")
    axes[1].axhline(paper.TEXT_FREE_FALL_SPEED, color=SECOND, linestyle=":", linewidth=1.2)
    axes[1].annotate("free fall in the text, 5.08 m/s", (89, paper.TEXT_FREE_FALL_SPEED), (0, -4),
                     textcoords="offset points", color=SECOND, ha="right", va="top")  # fmt: skip
    axes[1].axhline(_free_fall(), color=MUTED, linestyle=":", linewidth=1.2)
    axes[1].annotate("free fall by the equations", (1, _free_fall()), (0, 3),
                     textcoords="offset points", color=MUTED, va="bottom")  # fmt: skip
    axes[1].set_ylim(bottom=4.7)
    axes[1].set_xlabel("incline of the surface (°)")


def _free_fall() -> float:
    return free_fall_speed(paper.UNIFORM, paper.DROP, paper.GRAVITY)


def _figure_4(axes: list[Axes], columns: Columns) -> None:
    """Height against V², with the separation at the end."""
    panel = axes[0]
    for height, speed2, style, color, words in (
        ("height_m", "speed2", "-", MODEL, "strikes the surface at 40°"),
        ("free_height_m", "free_speed2", "--", INK, "falls freely"),
    ):
        heights = [100.0 * z for z in columns[height]]
        panel.plot(columns[speed2], heights, style, color=color, label=words)
    end = columns["free_speed2"][-1]
    measured = 100.0 * paper.MEASURED_GRADED_SEPARATION
    panel.plot([end], [measured], "s", color=SECOND, label="Δz = 17 cm measured")
    panel.set_xlabel("V² (m²/s²)")
    panel.set_ylabel("height of the top rod (cm)")
    panel.legend(loc="upper right")


def _figure_6(axes: list[Axes], columns: Columns) -> None:
    """Against ξ, with the closed forms beside the discrete model."""
    for panel, row, other, words in (
        (axes[0], SEPARATION, f"eq15_{SEPARATION.name}", "Eq. 15"),
        (axes[1], SPEED, f"eq14_{SPEED.name}", "Eq. 14"),
    ):
        inertia = columns["inertia"]
        discrete, closed = ([row.scale * v for v in columns[key]] for key in (row.name, other))
        panel.plot(inertia, discrete, color=MODEL, label="discrete model")
        panel.plot(inertia, closed, "--", color=INK, label=words)
        panel.axvline(paper.UNIFORM.inertia, color=MUTED, linestyle=":", linewidth=1.2)
        panel.set_ylabel(row.axis)
        panel.legend(loc="upper right")
    axes[1].set_xlabel("rotational inertia of the rods, ξ (dotted: uniform rods, 1/3)")


def _resolved_3(axes: list[Axes], found: Columns) -> None:
    """Means of resolved falls with their standard deviations."""
    for panel, row in ((axes[0], SEPARATION), (axes[1], SPEED)):
        means, spreads = ([row.scale * v for v in found[key]] for key in (row.name, row.key("sd")))
        panel.errorbar(
            found["incline_deg"], means, spreads, fmt="s", color=INK, markersize=4.0,
            label=f"resolved rods at strike, mean ± SD of {found['falls'][0]:g} falls",
        )  # fmt: skip
        panel.legend(loc="upper right")


def _resolved_4(axes: list[Axes], found: Columns) -> None:
    """One resolved fall, striking and free."""
    for height, speed2, words in (
        ("height_m", "speed2", "resolved rods, one fall"),
        ("free_height_m", "free_speed2", None),
    ):
        heights = [100.0 * z for z in found[height]]
        axes[0].plot(found[speed2], heights, ":", color=SECOND, linewidth=1.2, label=words)
    axes[0].legend(loc="upper right")


_RESOLVED: dict[int, Callable[[list[Axes], Columns], None]] = {3: _resolved_3, 4: _resolved_4}

_KINDS: dict[int, _Kind] = {
    3: (paper.figure_3, _figure_3, 2),
    4: (paper.figure_4, _figure_4, 1),
    6: (paper.figure_6, _figure_6, 2),
}
