"""What a session taught about the rig, as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.components import STATED

if TYPE_CHECKING:
    from rig.analysis.learn import Lesson

IDENTIFIED = 0.5
"""Share of the prior variance that the edges must take away for an unknown to be found by them."""


def lesson_json(lesson: Lesson) -> dict[str, Any]:
    """``learned`` of `rig analyze --json`.

    Returns
    -------
    dict
        ``scatter``: each variance component as stated and as found, with its degrees of freedom;
        ``gates`` and ``rods`` are relative to the protocol's uncertainties. ``unknowns``: what the
        drops have in common, as deviations from the protocol in SI units, with the standard
        uncertainties before and after; what the edges do not tell is marked as not identified.
    """
    variance = np.diag(lesson.covariance)
    return {
        "runs": len(lesson.drops),
        "scatter": [
            {
                "name": name,
                "stated": getattr(STATED, name),
                "found": getattr(lesson.components, name),
                "degrees": degrees,
            }
            for name, degrees in lesson.degrees.items()
        ],
        "unknowns": [
            {
                "name": name,
                "value": lesson.x[block].tolist(),
                "u": (np.sqrt(variance[block]) * lesson.sd[block]).tolist(),
                "prior_u": lesson.sd[block].tolist(),
                "identified": (variance[block] <= 1.0 - IDENTIFIED).tolist(),
            }
            for name, block in lesson.shared.blocks.items()
            if lesson.sd[block].any()
        ],
    }
