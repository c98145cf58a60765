"""Reading a session: raw records, the log of states, results and facts."""

from __future__ import annotations

import hashlib
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from rig.boards import GATES
from rig.errors import SessionError
from rig.records import Certificate, ClockSample, Drop, Edge, HostBreak, Pulse
from rig.session.faults import translated
from rig.session.foreign import RECOVER, fitting, limit_steps, members, readable, texts
from rig.session.schema import RunState

if TYPE_CHECKING:
    import sqlite3
    from collections.abc import Iterator, Mapping
    from pathlib import Path

Direction = Literal["rx", "tx"]
"""``rx``: from the device to the host; ``tx``: from the host to the device."""


UNBLINDED = "unblinded"
"""The one fact that may be added later."""
MOST_EDGES = 1 << 22
"""Of a drop that no certificate bounds: no timer that works gives more in an hour."""
_ALWAYS = {"created", "rig_version", "simulated", "origin", "protocol_sha256"}
_STATE = "iitit"  # columns of a line of the log
_DROP = "iiiiIiIIIIItItIIIIII"  # and of a drop, see rig.session.schema
# Names that are put into SQL are these only.
_GROWING = ("identity", "drop", "run_state", "ping", "reference", "host_break")


class StateEntry(NamedTuple):
    """One line of the log of run states."""

    run: int
    attempt: int
    state: RunState
    host_ns: int
    reasons: tuple[str, ...]


class ByteChunk(NamedTuple):
    """Bytes that went one way, and when the last of them did."""

    host_ns: int
    direction: Direction
    data: bytes


BESIDE = "beside"
"""Member of a stored result that is not told: what makes it quick to work out the next ones."""


