"""What each scene costs: one bar a scene, one panel a cost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from rig.report.canvas import INK, MODEL, PAPER, canvas

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from rig.bench.scenes import Cost


def scenes_figure(costs: Sequence[Cost]) -> str:
    """Draw the costs of scenes as bars.

    Parameters
    ----------
    costs
        In the order in which they are drawn.

    Returns
    -------
    str
        SVG.

    Raises
    ------
    InputError
        If matplotlib is not installed.
    """
    names = [cost.scene for cost in costs]
    with canvas((1.5, 1.5, 1.9), simulated=False) as drawing:
        modules, whole, work = drawing.axes
        _bars(modules, names, [len(cost.account.rooms) for cost in costs])
        modules.set_ylabel("modules of rig")
        spreads = [cost.seconds["predict"] for cost in costs]
        medians = [1e3 * spread.median for spread in spreads]
        _bars(whole, names, medians, at="center")
        ends = [
            [1e3 * (spread.median - spread.low) for spread in spreads],
            [1e3 * (spread.high - spread.median) for spread in spreads],
        ]
        whole.errorbar(names, medians, yerr=ends, fmt="none", ecolor=INK, elinewidth=0.8)
        whole.set_ylabel("rig predict (ms)")
        _bars(work, names, [cost.account.operations["predict"] for cost in costs])
        work.set_yscale("log")
        work.set_ylabel("bytecodes\nof the prediction")
        work.tick_params(axis="x", labelrotation=40)
        for label in work.get_xticklabels():
            label.set_horizontalalignment("right")
            label.set_rotation_mode("anchor")
    return drawing.svg


def _bars(
    panel: Axes,
    names: Sequence[str],
    values: Sequence[float],
    at: Literal["edge", "center"] = "edge",
) -> None:
    bars = panel.bar(names, values, color=MODEL, width=0.7)
    color = INK if at == "edge" else PAPER
    panel.bar_label(bars, fmt="{:.0f}", label_type=at, fontsize=6.5, padding=2, color=color)
    panel.margins(y=0.15)
