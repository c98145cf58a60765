"""What there is to begin with: sessions and experiments of the folder, ready ones, boards."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.errors import InputError, RigError
from rig.protocol import reader
from rig.protocol.measurable import check_gates, check_recordable
from rig.tui.widgets.text import plain

if TYPE_CHECKING:
    from rig.protocol.protocol import Protocol
    from rig.tui.context import Options

_MOST = 200
"""Session files that are listed, the newest."""
_FLASHED_AS = {"Arduino Mega 2560": "mega", "Arduino Uno": "uno"}
TRIALS = {"falling-ball": "a ball: g within seconds", "inclined-uniform": "two chains on a board"}
SCENES = {
    "object": ("falling-ball", "an object past gates"),
    "track": ("glider", "a glider on a track"),
    "picket-fence": ("picket-fence", "a picket fence"),
    "one-chain": ("single-chain", "one chain on a board"),
    "two-chains": ("inclined-uniform", "two chains, one strikes"),
}
"""What ``rig new`` drafts: the ready protocol that looks like it, and what it is."""


class SessionEntry(NamedTuple):
    """One session file; `trouble` says why it cannot be read.

    Attributes
    ----------
    drops, runs
        Recorded, and planned; `over` of these runs have a drop.
    source
        Its protocol as text.
    origin
        The port it was recorded from.
    """

    path: Path
    title: str = ""
    created: str = ""
    drops: int = 0
    simulated: bool = False
    trouble: str = ""
    over: int = 0
    runs: int = 0
    source: str = ""
    origin: str = ""


class Reading(NamedTuple):
    """A protocol, and what is wrong with its file; empty where it can be used."""

    protocol: Protocol | None
    problem: str = ""


class Row(NamedTuple):
    """One thing to begin with.

    Attributes
    ----------
    kind
        What is done: ``try``, ``open``, ``board``, ``flash``, ``new``, ``results`` or ``end``.
    value
        Of a board its port, of a scene or a board to be flashed its name.
    file
        The protocol that is opened, or whose picture stands beside it.
    session
        The file that is continued.
    """

    section: str
    title: str
    kind: str
    file: Path | None = None
    value: str = ""
    session: Path | None = None
    note: str = ""


class Survey(NamedTuple):
    """What was seen at one look."""

    sessions: tuple[SessionEntry, ...] = ()
    boards: tuple[Row, ...] = ()
    files: tuple[Path, ...] = ()
    ready: tuple[Path, ...] = ()


def look_around(options: Options) -> Survey:
    """Look at the folder, at the ready protocols, and at what USB lists."""
    from rig.ready import ready_protocol  # noqa: PLC0415 - not needed to paint

    ready = tuple(sorted(ready_protocol("falling-ball").parent.glob("*.yaml")))
    own = [*options.files, *sorted(Path().glob("[!.]*.yaml"))]
    files = {path.resolve(): path for path in own if path.resolve() not in ready}
    return Survey(tuple(session_list(Path())), _boards(), tuple(files.values()), ready)


def _boards() -> tuple[Row, ...]:
    from rig.flash.drive import waiting_drives  # noqa: PLC0415 - not needed to paint
    from rig.usb.listing import serial_ports  # noqa: PLC0415 - nor is this

    section = "Connect a board"
    rows = [Row(section, "Raspberry Pi Pico: put the firmware on it", "flash", value="pico")
            for _ in waiting_drives()]  # fmt: skip
    for port in serial_ports():
        if not port.candidate:
            continue
        rows.append(Row(section, f"{port.kind} at {port.path}", "board", value=port.path))
        name = _FLASHED_AS.get(port.kind)
        if name is not None:
            title = f"{port.kind}: put the firmware on it"
            rows.append(Row(section, title, "flash", value=f"{name} --port {port.path}"))
    return tuple(rows)


def rows_of(survey: Survey, port: str, other: str) -> list[Row]:
    """List what can be begun.

    Parameters
    ----------
    port
        Of the rig that is there; empty for none.
    other
        The port of a daemon that stands in the way of the wanted one; empty for none.
    """
    ready = {path.stem: path for path in survey.ready}
    rows = [Row("Try it", title, "try", ready.get(name), note="simulated")
            for name, title in TRIALS.items()]  # fmt: skip
    if other:
        rows.append(Row("Connect a board", f"end {other}, which runs already", "end"))
    none_there = Row("Connect a board", "none is plugged in", "board", note="USB is watched")
    rows += survey.boards or ([] if port else [none_there])
    files = {file.read_text("utf-8", "replace"): file
             for file in (*survey.files, *survey.ready) if file.is_file()}  # fmt: skip
    rows += [
        Row("Continue", f"{entry.path.stem}, {entry.over} of {entry.runs}", "open",
            files[entry.source], entry.origin if entry.simulated else "", entry.path)
        for entry in survey.sessions
        if not entry.trouble and entry.over < entry.runs and entry.source in files
    ][:3]  # fmt: skip
    rows += [Row("Experiments here", plain(path.stem, 25), "open", path) for path in survey.files]
    rows += [Row("New experiment", title, "new", ready.get(name), scene)
             for scene, (name, title) in SCENES.items()]  # fmt: skip
    if survey.sessions:
        newest = plain(survey.sessions[0].path.stem, 24)
        rows.append(Row("Open results", newest, "results", note=f"of {len(survey.sessions)}"))
    return [*rows, *(Row("Ready experiments", path.stem, "open", path) for path in survey.ready)]


def first_row(rows: list[Row], options: Options) -> int:
    """Choose the row to begin with: what was asked for, what is unfinished, or a trial."""
    usable = [at for at, row in enumerate(rows) if row.kind == "open" and row.file is not None
              and row.file in options.files and not read_file(row.file).problem]  # fmt: skip
    asked = [at for at in usable if rows[at].section == "Experiments here" or options.port]
    going = [at for at, row in enumerate(rows) if row.session is not None]
    wanted = [*asked, *going] if options.port else [*going, *asked]
    return next(iter(wanted), 0)


def read_file(file: Path) -> Reading:
    """Read a protocol, and say what is wrong with it at which line."""
    protocol = None
    try:
        protocol = reader.read(file)
        check_gates(protocol)
        check_recordable(protocol)
    except InputError as error:
        lines = [plain(problem, 300) for problem in error.problems]
        return Reading(protocol, "\n".join(lines or [plain(error.message), plain(error.hint)]))
    return Reading(protocol)


def session_list(folder: Path) -> list[SessionEntry]:
    """List the sessions of a folder, the newest first."""
    dated = []
    for path in folder.glob("*.session"):
        try:
            dated.append((path.stat().st_mtime_ns, path))
        except OSError:
            continue  # gone meanwhile
    return [_look(path) for _, path in sorted(dated, reverse=True)[:_MOST]]


def _look(path: Path) -> SessionEntry:
    from rig.protocol.plan import runs  # noqa: PLC0415 - not needed to paint
    from rig.results import protocol_of  # noqa: PLC0415 - nor is this
    from rig.session.store import Session  # noqa: PLC0415 - nor is this

    try:
        with Session.open(path, readonly=True) as session:
            protocol = protocol_of(session)
            recorded = {entry[:2] for entry in session.states() if entry.state == "recorded"}
            return SessionEntry(
                path, protocol.title, session.meta["created"], len(recorded), session.simulated,
                "", len({run for run, _ in recorded}), len(runs(protocol)), session.protocol_text,
                session.meta["origin"],
            )  # fmt: skip
    except RigError as error:
        return SessionEntry(path, trouble=error.message)
