"""Reader of a session: raw records, the log of run states, and metadata."""

import hashlib
import sqlite3
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

from rig.boards import GATES
from rig.errors import RigError
from rig.reasons import errors_become, rig_error
from rig.records import ClockSample, Direction, Drop, HostBreak, Job, Pulse
from rig.session.drop_check import WHOLE, ByteReplay, check_drop
from rig.session.faults import translate_errors
from rig.session.foreign import limit_steps
from rig.session.rows import RowError, check_rows, drop_of, named_values
from rig.session.schema import TABLES, Reasons, Row, RunState, read_identity, read_reasons

T = TypeVar("T")

UNBLINDED = "unblinded"
"""The only key of the metadata that may be added later."""
MOST_EDGES = 1 << 22
"""Most edges of a drop without a certificate: no working timer gives more in an hour."""
_AT_ONCE = 1024
"""Rows fetched at once."""
_ALWAYS = {"created", "rig_version", "simulated", "origin", "protocol_sha256"}


class StateEntry(NamedTuple):
    """An entry of the log of run states."""

    run: int
    attempt: int
    state: RunState
    host_ns: int
    reasons: Reasons


class ByteChunk(NamedTuple):
    """Bytes in one direction, with the host time of the last."""

    host_ns: int
    direction: Direction
    data: bytes


class AttachedFile(NamedTuple):
    """A file attached to a session, with its time (UTC)."""

    added: str
    name: str
    data: bytes


