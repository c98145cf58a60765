"""``rig predict``."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

from rig.analysis.distributions import COVERAGE_95
from rig.commands.output import print_data, say
from rig.files import write_atomic
from rig.measurands import SEPARATION, SPEED, Measurand
from rig.predictions import group_notes, predictions
from rig.protocol import reader
from rig.report.numbers import degrees, fixed, plus_minus
from rig.text_table import csv_text, text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable

    from rig.model.prediction import PredictedIncline
    from rig.protocol.protocol import Protocol


def main(arguments: Namespace) -> None:
    """Print the model's predictions, one an incline, or draw a figure of the paper."""
    if arguments.figure is not None:
        _write_figure(arguments.figure, arguments.output)
        return
    protocol = reader.read(arguments.protocol)
    lines = predictions(protocol)
    data = {"predictions": [line.json() for line in lines]}
    print_data(data, _write_table(protocol, lines), as_json=arguments.json)


def _write_table(protocol: Protocol, lines: list[PredictedIncline]) -> list[str]:
    """Lay predictions out as text, notes below; without columns of what the scene does not have."""
    columns: dict[str, Callable[[PredictedIncline], str]] = {
        f"speed ({SPEED.unit})": lambda line: fixed(line.speed_m_s, 4)
    }
    if protocol.surface is not None:
        columns = {
            "incline (°)": lambda line: degrees(line.incline_deg),
            "strikes": lambda line: line.impact_chain or "",
            "α": lambda line: fixed(line.alpha, 4),
        }
        if protocol.two_chains:
            heading = f"{SEPARATION.symbol} ± U ({SEPARATION.unit})"
            columns[heading] = lambda line: _number(
                line.separation_m, line.separation_u_m, SEPARATION
            )
        heading = f"{SPEED.symbol} ± U ({SPEED.unit})"
        columns[heading] = lambda line: _number(line.speed_m_s, line.speed_u_m_s, SPEED)
    columns["t (s)"] = lambda line: fixed(line.fall_time_s, 5)
    columns["model"] = lambda line: line.model
    cells = {name: [tell(line) for line in lines] for name, tell in columns.items()}
    rows = [[name, *(text or "–" for text in texts)] for name, texts in cells.items() if any(texts)]
    notes = group_notes(lines)
    if protocol.surface is not None:
        free = dict.fromkeys(fixed(line.free_fall_speed_m_s, 4) for line in lines)
        notes.insert(0, f"free fall: {SPEED.symbol} = {' or '.join(free)} {SPEED.unit}")
    words = {place for place, row in enumerate(rows) if row[0] in {"strikes", "model"}}
    return [*text_table([*zip(*rows, strict=True)], left=words), *notes]


def _number(value: float | None, u: float | None, row: Measurand) -> str:
    """Write a prediction with what its own numbers leave open."""
    if value is None or u is None:
        return fixed(value and value * row.scale, row.decimals + 1)
    return plus_minus(SimpleNamespace(value=value, expanded=COVERAGE_95 * u), row.scale)


def _write_figure(number: int, output: str) -> None:
    """Write a figure of the paper, and its numbers as CSV beside it."""
    from rig.report.canvas import write_figure  # noqa: PLC0415 - it needs matplotlib
    from rig.report.paper import paper_figure  # noqa: PLC0415 - likewise

    path = Path(output)
    picture = path.with_suffix(".svg") if path.suffix == ".csv" else path
    drawing, columns = paper_figure(number)
    rows = (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))
    write_figure(picture, drawing)
    write_atomic(path.with_suffix(".csv"), csv_text(columns, rows))
    say(f"{picture} and {path.with_suffix('.csv')}")
