"""Error against time of every estimator, log–log."""

from __future__ import annotations

from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from rig.report.canvas import INK, MODEL, MUTED, SECOND, canvas

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_PANELS = (("separation_rms_m", 1e3, "rms error of Δz (mm)"),
           ("speed_rms_m_s", 1e3, "rms error of V (mm/s)"))  # fmt: skip
_STYLES = (("o", MUTED), ("s", INK), ("D", MODEL), ("*", SECOND), ("^", MUTED), ("v", INK))


def estimators_figure(found: Sequence[Mapping[str, Any]]) -> str:
    """Draw them; what takes no processor time is a line across.

    Parameters
    ----------
    found
        ``estimators`` of ``rig bench estimators --json``.

    Returns
    -------
    str
        SVG.
    """
    with canvas((3.2, 3.0), simulated=True) as drawing:
        for axes, (field, scale, label) in zip(drawing.axes, _PANELS, strict=True):
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
    return drawing.svg
