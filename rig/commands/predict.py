"""``rig predict``."""

from dataclasses import replace
from pathlib import Path

from rig.commands.output import Arguments, print_data, say
from rig.files import write_atomic
from rig.measurands import SEPARATION, SPEED
from rig.model.prediction import PredictedIncline, group_notes
from rig.predictions import predictions
from rig.protocol import reader
from rig.protocol.protocol import Protocol
from rig.report.columns import table_parts
from rig.report.numbers import fixed
from rig.text_table import csv_text


def main(arguments: Arguments) -> None:
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
    struck = protocol.surface is not None
    rows = (SEPARATION, SPEED) if protocol.two_chains else (SPEED,)
    values = {"values": lambda line: line.quantities(*rows)}
    (part,) = table_parts("predictions" if struck else "fall", lines, derived=values)
    part = replace(part, rows=[[cell or "–" for cell in row] for row in part.rows])
    notes = group_notes(lines)
    if struck:
        free = dict.fromkeys(fixed(line.free_fall_speed_m_s, 4) for line in lines)
        notes.insert(0, f"free fall: {SPEED.symbol} = {' or '.join(free)} {SPEED.unit}")
    return [*part.table, *notes]


def _write_figure(number: int, path: Path) -> None:
    """Write a figure of the paper, and its numbers as CSV beside it."""
    from rig.report import canvas, paper  # noqa: PLC0415 - they need matplotlib

    picture = path.with_suffix(".svg") if path.suffix == ".csv" else path
    drawing, columns = paper.paper_figure(number)
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    canvas.write_figure(picture, drawing)
    write_atomic(path.with_suffix(".csv"), csv_text(rows))
    say(f"{picture} and {path.with_suffix('.csv')}")
