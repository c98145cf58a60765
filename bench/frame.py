"""The frame of every bench: what it found is kept and printed in one way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig.commands.output import print_found, write_study
from rig.files import make_folder, write_atomic
from rig.text_table import csv_text

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    Bench = Callable[[Namespace], Iterator["Findings"]]


@dataclass(frozen=True, slots=True)
class Findings:
    """What a bench found, whole or as far as it has come.

    Attributes
    ----------
    record
        All figures, as JSON has them.
    lines
        The same for people.
    head
        What stands above the lines on a page, in Markdown; empty where no page is kept.
    rows
        Lines of the CSV table.
    picture
        SVG.
    name
        How the files' names begin; empty for the bench's own.
    simulated
        Whether the printed lines begin by saying so.
    failed
        Whether a promise was not kept, which the exit code tells.
    """

    record: Mapping[str, Any]
    lines: Sequence[str]
    head: str = ""
    rows: Sequence[Mapping[str, Any]] = ()
    picture: str = ""
    name: str = ""
    simulated: bool = False
    failed: bool = False


def carry_out(name: str, bench: Bench, arguments: Namespace) -> int:
    """Keep what a bench finds whenever it has found more; print it at the end.

    Returns
    -------
    int
        Exit code.
    """
    output = getattr(arguments, "output", None)
    folder = make_folder(output) if output else None
    for findings in bench(arguments):
        if folder is not None:
            _write(folder, findings.name or name, findings)
    lines = [*(["SIMULATED DATA"] if findings.simulated else []), *findings.lines]
    print_found(findings.record, lambda: "\n".join(lines), as_json=arguments.json)
    return int(findings.failed)


def _write(folder: Path, name: str, findings: Findings) -> None:
    columns = dict.fromkeys(column for row in findings.rows for column in row)
    table = csv_text(columns, findings.rows) if columns else ""
    head, lines, picture = findings.head, findings.lines, findings.picture
    if head:
        write_study(folder, name, head, lines, findings.record, table, picture)
        return
    for kind, text in {"csv": table, "svg": picture}.items():
        if text:
            write_atomic(folder / f"{name}.{kind}", text)