class Reader:
    """Read access to an open session.

    Parameters
    ----------
    path
        Path for messages.
    connection
        Connection to a checked session.

    Attributes
    ----------
    readonly
        Whether the session cannot be written.
    meta
        Metadata fixed at creation: created, rig_version, origin and more.
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
        """Read all records inside the block as of the first query, in spite of a writer."""
        begins = self.readonly and not self.connection.in_transaction  # a writer is alone
        if begins:
            self.connection.execute("BEGIN")
        try:
            yield
        finally:
            if begins and self._connection is not None:
                self._connection.rollback()

    @property
    def connection(self) -> sqlite3.Connection:
        """The open SQLite connection."""
        if self._connection is None:
            raise rig_error("session_closed", path=self.path)
        return self._connection

    def digest(self) -> str | None:
        """Return the SHA-256 of all records; `None` if they do not come from a session file."""
        with translate_errors(self.path):
            return hashlib.sha256(self.connection.serialize()).hexdigest()

    @property
    def simulated(self) -> bool:
        """Whether the data come from a simulation."""
        return self.meta["simulated"] == "true"

    @property
    def unblinded(self) -> str:
        """Time at which a blind session was unblinded; empty before."""
        return self.meta.get(UNBLINDED, "")

    @property
    def protocol_text(self) -> str:
        """Text of the protocol file, word for word."""
        text = str(self._protocol()[2])
        if hashlib.sha256(text.encode()).hexdigest() != self.meta["protocol_sha256"]:
            raise self._damage("its protocol was altered")
        return text

    @property
    def protocol_source(self) -> str:
        """Name of the protocol file at the session's creation."""
        return str(self._protocol()[1])

    def identities(self) -> list[tuple[int, dict[str, Any]]]:
        """Return host time and content of every identity record, in order."""
        return [(ns, read_identity(text)) for _, ns, text in self._rows("identity", "ORDER BY id")]

    def byte_log(self, after: int = 0) -> Iterator[ByteChunk]:
        """Return all chunks of bytes in order, without the first `after`.

        The iterator reads them lazily.
        """
        return self._records(ByteChunk, "bytes", after)

    def pings(self, after: int = 0) -> list[ClockSample]:
        """Return the clock samples in order, without the first `after`."""
        return [*self._records(ClockSample, "ping", after)]

    def pulses(self) -> list[Pulse]:
        """Return all recorded pulses of the 1 Hz reference, in order."""
        return [*self._records(Pulse, "reference")]

    def host_breaks(self) -> list[HostBreak]:
        """Return all breaks of the host's clock (sleep, or clock set), in order."""
        return [*self._records(HostBreak, "host_break")]

    def attached_files(self) -> list[AttachedFile]:
        """Return all attached files, in order."""
        return [*self._records(AttachedFile, "attachment")]

    def drops(self, replay: ByteReplay | None = None) -> Iterator[Drop]:
        """Return all recorded drops in the order of recording, checked against their bytes.

        Parameters
        ----------
        replay
            Replay of this session's bytes from an earlier call, so that only new bytes are read.
        """
        rows = [*self._raw("drop", "ORDER BY id")]
        replay = ByteReplay() if replay is None else replay
        replay.feed(self.byte_log(after=replay.fed))
        replayed = replay.drops()
        for row in rows:
            yield self._drop(row, replayed)

    def drop(self, run: int, attempt: int) -> Drop | None:
        """Return a recorded attempt without a check of its bytes; `None` if there is none."""
        rows = self._raw("drop", "WHERE run = ? AND attempt = ?", run, attempt)
        return next((self._drop(row, {}) for row in list(rows)), None)

    def latest_drops(self, run: int | None = None) -> list[Drop]:
        """Return the last attempt at each run, or at one run, checked against its bytes."""
        drops = (drop for drop in self.drops() if run in {None, drop.run})
        return [*{drop.run: drop for drop in sorted(drops, key=lambda drop: drop.job)}.values()]

    def states(self, after: int = 0) -> list[StateEntry]:
        """Return the log of run states in order, without the first `after`."""
        return [*self._records(_state, "run_state", after)]

    def fired_ns(self) -> dict[tuple[int, int], int]:
        """Return the host time of firing from the log of states, by run and attempt."""
        return {row[:2]: row.host_ns for row in self.states() if row.state is RunState.FIRED}

    def latest_state(self, run: int) -> StateEntry | None:
        """Return the latest state of a run; `None` if it has none."""
        rows = self._rows("run_state", "WHERE run = ? ORDER BY id DESC LIMIT 1", run)
        return next((_state(*row[1:]) for row in rows), None)

    def check(self) -> None:
        """Read all records once.

        Raises
        ------
        SessionError
            A record cannot be read.
        """
        for table in TABLES:
            if table not in {"drop", "edge"}:
                deque(self._rows(table), maxlen=0)
        for drop in self.drops():
            if drop.damage:
                raise self._damage(f"{drop.job}: {drop.damage}")
        _ = self.protocol_text

    def _raw(self, table: str, which: str, *values: object) -> Iterator[Row]:
        """Return rows unchecked; `table` and `which` are constants of this module."""
        return chain.from_iterable(self._batches(table, which, *values))

    def _batches(self, table: str, which: str, *values: object) -> Iterator[list[Row]]:
        def fetch() -> list[Row]:
            with translate_errors(self.path):
                return cursor.fetchmany(_AT_ONCE)

        with translate_errors(self.path):
            if self.readonly:
                limit_steps(self.connection)
            cursor = self.connection.execute(f'SELECT * FROM "{table}" {which}', values)  # noqa: S608
        # Not a generator: Python closes an unfinished generator by itself, and a Ctrl-C during
        # that is printed and lost.
        return iter(fetch, [])

    def _rows(self, table: str, which: str = "", *values: object) -> Iterator[Row]:
        """Return rows, each checked.

        Raises
        ------
        SessionError
            A row has an invalid value; names both.
        """
        # A file of an older format that is open read-only may lack tables.
        if TABLES[table].since > 1 and not any(self._raw("sqlite_master", "WHERE name = ?", table)):
            return
        for rows in self._batches(table, which, *values):
            self._check(table, rows)
            yield from rows

    def _records(self, kind: Callable[..., T], table: str, after: int = 0) -> Iterator[T]:
        """Return the records of a table in order, without the first `after`."""
        # Rows are never deleted, so their numbers have no gaps.
        rows = self._rows(table, "WHERE id > ? ORDER BY id", after)
        return (kind(*row[1:]) for row in rows)

    def _check(self, table: str, rows: Sequence[Row]) -> None:
        with errors_become("session_wrong", RowError, path=self.path):
            check_rows(table, rows)

    def _protocol(self) -> Row:
        row = next(self._rows("protocol"), None)
        if row is None:
            raise self._damage("it has lost its protocol")
        return row

    def _drop(self, row: Row, replayed: Mapping[Job, Drop]) -> Drop:
        self._check("drop", [row[:3]])  # without these the drop is unknown
        try:
            check_rows("drop", [row])
            stored = drop_of(row, self._edges(row))
            if check_drop(stored, replayed) in WHOLE:
                return stored
            why = stored.damage or "its edges do not agree with its bytes or its certificate"
        except RowError as error:
            why = str(error)
        # No other value of the row can be trusted.
        return Drop(row[1], row[2], tick_hz=1, edges=(), damage=why)

    def _damage(self, text: str) -> RigError:
        return rig_error("session_wrong", path=self.path, text=text)

    def _edges(self, row: Row) -> list[Row]:
        events = named_values(row)["events"]
        # An event is a change of one or more gates.
        most = MOST_EDGES if events is None else min(MOST_EDGES, GATES * events)
        edges = [*self._raw("edge", 'WHERE "drop" = ? ORDER BY idx LIMIT ?', row[0], most + 1)]
        check_rows("edge", edges)
        if len(edges) > most:
            raise RowError(f"it has more than {most} edges")
        return edges


def _state(run: int, attempt: int, state: str, reasons: str, host_ns: int) -> StateEntry:
    return StateEntry(run, attempt, RunState(state), host_ns, read_reasons(reasons))
