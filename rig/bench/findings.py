"""What a study found, for people and for programs; `rig.commands.study` keeps and prints it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


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
    pictures
        Further SVG files by their names.
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
    pictures: Mapping[str, str] = field(default_factory=dict)
    name: str = ""
    simulated: bool = False
    failed: bool = False
