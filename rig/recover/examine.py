"""Examination of a session file: identity, damage, and readable drops."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rig.printable import printable
from rig.reasons import sentences
from rig.recover.drops import RecoveredDrop, recover_drops
from rig.recover.pages import Pages
from rig.recover.rows import Rows, find_rows
from rig.recover.snapshot import SessionCopy, take_snapshot
from rig.session.drop_check import Fate
from rig.session.hashes import check_chain
from rig.session.schema import APPLICATION_ID, SCHEMA_VERSION, TABLES, RunState

_NUMBERED = {name: table.meaning for name, table in TABLES.items() if table.numbered}
FAULTS = ("damaged: ", "lost: ")
"""Prefixes of lines about faults of a file."""
_GOOD = (Fate.CONFIRMED, Fate.IMPORTED)
_FORMAT, _APPLICATION = 60, 68
"""Offsets of ``user_version`` and ``application_id`` in SQLite's header."""
_OPEN = (RunState.ARMED, RunState.FIRED, RunState.RECORDED)


class ExaminedFile(NamedTuple):
    """Result of the examination of a session file.

    Attributes
    ----------
    snapshot, rows
        The file as read, and its rows.
    drops
        The best version of each drop.
    foreign
        Why it is not a session; empty for a session.
    damage
        Faults of the file.
    lost
        Data that cannot be recovered.
    """

    snapshot: SessionCopy
    rows: Rows
    drops: list[RecoveredDrop]
    foreign: str
    damage: Sequence[str] = ()
    lost: Sequence[str] = ()

    @property
    def whole(self) -> bool:
        """Whether it is a session without any fault."""
        return not (self.foreign or self.troubles)

    @property
    def troubles(self) -> list[str]:
        """All faults, a sentence each."""
        doubtful = [_describe_fate(drop) for drop in self.drops if drop.fate not in _GOOD]
        return list(dict.fromkeys([*self.damage, *self.lost, *doubtful]))


def examine(path: str | Path) -> ExaminedFile:
    """Examine a session file without changing it.

    Raises
    ------
    SessionError
        The file cannot be read at all.
    """
    snapshot = take_snapshot(path)
    pages = Pages(snapshot.data)
    rows = find_rows(pages)
    drops = recover_drops(rows)
    if foreign := _foreign(snapshot.data, pages, rows):
        return ExaminedFile(snapshot, rows, drops, foreign)
    chained = pages.header(_FORMAT) >= TABLES["hash"].since
    orphans = len({row[:1] for row in rows.tables["edge"]} - rows.tables["drop"].keys())
    damage = {
        f"{pages.missing} of {pages.expected} pages are not there: the file is torn": pages.missing,
        snapshot.trouble: snapshot.trouble,
        f"{rows.bad} records cannot be read": rows.bad,
        "table hash: all its rows are missing": chained and not rows.tables["hash"],
        f"nothing says what drops {orphans} groups of edges belong to": orphans,
    }
    lost = {
        "whether it is simulated, when and by what it was made": "simulated" not in rows.meta,
        "the protocol file": rows.protocol is None,
        "the protocol's text has changed since the session was made": rows.protocol_altered,
        **{f"{rows.gaps(table)} {name}": rows.gaps(table) for table, name in _NUMBERED.items()},
        **{_describe_fate(drop): drop.fate is Fate.PARTIAL for drop in drops},
    }
    damaged = [*filter(damage.get, damage), *check_chain(rows.tables)]
    return ExaminedFile(snapshot, rows, drops, "", damaged, [*filter(lost.get, lost)])


def describe(session: ExaminedFile) -> list[str]:
    """Return the result as lines that are safe for a terminal."""
    return [printable(line).replace("\n", " ").replace("\t", " ") for line in _lines(session)]


def _lines(session: ExaminedFile) -> list[str]:
    snapshot, rows, meta = session.snapshot, session.rows, session.rows.meta
    lines = [f"{snapshot.path}: {len(snapshot.data)} bytes"]
    if snapshot.writer:
        lines.append(f"is being written by {snapshot.writer}; this is how it was a moment ago")
    if not snapshot.writable:
        lines.append("may not be written by you: only reading is possible")
    if session.foreign:
        return [*lines, f"not a session: {session.foreign}"]
    if snapshot.logged:
        lines.append(f"{snapshot.logged} pages are in the log beside it (-wal) only: keep both")
    world = {"true": "simulated", "false": "real"}.get(meta.get("simulated", ""), "unknown if real")
    made = {"created": "at an unknown time", "rig_version": "of unknown version"} | meta
    lines.append(f"a session made {made['created']} by rig {made['rig_version']}, {world}")
    for table, name in _NUMBERED.items():
        if count := len(rows.tables[table]):
            missing = rows.gaps(table)
            gap = f"{missing} before the last are missing" if missing else "no gap"
            lines.append(f"{count} {name}: {gap}")
    if not rows.tables["hash"]:
        lines.append("no chain of hashes: an older program recorded it")
    elif any(not link[3] for link in rows.in_order("hash")):
        lines.append("its chain of hashes began later than the session")
    for recovered in session.drops:
        drop = recovered.drop
        faults = f" (recorded with faults: {sentences(drop.faults)})" if drop.faults else ""
        lines.append(f"{drop.job}: {len(drop.edges)} edges: {recovered.fate}{faults}")
    lines += [FAULTS[text in session.lost] + text for text in session.troubles]
    if session.whole:
        lines.append("everything is whole")
    states = rows.in_order("run_state")
    is_open = not states or (states[-1][3] in _OPEN and rows.tables["bytes"])  # or imported
    if snapshot.logged is None and not snapshot.writer and is_open:
        lines.append(
            "its last run is open: if there was a file of this name with -wal behind it, "
            "put it back beside this one, since it holds what came last"
        )
    return lines


def _foreign(data: bytes, pages: Pages, rows: Rows) -> str:
    if not data:
        return "it is empty"
    own = pages.header(_APPLICATION) == APPLICATION_ID
    if pages.known and own and pages.header(_FORMAT) > SCHEMA_VERSION:
        return "it was written by a newer rig: update rig"
    if any(rows.tables[name] for name in ("meta", "protocol", "bytes", "drop", "run_state")):
        return ""
    if pages.known and not own:
        return "it is another program's SQLite database"
    return "there is nothing of a session in it"


def _describe_fate(recovered: RecoveredDrop) -> str:
    return f"{recovered.drop.job}: {recovered.fate}"
