"""Reading a session: raw records, the log of states and facts."""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar

from rig.boards import GATES
from rig.errors import SessionError
from rig.reasons import Reason, make_error
from rig.records import ClockSample, Drop, HostBreak, Job, Pulse
from rig.session.drop_check import ByteReplay, check_drop
from rig.session.faults import translate_errors
from rig.session.foreign import limit_steps
from rig.session.rows import RowError, check_row, drop_of, named_values
from rig.session.schema import TABLES, Row, RunState, read_identity, read_reasons

if TYPE_CHECKING:
    import sqlite3

T = TypeVar("T")
Direction = Literal["rx", "tx"]
"""``rx``: from the device to the host; ``tx``: from the host to the device."""


UNBLINDED = "unblinded"
"""The one fact that may be added later."""
MOST_EDGES = 1 << 22
"""Of a drop that no certificate bounds: no timer that works gives more in an hour."""
_AT_ONCE = 256
"""Rows that are fetched in one go."""
_AFTER = "WHERE id > ? ORDER BY id"
"""All but the first so many rows: nothing is ever deleted, so their numbers have no gaps."""
_ALWAYS = {"created", "rig_version", "simulated", "origin", "protocol_sha256"}


class StateEntry(NamedTuple):
    """One line of the log of run states."""

    run: int
    attempt: int
    state: RunState
    host_ns: int
    reasons: tuple[Reason, ...]


class ByteChunk(NamedTuple):
    """Bytes that went one way, and when the last of them did."""

    host_ns: int
    direction: Direction
    data: bytes


class AttachedFile(NamedTuple):
    """A file that was attached to a session, and when (UTC)."""

    added: str
    name: str
    data: bytes


