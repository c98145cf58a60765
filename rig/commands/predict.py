"""``rig predict``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.output import print_json, say
from rig.errors import InputError
from rig.files import write_atomic
from rig.measurands import SEPARATION, SPEED
from rig.predictions import predictions
from rig.protocol import reader
from rig.text_table import csv_text, text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping

    from rig.predictions import PredictedIncline
    from rig.protocol.protocol import Protocol


def main(arguments: Namespace) -> int:
    """Print the model's predictions, one an incline, or draw a figure of the paper."""
    if arguments.figure is not None:
        if arguments.protocol is not None:
            raise InputError(
                f"figure {arguments.figure} is of the paper's own chains, not of a protocol's",
                f"leave {arguments.protocol} out; rig sweep and rig report draw a protocol's",
            )
        _write_figure(arguments.figure, arguments.output, resolved=arguments.resolved)
        return 0
    if arguments.protocol is None:
        raise InputError("predict what?", "name a protocol file, or a --figure with -o FILE.svg")
    protocol = reader.read(arguments.protocol)
    found = predictions(protocol)
    if arguments.json:
        print_json({"predictions": [one.json() for one in found]})
    else:
        print(table(protocol, found))
    return 0


def table(protocol: Protocol, found: list[PredictedIncline]) -> str:
    """Lay predictions out as text, notes below; without columns of what the scene does not have."""
    if protocol.surface is None:
        columns = {"speed (m/s)": ("speed_m_s", 1.0, ".4f"), "t (s)": ("fall_time_s", 1.0, ".5f")}
        return _laid_out(columns, found)
    apart, end = SEPARATION, SPEED
    columns = {
        "incline (°)": ("incline_deg", 1.0, "g"),
        "strikes": ("impact_chain", 1, ""),
        "α": ("alpha", 1.0, ".4f"),
        f"{apart.symbol} ({apart.unit})": (apart.name, apart.scale, ".3f"),
        f"u ({apart.unit})": (apart.key("u"), apart.scale, ".3f"),
        f"{end.symbol} ({end.unit})": (end.name, end.scale, ".4f"),
        f"u ({end.unit})": (end.key("u"), end.scale, ".4f"),
        "t (s)": ("fall_time_s", 1.0, ".5f"),
        "free fall V (m/s)": ("free_fall_speed_m_s", 1.0, ".4f"),
    }
    if not protocol.two_chains:
        del columns[f"{apart.symbol} ({apart.unit})"], columns[f"u ({apart.unit})"]
    return _laid_out(columns, found)


def _cell(value: float | str | None, scale: float, style: str) -> str:
    if value is None:
        return "–"
    return value if isinstance(value, str) else format(value * scale, style)


def _laid_out(columns: Mapping[str, tuple[str, float, str]], found: list[PredictedIncline]) -> str:
    shown = {
        heading: what
        for heading, what in columns.items()
        if any(getattr(line, what[0]) is not None for line in found)
    }
    rows = [[*shown, "model"]]
    for line in found:
        cells = [_cell(getattr(line, key), scale, style) for key, scale, style in shown.values()]
        rows.append([*cells, line.model])
    notes = [f"{line.label}: {note}" for line in found for note in line.notes]
    return "\n".join([*text_table(rows), *notes])


def _write_figure(number: int, output: str | None, *, resolved: bool) -> None:
    """Write a figure of the paper as SVG and its numbers as CSV beside it."""
    from rig.report.paper import paper_figure  # noqa: PLC0415 - it needs matplotlib

    if output is None or Path(output).suffix not in {".svg", ".csv"}:
        what = (
            "a figure needs a file to go to"
            if output is None
            else (f"{output}: a figure is written as .svg, and its numbers as .csv")
        )
        raise InputError(what, f"rig predict --figure {number} -o FILE.svg")
    path = Path(output)
    falls = _resolved(number) if resolved else None
    svg, columns = paper_figure(number, falls)
    written = {path.with_suffix(".svg"): svg, path.with_suffix(".csv"): _table(columns)}
    if falls is not None:
        written[path.with_name(f"{path.stem}-resolved.csv")] = _table(falls)
    for file, text in written.items():
        write_atomic(file, text)
    say(" and ".join(map(str, written)))


def _table(columns: Mapping[str, list[float]]) -> str:
    rows = (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))
    return csv_text(columns, rows)


def _resolved(number: int) -> dict[str, list[float]]:
    """Let the figure's chains fall in the resolved world."""
    from rig.bench import resolved_paper  # noqa: PLC0415 - only where chains really fall

    if number not in {3, 4}:
        raise InputError(f"figure {number} has no resolved falls", "figures 3 and 4 have")
    say("letting chains fall in the resolved world; this takes some minutes")
    if number == 3:
        return resolved_paper.figure_3(resolved_paper.uniform())
    (found,) = resolved_paper.graded(variants=resolved_paper.AS_MEASURED)
    return resolved_paper.figure_4(found)
