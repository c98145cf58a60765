"""What a session found the air to take."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.report.numbers import plus_minus

if TYPE_CHECKING:
    from collections.abc import Mapping

_FOUND = 4.0  # standard uncertainties
_COVERAGE = 1.96


def air_lines(analysis: Mapping[str, Any]) -> list[str]:
    """Say what the air took, where it is more than nothing: the predictions are without it.

    Parameters
    ----------
    analysis
        What ``rig analyze --json`` prints.
    """
    for one in (analysis.get("learned") or {}).get("unknowns") or ():
        if one["name"] != "drag" or abs(one["value"][0]) <= _FOUND * one["u"][0]:
            continue
        kappa = {"value": one["value"][0], "U95": _COVERAGE * one["u"][0]}
        return [
            f"air: takes κv² from g, κ = {plus_minus(kappa)} per m; what is measured is in this "
            "air, what is predicted is not (rig estimate takes it into account)"
        ]
    return []