class Reader:
    """Everything that can be asked of an open session.

    Parameters
    ----------
    path
        For messages.
    connection
        Checked to be a session.

    Attributes
    ----------
    readonly
        Whether nothing can be added.
    meta
        Facts fixed when the file was made: created, rig_version, origin and more.
    """

    readonly = True

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection: sqlite3.Connection | None = connection
        self.meta: Mapping[str, str] = MappingProxyType(dict(self._rows("meta")))
        if missing := sorted(_ALWAYS - self.meta.keys()):
            raise self._damage(f"it does not say {missing[0]}")
        if self.meta["simulated"] not in {"true", "false"}:
            raise self._damage("it does not say whether it is simulated")
        try:
            datetime.fromisoformat(self.meta["created"])
        except ValueError:
            raise self._damage("it does not say when it was made") from None

    @contextmanager
    def snapshot(self) -> Iterator[None]:
        """See the records as they stand at the first question, whatever another adds meanwhile."""
        begins = self.readonly and not self.connection.in_transaction  # else it alone writes
        if begins:
            self.connection.execute("BEGIN")
        try:
            yield
        finally:
            if begins and self._connection is not None:
                self._connection.rollback()

    @property
    def connection(self) -> sqlite3.Connection:
        """The open file, for another way to read it too."""
        if self._connection is None:
            raise make_error(SessionError, "session_closed", path=self.path)
        return self._connection

    def digest(self) -> str | None:
        """Return the SHA-256 of all records as they stand; `None` where they are not the file's."""
        with translate_errors(self.path):
            return hashlib.sha256(self.connection.serialize()).hexdigest()

    @property
    def simulated(self) -> bool:
        """Whether the data come from a simulation."""
        return self.meta["simulated"] == "true"

    @property
    def unblinded(self) -> str:
        """When the numbers of a blind session were shown; empty before."""
        return self.meta.get(UNBLINDED, "")

    @property
    def protocol_text(self) -> str:
        """The protocol file word for word."""
        text = str(self._protocol()[2])
        if hashlib.sha256(text.encode()).hexdigest() != self.meta["protocol_sha256"]:
            raise self._damage("its protocol was altered")
        return text

    @property
    def protocol_source(self) -> str:
        """The protocol file's name when the session was made."""
        return str(self._protocol()[1])

    def identities(self) -> list[tuple[int, dict[str, Any]]]:
        """Host time and content of every identity, in order."""
        rows = self._rows("identity", "ORDER BY id")
        return [(host_ns, read_identity(text)) for _, host_ns, text in rows]

    def byte_log(self, after: int = 0) -> Iterator[ByteChunk]:
        """All bytes in both directions, in order, but for the first so many chunks.

        They are read as they are asked for.
        """
        return self._records(ByteChunk, "bytes", _AFTER, after)

    def pings(self, after: int = 0) -> list[ClockSample]:
        """Clock samples in order, all but the first so many."""
        return [*self._records(ClockSample, "ping", _AFTER, after)]

    def pulses(self) -> list[Pulse]:
        """All pulses of the 1 Hz reference that were asked for, in order."""
        return [*self._records(Pulse, "reference", _AFTER, 0)]

    def host_breaks(self) -> list[HostBreak]:
        """When the host slept or its clock was set, in order."""
        return [*self._records(HostBreak, "host_break", _AFTER, 0)]

    def attached_files(self) -> list[AttachedFile]:
        """All files that were attached, in order."""
        return [*self._records(AttachedFile, "attachment", _AFTER, 0)]

    def drops(self, replay: ByteReplay | None = None) -> Iterator[Drop]:
        """Every attempt at every run, in the order of recording, compared with its bytes.

        Parameters
        ----------
        replay
            Of this session's bytes, from an earlier call: only what is new is read then.
        """
        rows = [*self._raw("drop", "ORDER BY id")]
        replay = ByteReplay() if replay is None else replay
        replay.feed(self.byte_log(after=replay.fed))
        replayed = replay.drops()
        for row in rows:
            yield self._drop(row, replayed)

    def drop(self, run: int, attempt: int) -> Drop | None:
        """Return one recorded attempt, without a look at its bytes; `None` if there is none."""
        rows = self._raw("drop", "WHERE run = ? AND attempt = ?", run, attempt)
        return next((self._drop(row, {}) for row in list(rows)), None)

    def latest_drops(self, run: int | None = None) -> list[Drop]:
        """Return the last attempt at each run, by run, or at one run, compared with its bytes."""
        drops = (drop for drop in self.drops() if run in {None, drop.run})
        return [*{drop.run: drop for drop in sorted(drops, key=lambda drop: drop.job)}.values()]

    def states(self, run: int | None = None) -> list[StateEntry]:
        """Return the log of run states, in order: the whole of it, or of one run."""
        which = "WHERE ?1 IS NULL OR run = ?1 ORDER BY id"
        return [*self._records(_state, "run_state", which, run)]

    def fired_ns(self) -> dict[tuple[int, int], int]:
        """Return by run and attempt when the host's log says that it was fired."""
        states = self.states()
        return {entry[:2]: entry.host_ns for entry in states if entry.state is RunState.FIRED}

    def latest_state(self, run: int) -> StateEntry | None:
        """Where a run stands; `None` when the log does not name it."""
        which = "WHERE run = ? ORDER BY id DESC LIMIT 1"
        return next(self._records(_state, "run_state", which, run), None)

    def check(self) -> None:
        """Read everything there is once.

        Raises
        ------
        SessionError
            Something of it cannot be read.
        """
        for table in TABLES:
            if table not in {"drop", "edge"}:
                deque(self._rows(table), maxlen=0)
        for drop in self.drops():
            if drop.damage:
                raise self._damage(f"{drop.job}: {drop.damage}")
        _ = self.protocol_text

    def _raw(self, table: str, which: str, *values: object) -> Iterator[Row]:
        """Read rows as they are; `table` and `which` are of this module only."""

        def fetch() -> list[Row]:
            with translate_errors(self.path):
                return cursor.fetchmany(_AT_ONCE)

        with translate_errors(self.path):
            if self.readonly:
                limit_steps(self.connection)
            cursor = self.connection.execute(f'SELECT * FROM "{table}" {which}', values)  # noqa: S608
        # No generator: where one is left half read, Python ends it by its own hand, and a Ctrl-C
        # that comes meanwhile is shown and lost.
        return chain.from_iterable(iter(fetch, []))

    def _rows(self, table: str, which: str = "", *values: object) -> Iterator[Row]:
        """Read rows, each of them checked.

        Raises
        ------
        SessionError
            Which value of which row cannot be.
        """
        # A file of an older format that was opened read-only has not all tables.
        if TABLES[table].since > 1 and not any(self._raw("sqlite_master", "WHERE name = ?", table)):
            return
        for row in self._raw(table, which, *values):
            self._check(table, row)
            yield row

    def _records(
        self, kind: Callable[..., T], table: str, which: str, *args: object
    ) -> Iterator[T]:
        return (kind(*row[1:]) for row in self._rows(table, which, *args))

    def _check(self, table: str, row: Row) -> None:
        try:
            check_row(table, row)
        except RowError as error:
            raise self._damage(str(error)) from error

    def _protocol(self) -> Row:
        row = next(self._rows("protocol"), None)
        if row is None:
            raise self._damage("it has lost its protocol")
        return row

    def _drop(self, row: Row, replayed: Mapping[Job, Drop]) -> Drop:
        self._check("drop", row[:3])  # else nobody knows which drop it is
        try:
            check_row("drop", row)
            stored = drop_of(row, self._edges(row))
            if check_drop(stored, replayed).whole:
                return stored
            why = stored.damage or "its edges do not agree with its bytes or its certificate"
        except RowError as error:
            why = str(error)
        # Of its numbers none can be trusted.
        return Drop(row[1], row[2], tick_hz=1, edges=(), damage=why)

    def _damage(self, text: str) -> SessionError:
        return make_error(SessionError, "session_wrong", path=self.path, text=text)

    def _edges(self, row: Row) -> list[Row]:
        number, events = row[0], named_values(row)["events"]
        # An event is a change of one gate or more.
        most = MOST_EDGES if events is None else min(MOST_EDGES, GATES * events)
        edges = [*self._raw("edge", 'WHERE "drop" = ? ORDER BY idx LIMIT ?', number, most + 1)]
        for edge in edges:
            check_row("edge", edge)
        if len(edges) > most:
            raise RowError(f"it has more than {most} edges")
        return edges


def _state(run: int, attempt: int, state: str, reasons: str, host_ns: int) -> StateEntry:
    return StateEntry(run, attempt, RunState(state), host_ns, read_reasons(reasons))
