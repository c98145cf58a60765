"""Layouts of gates and what they measure, in words for a terminal."""

from collections.abc import Mapping
from typing import Any

from rig.measurands import MEASURANDS
from rig.report.estimate import symbol
from rig.report.numbers import decimals_for, fixed
from rig.report.templates import sentence
from rig.text_table import text_table


def design_lines(design: Mapping[str, Any]) -> list[str]:
    """Write layouts and their uncertainties, for a terminal."""
    layouts = {name: design[name] for name in ("current", "proposed") if name in design}
    cells = [_uncertainties(layout) for layout in layouts.values()]
    rows = [[name, *(column[name] for column in cells)] for name in cells[0]]
    table = text_table([["quantity", *layouts], *rows], left={0}, rule=True)
    return sentence("design", design, table).split("\n")


def _uncertainties(layout: Mapping[str, Any]) -> dict[str, str]:
    """Write the standard uncertainty of each quantity of one run, and of each coefficient."""
    runs = [(MEASURANDS[line["name"]], line["u_run"]) for line in layout["measurands"]]
    runs = [(row, u * row.fine_scale) for row, u in runs if "told" in row.kinds]
    u = {f"{row.symbol} of one run ({row.fine})": value for row, value in runs}
    u |= {
        symbol(line["name"]): line["u"] if line["identified"] else None
        for line in layout["coefficients"]
    }
    return {
        name: "not identified" if value is None else fixed(value, decimals_for(value))
        for name, value in u.items()
    }
