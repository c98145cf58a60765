"""Rows of the home page: what the operator may begin with."""

from pathlib import Path
from typing import NamedTuple, TypeAlias

from rig.errors import InputError
from rig.protocol import reader
from rig.protocol.measurable import check_recordable
from rig.protocol.protocol import Protocol
from rig.tui.context import Options
from rig.tui.widgets.text import plain

HERE = "Experiments here"
ProtocolFile: TypeAlias = tuple[Protocol | None, str]
"""A protocol, and the fault of its file; empty if it can be used."""


class Beginning(NamedTuple):
    """A row of the home page.

    Attributes
    ----------
    kind
        Action: ``try``, ``open``, ``board``, ``flash``, ``new``, ``results`` or ``end``.
    file
        The protocol to open, or to show as a picture.
    value
        Port of a board, or name of a scene or of a board to flash.
    session
        The session file to continue.
    """

    section: str
    kind: str
    title: str
    file: Path | None = None
    value: str = ""
    session: Path | None = None


def first_row(rows: list[Beginning], options: Options) -> int:
    """Return the row to select first: a blocking daemon, unfinished session, file or trial."""
    sections = "Continue" * (not options.port), HERE, "Ready experiments"
    named = {file.resolve() for file in options.files}
    places = [(False, -1, at) for at, row in enumerate(rows) if row.kind == "end"]
    places += [
        (bool(read_file(row.file)[1]), sections.index(row.section), at)
        for at, row in enumerate(rows)
        if row.section in sections and row.file and (row.session or row.file.resolve() in named)
    ]
    return min(places, default=(False, 0, 0))[2]


def read_file(file: Path) -> ProtocolFile:
    """Return a protocol, or the fault of its file with the line."""
    protocol = None
    try:
        protocol = reader.read(file)
        check_recordable(protocol)
    except InputError as error:
        lines = [plain(problem, 300) for problem in error.problems]
        return protocol, "\n".join(lines or [plain(error.message), plain(error.hint)])
    return protocol, ""