class Reader:
    """Everything that can be asked of an open session.

    Parameters
    ----------
    path
        For messages.
    connection
        Checked to be a session.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection: sqlite3.Connection | None = connection
        self._meta: Mapping[str, str] = MappingProxyType(
            dict(self._rows("SELECT key, value FROM meta", kinds="tt"))
        )
        if missing := sorted(_ALWAYS - self._meta.keys()):
            raise SessionError(f"{path} does not say {missing[0]}", RECOVER)
        if self._meta["simulated"] not in {"true", "false"}:
            raise SessionError(f"{path} does not say whether it is simulated", RECOVER)

    @property
    def readonly(self) -> bool:
        """Whether nothing can be added."""
        return True

    @contextmanager
    def snapshot(self) -> Iterator[None]:
        """See the records as they stand at the first question, whatever another adds meanwhile."""
        if not self.readonly or self._opened().in_transaction:  # it alone writes, or has one
            yield
            return
        self._opened().execute("BEGIN")
        try:
            yield
        finally:
            if self._connection is not None:
                self._connection.rollback()

    @property
    def meta(self) -> Mapping[str, str]:
        """Facts fixed when the file was made: created, rig_version, origin and more."""
        return self._meta

    @property
    def simulated(self) -> bool:
        """Whether the data come from a simulation."""
        return self._meta["simulated"] == "true"

    @property
    def unblinded(self) -> str:
        """When the numbers of a blind session were shown; empty before."""
        return self._meta.get(UNBLINDED, "")

    @property
    def protocol_text(self) -> str:
        """The protocol file word for word."""
        return str(self._one("SELECT text FROM protocol", "t"))

    @property
    def protocol_source(self) -> str:
        """The protocol file's name when the session was made."""
        return str(self._one("SELECT source FROM protocol", "t"))

    def identities(self) -> list[tuple[int, dict[str, Any]]]:
        """Host time and content of every identity, in order."""
        with readable(self.path):
            rows = self._rows("SELECT host_ns, json FROM identity ORDER BY id", kinds="it")
            return [(host_ns, members(text)) for host_ns, text in rows]

    def byte_log(self) -> Iterator[ByteChunk]:
        """All bytes in both directions, in order, read as they are asked for."""
        sql = "SELECT host_ns, direction, data FROM bytes ORDER BY id"
        for row in self._rows(sql, kinds="itb"):
            if row[1] not in {"rx", "tx"}:
                raise SessionError(f"{self.path} has bytes of no direction", RECOVER)
            yield ByteChunk(*row)

    def pings(self, after: int = 0) -> list[ClockSample]:
        """Clock samples in order, all but the first so many."""
        # Nothing is ever deleted, so rows are numbered from 1 without gaps.
        rows = self._rows(
            "SELECT host_send_ns, host_recv_ns, tick FROM ping WHERE id > ? ORDER BY id",
            after,
            kinds="iii",
        )
        return [ClockSample(*row) for row in rows]

    def pulses(self) -> list[Pulse]:
        """All pulses of the 1 Hz reference that were asked for, in order."""
        columns = "host_send_ns, host_recv_ns, number, tick"
        return [Pulse(*row) for row in self._newer("reference", columns)]

    def host_breaks(self) -> list[HostBreak]:
        """When the host slept or its clock was set, in order."""
        columns = "host_ns, slept_ns, stepped_ns"
        return [HostBreak(*row) for row in self._newer("host_break", columns)]

    def drops(self) -> Iterator[Drop]:
        """Every attempt at every run, in the order of recording."""
        rows = list(self._rows('SELECT * FROM "drop" ORDER BY id', kinds=_DROP))
        yield from map(self._drop, rows)

    def drop(self, run: int, attempt: int) -> Drop | None:
        """Return one recorded attempt; `None` when there is no such record."""
        sql = 'SELECT * FROM "drop" WHERE run = ? AND attempt = ?'
        rows = self._rows(sql, run, attempt, kinds=_DROP)
        return next(map(self._drop, list(rows)), None)

    def latest_drops(self, run: int | None = None) -> list[Drop]:
        """Return the last attempt at each run, by run, or at one run."""
        rows = self._rows(
            'SELECT * FROM "drop" AS d WHERE run = ifnull(?, run) AND attempt = '
            '(SELECT max(attempt) FROM "drop" WHERE run = d.run) ORDER BY run',
            run,
            kinds=_DROP,
        )
        return [self._drop(row) for row in list(rows)]

    def states(self, run: int | None = None) -> list[StateEntry]:
        """Return the log of run states, in order: the whole of it, or of one run."""
        which, values = ("", ()) if run is None else ("WHERE run = ?", (run,))
        rows = self._rows(
            f"SELECT run, attempt, state, host_ns, reasons FROM run_state {which} ORDER BY id",  # noqa: S608
            *values,
            kinds=_STATE,
        )
        with readable(self.path):
            return [_state(row) for row in rows]

    def fired_ns(self) -> dict[tuple[int, int], int]:
        """Return by run and attempt when the host's log says that it was fired."""
        rows = self._rows(
            "SELECT run, attempt, host_ns FROM run_state WHERE state = ? ORDER BY id",
            RunState.FIRED,
            kinds="iii",
        )
        return {(run, attempt): host_ns for run, attempt, host_ns in rows}

    def latest_state(self, run: int) -> StateEntry | None:
        """Where a run stands; `None` when the log does not name it."""
        rows = self._rows(
            "SELECT run, attempt, state, host_ns, reasons FROM run_state WHERE run = ? "
            "ORDER BY id DESC LIMIT 1",
            run,
            kinds=_STATE,
        )
        with readable(self.path):
            return next(map(_state, rows), None)

    def extent(self) -> str:
        """Say how far the records go from which results follow: they are only ever added to."""
        there = {name for (name,) in self._rows("SELECT name FROM sqlite_master", kinds="t")}
        ends = [
            f"{table} {last}"
            for table in _GROWING
            if table in there  # older files have fewer
            for (last,) in self._rows(f'SELECT ifnull(max(id), 0) FROM "{table}"', kinds="i")  # noqa: S608
        ]
        return ", ".join(ends)

    def results_of(self, analysis_version: str) -> list[dict[str, Any]]:
        """Return the results if they were put by this version; none if by another."""
        sql = "SELECT json FROM result WHERE analysis_version = ? ORDER BY run, attempt"
        with readable(self.path):
            rows = self._rows(sql, analysis_version, kinds="t")
            return [_told(text) for (text,) in rows]

    def results(self) -> list[dict[str, Any]]:
        """Return derived results as last put, by run and attempt."""
        with readable(self.path):
            rows = self._rows("SELECT json FROM result ORDER BY run, attempt", kinds="t")
            return [_told(text) for (text,) in rows]

    def beside_results(self, program: str) -> dict[tuple[int, int], Any]:
        """Return what a version of the program put beside its results, by run and attempt."""
        sql = "SELECT run, attempt, analysis_version, json FROM result"
        with readable(self.path):
            put = {
                (run, attempt): members(text).get(BESIDE)
                for run, attempt, version, text in self._rows(sql, kinds="iitt")
                if version.startswith(f"{program} ")
            }
        return {job: found for job, found in put.items() if found is not None}

    def check(self) -> None:
        """Read everything there is once.

        Raises
        ------
        SessionError
            Something of it cannot be read.
        """
        self.extent()
        self.identities()
        for _ in self.byte_log():
            pass
        self.pings()
        self.pulses()
        self.host_breaks()
        self.states()
        for _ in self.drops():
            pass
        self.results()
        if hashlib.sha256(self.protocol_text.encode()).hexdigest() != self._meta["protocol_sha256"]:
            raise SessionError(f"{self.path}: its protocol was altered", RECOVER)
        _ = self.protocol_source

    def _opened(self) -> sqlite3.Connection:
        if self._connection is None:
            raise SessionError(f"{self.path} is closed", "open it again")
        return self._connection

    def _rows(self, sql: str, *values: object, kinds: str) -> Iterator[tuple[Any, ...]]:
        """Read rows, each looked at: see `rig.session.foreign.fitting`."""
        with translated(self.path), readable(self.path):
            connection = self._opened()
            if self.readonly:
                limit_steps(connection)
            # Not the cursor itself: it would be closed with this generator, which a traceback can
            # keep alive until after the database.
            for row in iter(connection.execute(sql, values).fetchone, None):
                yield fitting(row, kinds[: len(row)])

    def _newer(self, table: str, columns: str) -> Iterator[tuple[Any, ...]]:
        """Read a table that a file of an older format, opened read-only, does not have."""
        if any(self._rows("SELECT 1 FROM sqlite_master WHERE name = ?", table, kinds="i")):
            sql = f"SELECT {columns} FROM {table} ORDER BY id"  # noqa: S608
            yield from self._rows(sql, kinds="iiii")

    def _one(self, sql: str, kind: str) -> Any:
        row = next(self._rows(sql, kinds=kind), None)
        if row is None:
            raise SessionError(f"{self.path} has lost its protocol", RECOVER)
        return row[0]

    def _drop(self, row: tuple[Any, ...]) -> Drop:
        number, run, attempt, tick_hz, fire_tick, initial_state, events, *counts = row[:11]
        # A file of the first format, opened read-only, has no release sense.
        certificate = None
        if events is not None:
            if None in counts:
                raise SessionError(f"{self._which(run, attempt)} has half a certificate", RECOVER)
            certificate = Certificate(events, *counts, *row[14:])
        # An event is a change of one gate or more.
        most = MOST_EDGES if certificate is None else max(0, min(MOST_EDGES, GATES * events))
        edges = list(
            self._rows(
                'SELECT tick, channel, blocked FROM edge WHERE "drop" = ? ORDER BY idx LIMIT ?',
                number,
                most + 1,
                kinds="iii",
            )
        )
        if len(edges) > most:
            raise SessionError(f"{self._which(run, attempt)} has more than {most} edges", RECOVER)
        with readable(self.path):
            return Drop(
                run=run,
                attempt=attempt,
                tick_hz=tick_hz,
                edges=tuple(Edge(tick, channel, bool(blocked)) for tick, channel, blocked in edges),
                fire_tick=fire_tick,
                initial_state=initial_state,
                certificate=certificate,
                faults=texts(row[11]),
            )

    def _which(self, run: int, attempt: int) -> str:
        return f"{self.path}: run {run}, attempt {attempt},"


def _told(text: str) -> dict[str, Any]:
    found = members(text)
    found.pop(BESIDE, None)
    return found


def _state(row: tuple[Any, ...]) -> StateEntry:
    run, attempt, state, host_ns, reasons = row
    return StateEntry(run, attempt, RunState(state), host_ns, texts(reasons))
