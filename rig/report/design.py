"""What `rig design` finds, as text."""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Any

from rig.measurands import MEASURANDS
from rig.report.columns import Column, aligned
from rig.report.estimate import symbol
from rig.report.numbers import decimals_for, fixed

if TYPE_CHECKING:
    from collections.abc import Mapping


def design_text(found: Mapping[str, Any]) -> str:
    """Write layouts and what they tell, for a terminal."""
    layouts = [name for name in ("current", "proposed") if name in found]
    lines = [
        f"standard uncertainties to be expected of {found['runs']} runs, by the {found['scatter']} "
        "scatter of the rig",
        "",
        *aligned(
            [
                Column("quantity", itemgetter("what"), numeric=False),
                *(Column(name, itemgetter(name)) for name in layouts),
            ],
            _records(found, layouts),
        ),
    ]
    for name in layouts:
        lines.append("")
        for side in dict.fromkeys(gate["side"] for gate in found[name]["gates"]):
            heights = ", ".join(
                f"{gate['height_m'] * 1e3:g}"
                for gate in found[name]["gates"]
                if gate["side"] == side
            )
            lines.append(f"{name}, {side} side (mm): {heights}")
        if not found[name]["readable"]:
            lines.append(
                f"{name}: edges may be given to wrong rods, and drops be void; beams above the "
                "drop height see the chain before anything strikes"
            )
    return "\n".join(lines)


def _records(found: Mapping[str, Any], layouts: list[str]) -> list[dict[str, str]]:
    rows: dict[str, dict[str, str]] = {}
    for layout in layouts:
        for line in found[layout]["measurands"]:
            quantity = MEASURANDS[line["name"]]
            if quantity.told:
                what = f"{quantity.symbol} of one run ({quantity.fine})"
                row = rows.setdefault(what, {"what": what})
                row[layout] = _plain(line["u_run"] * quantity.fine_scale)
        for line in found[layout]["coefficients"]:
            row = rows.setdefault(line["name"], {"what": symbol(line["name"])})
            row[layout] = _plain(line["u"]) if line["identified"] else "not identified"
    return list(rows.values())


def _plain(uncertainty: float) -> str:
    return fixed(uncertainty, decimals_for(uncertainty))
