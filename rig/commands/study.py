"""Carry a study out: what it finds is kept and printed in one way."""

import json
from argparse import Namespace
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

from rig.bench.findings import Findings
from rig.commands.output import print_data
from rig.files import make_folder, write_atomic
from rig.text_table import csv_text


def main(arguments: Namespace) -> int:
    """Carry out a study of ``rig bench``."""
    name = arguments.command.removeprefix("bench ")
    place = "rig.bench.scenes" if name == "scenes" else f"rig.commands.bench_{name}"
    return carry_out(name, import_module(place).run, arguments)


def carry_out(
    name: str, study: Callable[[Namespace], Iterator[Findings]], arguments: Namespace
) -> int:
    """Keep what a study finds whenever it has found more; print it at the end.

    Returns
    -------
    int
        Exit code.
    """
    output = getattr(arguments, "output", None)
    folder = make_folder(output) if output else None
    for findings in study(arguments):
        if folder is not None:
            _write(folder, findings.name or name, findings)
    lines = [*(["SIMULATED DATA"] if findings.simulated else []), *findings.lines]
    print_data(findings.record, lines, as_json=arguments.json)
    return int(findings.failed)


def _write(folder: Path, name: str, findings: Findings) -> None:
    """Write the table and pictures, and where there is a head also a page and all figures."""
    texts = {f"{further}.svg": drawing for further, drawing in findings.pictures.items()}
    texts[f"{name}.svg"] = findings.picture
    texts[f"{name}.csv"] = csv_text(findings.rows) if findings.rows else ""
    if findings.head:
        texts[f"{name}.md"] = "\n".join([findings.head, "", "```text", *findings.lines, "```", ""])
        texts[f"{name}.json"] = json.dumps(findings.record, indent=2, ensure_ascii=False) + "\n"
    for file, text in texts.items():
        if text:
            write_atomic(folder / file, text)
