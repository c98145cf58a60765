"""``rig attach``."""

from pathlib import Path

from rig.commands.output import Arguments
from rig.files import read_input
from rig.reasons import rig_error
from rig.session.store import Session

LARGEST = 1 << 25
"""Bytes; half of what a value of a session file may have."""


def main(arguments: Arguments) -> None:
    """Add a file to a session, for its report."""
    path = arguments.file
    try:
        data = read_input(path, LARGEST + 1)
    except OSError as error:
        raise rig_error("attachment_unreadable", path=path, text=error) from error
    if not 0 < len(data) <= LARGEST:
        raise rig_error("attachment_size", path=path)
    with Session.open(arguments.session) as session:
        session.attach(Path(path).name, data)
    print(f"attached to {arguments.session}: {path}, {len(data)} bytes")
