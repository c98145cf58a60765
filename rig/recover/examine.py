"""What a session file is, and what of it is whole."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.printable import printable
from rig.reasons import sentences
from rig.recover.drops import Recovered, recover_drops
from rig.recover.pages import MAGIC, Pages, read_pages
from rig.recover.rows import Rows, find_rows, gaps
from rig.recover.snapshot import SessionCopy, take_snapshot
from rig.session.drop_check import Fate
from rig.session.schema import APPLICATION_ID, SCHEMA_VERSION, RunState

if TYPE_CHECKING:
    import os

_NUMBERED = {
    "bytes": "chunks of bytes",
    "ping": "clock samples",
    "reference": "reference pulses",
    "run_state": "run states",
    "identity": "identities of the device",
    "drop": "drops",
}
_GOOD = (Fate.CONFIRMED, Fate.IMPORTED)
_OPEN = (RunState.ARMED, RunState.FIRED, RunState.RECORDED)


@dataclass(frozen=True, slots=True)
class Examined:
    """A session file after a look at it.

    Attributes
    ----------
    snapshot, pages, rows
        What was read, from bytes to rows.
    drops
        The best of each drop.
    foreign
        Why it is no session at all; empty for a session.
    damage
        What is wrong with the file.
    lost
        What nothing brings back.
    """

    snapshot: SessionCopy
    pages: Pages
    rows: Rows
    drops: list[Recovered]
    foreign: str
    damage: tuple[str, ...]
    lost: tuple[str, ...]

    @property
    def whole(self) -> bool:
        """Whether it is a session with nothing wrong."""
        return not (self.foreign or self.troubles)

    @property
    def troubles(self) -> list[str]:
        """Everything that is not as it should be, one sentence each."""
        doubtful = [_fate(one) for one in self.drops if one.fate not in _GOOD]
        return list(dict.fromkeys([*self.damage, *self.lost, *doubtful]))


def examine(path: str | os.PathLike[str]) -> Examined:
    """Look at a session file, which stays as it is.

    Raises
    ------
    SessionError
        It cannot be read at all.
    """
    snapshot = take_snapshot(path)
    pages = read_pages(snapshot.data)
    rows = find_rows(pages)
    drops = recover_drops(rows)
    foreign = _foreign(snapshot, pages, rows)
    if foreign:
        return Examined(snapshot, pages, rows, drops, foreign, (), ())
    damage, lost = tuple(_damage(snapshot, pages, rows)), tuple(_lost(rows, drops))
    return Examined(snapshot, pages, rows, drops, foreign, damage, lost)


def describe(found: Examined) -> list[str]:
    """Say it in lines, safe for a terminal whatever stands in the file."""
    return [printable(line).replace("\n", " ").replace("\t", " ") for line in _described(found)]


def _described(found: Examined) -> list[str]:
    snapshot, rows = found.snapshot, found.rows
    lines = [f"{snapshot.path}: {len(snapshot.data)} bytes"]
    if snapshot.writer:
        lines.append(f"is being written by {snapshot.writer}; this is how it was a moment ago")
    if not snapshot.writable:
        lines.append("may not be written by you: only reading is possible")
    if found.foreign:
        return [*lines, f"not a session: {found.foreign}"]
    if snapshot.logged:
        lines.append(f"{snapshot.logged} pages are in the log beside it (-wal) only: keep both")
    meta = rows.meta
    what = {"true": "simulated", "false": "real"}.get(meta.get("simulated", ""), "unknown if real")
    lines.append(
        f"a session made {meta.get('created', 'at an unknown time')} by rig "
        f"{meta.get('rig_version', 'of unknown version')}, {what}"
    )
    for table, name in _NUMBERED.items():
        numbers = getattr(rows, table)
        if numbers:
            missing = gaps(numbers)
            lines.append(
                f"{len(numbers)} {name}: "
                + (f"{missing} before the last are missing" if missing else "no gap")
            )
    lines += [
        f"run {one.drop.run}, attempt {one.drop.attempt}: {len(one.drop.edges)} edges: {one.fate}"
        + (f" (recorded with faults: {sentences(one.drop.faults)})" if one.drop.faults else "")
        for one in found.drops
    ]
    lines += [f"damaged: {what}" for what in found.damage]
    lines += [f"lost: {what}" for what in found.lost]
    if found.whole:
        lines.append("everything is whole")
    if snapshot.logged is None and not snapshot.writer and _unfinished(rows):
        lines.append(
            "its last run is open: if there was a file of this name with -wal behind it, "
            "put it back beside this one, since it holds what came last"
        )
    return lines


def _foreign(snapshot: SessionCopy, pages: Pages, rows: Rows) -> str:
    if not snapshot.data:
        return "it is empty"
    first = pages.pages.get(1, b"")
    if first.startswith(MAGIC):
        application = int.from_bytes(first[68:72], "big")
        if application != APPLICATION_ID and not rows.any():
            return "it is another program's SQLite database"
        if application == APPLICATION_ID and int.from_bytes(first[60:64], "big") > SCHEMA_VERSION:
            return "it was written by a newer rig: update rig"
    if not rows.any():
        return "there is nothing of a session in it"
    return ""


def _damage(snapshot: SessionCopy, pages: Pages, rows: Rows) -> list[str]:
    damage = []
    if pages.missing:
        damage.append(f"{pages.missing} of {pages.expected} pages are not there: the file is torn")
    if snapshot.complaints:
        damage.append(f"SQLite cannot read it as it is: {snapshot.complaints[0]}")
    if snapshot.unreadable:
        damage.append(f"rig cannot read it as it is: {snapshot.unreadable}")
    if rows.bad:
        damage.append(f"{rows.bad} records cannot be read")
    orphans = len(rows.edge.keys() - rows.drop.keys())
    if orphans:
        damage.append(f"nothing says what drops {orphans} groups of edges belong to")
    return damage


def _lost(rows: Rows, drops: list[Recovered]) -> list[str]:
    lost = []
    if "simulated" not in rows.meta:
        lost.append("whether it is simulated, when and by what it was made")
    if rows.protocol is None:
        lost.append("the protocol file")
    elif not protocol_sound(rows):
        lost.append("the protocol's text has changed since the session was made")
    lost += [
        f"{missing} {name}"
        for table, name in _NUMBERED.items()
        if (missing := gaps(getattr(rows, table)))
    ]
    return [*lost, *(_fate(one) for one in drops if one.fate is Fate.PARTIAL)]


def _fate(one: Recovered) -> str:
    return f"run {one.drop.run}, attempt {one.drop.attempt}: {one.fate}"


def protocol_sound(rows: Rows) -> bool:
    """Whether the protocol's text is the one that the session was made with, as far as known."""
    if rows.protocol is None:
        return False
    digest = hashlib.sha256(rows.protocol[1].encode()).hexdigest()
    return rows.meta.get("protocol_sha256", digest) == digest


def _unfinished(rows: Rows) -> bool:
    if not rows.run_state:
        return True
    return RunState(str(rows.run_state[max(rows.run_state)][3])) in _OPEN
