"""Survey for the home page: sessions and protocols of the folder, ready protocols, boards.

It needs more of the program than the first paint, so it is loaded when a survey is made.
"""

from collections.abc import Iterator
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from rig.errors import RigError
from rig.files import file_stamp
from rig.flash.drive import waiting_drives
from rig.ready import ready_protocols
from rig.results.whole import protocol_of
from rig.session.store import Session
from rig.text_rows import read_rows
from rig.tui.beginnings import HERE, Beginning
from rig.tui.client import ReconnectingClient
from rig.tui.context import Options
from rig.usb.listing import serial_ports

_BOARD = "Connect a board"
_MOST = 200
"""Number of session files listed, the newest first."""


class SessionEntry(NamedTuple):
    """A session file; `trouble` is the reason why it cannot be read.

    Attributes
    ----------
    drops, over, runs
        Numbers of recorded drops, of completed runs, and of planned runs.
    source
        Name of its protocol file.
    """

    path: Path
    title: str = ""
    created: str = ""
    drops: int = 0
    over: int = 0
    runs: int = 0
    source: str = ""
    simulated: bool = False
    trouble: str = ""


def look_around(options: Options, client: ReconnectingClient) -> list[Beginning]:
    """Return the rows of the home page from the folder, ready protocols and USB devices."""
    ready = [*ready_protocols().values()]
    own = [*options.files, *sorted(Path().glob("[!.]*.yaml"))]
    files = [*{path.resolve(): path for path in own if path.resolve() not in ready}.values()]
    named = {path.name: path for path in ready + files}
    scenes = [
        Beginning(section, kind, title, named.get(f"{name}.yaml"), value)
        for section, kind, name, value, title in read_rows(__file__)
    ]
    boards = [*_boards(client)]
    if not boards and not client.port:
        boards.append(Beginning(_BOARD, "board", "none is plugged in"))
    sessions = session_list(Path())
    readable = [entry for entry in sessions if not entry.trouble] or sessions
    return [
        *(row for row in scenes if row.kind == "try"),
        *boards,
        *islice(_unfinished(sessions, named), 3),
        *(Beginning(HERE, "open", path.stem, path) for path in files),
        *(row for row in scenes if row.kind == "new"),
        *(Beginning("Open results", "results", f"of {each.path.stem}") for each in readable[:1]),
        *(Beginning("Ready experiments", "open", path.stem, path) for path in ready),
    ]


def _unfinished(sessions: list[SessionEntry], named: dict[str, Path]) -> Iterator[Beginning]:
    for entry in sessions:
        if entry.over < entry.runs and entry.source in named:
            title = f"{entry.title or entry.path.stem:.24}, {entry.over} of {entry.runs}"
            file, port = named[entry.source], "sim://" * entry.simulated
            yield Beginning("Continue", "open", title, file, port, entry.path)


def _boards(client: ReconnectingClient) -> Iterator[Beginning]:
    for _ in waiting_drives():
        yield Beginning(_BOARD, "flash", "Pico: put the firmware on it", value="pico")
    for port in serial_ports():
        if port.candidate:
            yield Beginning(_BOARD, "board", f"{port.kind} at {port.path}", value=port.path)
    if client.in_the_way is not None:
        yield Beginning(_BOARD, "end", f"end {client.in_the_way[0]}, which runs already")


def session_list(folder: Path) -> list[SessionEntry]:
    """Return the sessions of a folder, the newest first."""
    stamps = ((file_stamp(path), path) for path in folder.glob("*.session"))
    # A file that was removed meanwhile has none.
    dated = sorted(((stamp[0][1], path, stamp) for stamp, path in stamps if stamp), reverse=True)
    return [_look(path, stamp) for _, path, stamp in dated[:_MOST]]


@lru_cache(maxsize=_MOST)  # the home page lists them repeatedly
def _look(path: Path, _: object) -> SessionEntry:
    try:
        with Session.open(path, readonly=True) as session:
            protocol, source = protocol_of(session), Path(session.protocol_source).name
            recorded = {entry[:2] for entry in session.states() if entry.state == "recorded"}
            counts = len(recorded), len({run for run, _ in recorded}), len(protocol.runs())
            created = session.meta["created"]
            return SessionEntry(path, protocol.title, created, *counts, source, session.simulated)
    except RigError as error:
        return SessionEntry(path, trouble=error.message)
