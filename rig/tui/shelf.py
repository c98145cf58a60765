"""The session files of a folder, to choose one from."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rig.errors import RigError
from rig.results import protocol_of
from rig.session.store import Session

if TYPE_CHECKING:
    from pathlib import Path

_MOST = 200
"""Files that are listed, the newest."""


class Volume(NamedTuple):
    """One session file; `trouble` says why it cannot be read."""

    path: Path
    title: str = ""
    created: str = ""
    drops: int = 0
    simulated: bool = False
    trouble: str = ""


def shelf(folder: Path) -> list[Volume]:
    """List the sessions of a folder, the newest first."""
    found = []
    for path in folder.glob("*.session"):
        try:
            found.append((path.stat().st_mtime_ns, path))
        except OSError:
            continue  # gone meanwhile
    return [_look(path) for _, path in sorted(found, reverse=True)[:_MOST]]


def _look(path: Path) -> Volume:
    try:
        with Session.open(path, readonly=True) as session:
            title = protocol_of(session).title
            drops = len({entry[:2] for entry in session.states() if entry.state == "recorded"})
            return Volume(path, title, session.meta["created"], drops, session.simulated)
    except RigError as error:
        return Volume(path, trouble=error.message)
