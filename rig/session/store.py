"""The session: an SQLite file with all records of an experiment, in order."""

import hashlib
import json
import logging
import os
import platform
import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, suppress
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from time import monotonic
from types import MappingProxyType
from typing import Self

from rig import __version__
from rig.errors import InputError, RigError, SessionError
from rig.files import make_folder, state_folder
from rig.printable import encodable
from rig.reasons import Reason, rig_error
from rig.records import ClockSample, Direction, Drop, HostBreak, Pulse
from rig.session.database import build, check_place, connect
from rig.session.faults import translate_errors
from rig.session.journal import Journal
from rig.session.lock import WriterLock
from rig.session.presence import Presence
from rig.session.reading import UNBLINDED, Reader
from rig.session.rows import rows_of
from rig.session.schema import TABLES, Record, RunState, write_reasons

log = logging.getLogger(__name__)
_TIMINGS = {ClockSample: "ping", Pulse: "reference", HostBreak: "host_break"}


class Session(Reader, AbstractContextManager["Session"]):
    """An open session file; use `create` or `open`.

    Added records wait in an open transaction until `commit`, which returns when they are on disk.
    Raw records can be added, never altered. A session belongs to a single thread; any number of
    read-only sessions may be open on the same file.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection, lock: WriterLock | None) -> None:
        self._lock, self.readonly = lock, lock is None
        super().__init__(path, connection)
        self._journal = Journal(connection, path)
        self._presence = Presence(path)
        self._loss: RigError | None = None
        self.rescued = False  # saved completely elsewhere, as the file was moved or deleted
        # Counted here, not by SQLite, so that a repeated commit writes the same rows.
        self._last_drop = max((row[0] for row in self._raw("drop", "")), default=0)

    @classmethod
    def create(
        cls, path: str | os.PathLike[str], text: str, source: str, *, simulated: bool, origin: str
    ) -> Self:
        """Create a new session file and open it for writing.

        Parameters
        ----------
        path
            Path of the file, which must not exist.
        text, source
            The protocol file word for word, and its name.
        simulated
            Whether the data come from a simulation; permanent, and marked on every result.
        origin
            The port's URL, or the name of the imported file.

        Raises
        ------
        SessionError
            The path exists or cannot be written.
        """
        meta = {
            "created": _now(),
            "rig_version": __version__,
            "python_version": platform.python_version(),
            "protocol_sha256": hashlib.sha256(text.encode()).hexdigest(),
            "simulated": "true" if simulated else "false",
            "origin": encodable(origin),
        }
        place = Path(os.path.realpath(path))
        protocol = 1, encodable(source), text
        rows: Record = {"meta": [*meta.items()], "protocol": [protocol]}
        return cls._connect(place, WriterLock(place), rows)

    @classmethod
    def open(cls, path: str | os.PathLike[str], readonly: bool = False) -> Self:
        """Open an existing session.

        Parameters
        ----------
        path
            The file.
        readonly
            Whether to open it read-only, beside a writer or on write-protected media.

        Raises
        ------
        SessionError
            It is missing, not a session, newer than this program, damaged, or already being written
            by another process.
        """
        place = Path(os.path.realpath(path))
        check_place(place)
        return cls._connect(place, None if readonly else WriterLock(place))

    @classmethod
    def _connect(cls, place: Path, lock: WriterLock | None, first: Record | None = None) -> Self:
        with ExitStack() as undo:
            if lock is not None:
                undo.callback(lock.release)
            if first is not None:
                build(place, first)
            connection = undo.enter_context(closing(connect(place, readonly=lock is None)))
            session = cls(place, connection, lock)
            undo.pop_all()
        return session

    # ------------------------------------------------------------------ life

    @property
    def pending(self) -> int:
        """Number of records that are not committed yet."""
        return len(self._journal.pending)

    @property
    def write_s(self) -> float:
        """Duration of the present write so far, s; 0 without a write. Safe in any thread."""
        begun_s = self._journal.begun_s
        return 0.0 if begun_s is None else monotonic() - begun_s

    def commit(self) -> None:
        """Write all added records to the disk, and return when they are durable.

        Raises
        ------
        SessionError
            The disk is full or fails: records are kept in memory; call again. Or the file was
            moved, deleted, replaced or cut: everything is saved beside it, and the session ends.
        """
        try:
            self._writable().commit()
        finally:
            self.require_presence()

    def require_presence(self) -> None:
        """Check that the file is still at its path; otherwise save all records elsewhere.

        Raises
        ------
        SessionError
            It is not; names the file with all records.
        """
        if self._loss is None and (trouble := self._presence.trouble()):
            self._loss = self._rescue(trouble)
        if self._loss is not None:
            raise self._loss

    def settle(self) -> None:
        """Merge the log (``-wal``) into the file, so that a copy of the file alone is complete.

        A concurrent reader may delay the last part until the next call.
        """
        with translate_errors(self.path):
            self.connection.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchone()
        self.require_presence()

    def _rescue(self, trouble: str) -> RigError:
        """Save all committed and pending records, and return the error that names the new file.

        Pending records also go into the open file, which is then complete wherever it was moved.
        """
        with suppress(SessionError):
            self._journal.commit()
        self._fold_in()
        try:
            try:
                place = _unused_name(self.path)
                lost = self._journal.save(place)
            except (sqlite3.Error, OSError):  # its folder is gone too
                place = _unused_name(make_folder(state_folder()) / self.path.name)
                lost = self._journal.save(place)
        except (sqlite3.Error, OSError, InputError) as error:
            return rig_error("session_unsaved", trouble=trouble, text=error)
        self.rescued = True
        log.error("%s while it was in use; everything is saved as %s", trouble, place)
        except_for = f", but for {lost} records" if lost else ""
        return rig_error("session_rescued", trouble=trouble, place=place, except_for=except_for)

    def close(self) -> None:
        """Commit and close; further calls do nothing.

        Raises
        ------
        SessionError
            The last commit fails; the file is closed nevertheless.
        """
        if (connection := self._connection) is None:
            return
        try:
            if not self.readonly and self._loss is None:
                self.commit()
                self._fold_in()
        finally:
            self._connection = None
            connection.close()
            if self.rescued:
                self._presence.remove_log()
            if self._lock is not None:
                self._lock.release()

    def _fold_in(self) -> None:
        """Merge the log into the file, so that the file alone can be copied despite readers."""
        with suppress(sqlite3.Error):
            self.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")

    def __exit__(self, *_exc: object) -> None:
        self.close()  # also after an error, to keep all measured data

    # ------------------------------------------------------------------ adding

    def add_rows(self, table: str, rows: Iterable[Sequence[object]]) -> None:
        """Add rows to a table, all or none; numbered rows get the next numbers."""
        values = [(None, *row) if TABLES[table].numbered else row for row in rows]
        self._writable().add({table: values})

    def log_bytes(self, direction: Direction, host_ns: int, data: bytes) -> None:
        """Add raw bytes received from or sent to the device."""
        self.add_rows("bytes", [(host_ns, direction, bytes(data))])

    def add_identity(self, identity: Mapping[str, object], host_ns: int) -> None:
        """Add an identity record of a device, once for each identification."""
        self.add_rows("identity", [(host_ns, json.dumps(dict(identity)))])

    def add_timing(self, record: ClockSample | Pulse | HostBreak) -> None:
        """Add a clock sample, a pulse of the 1 Hz reference or a break of the host's clock."""
        self.add_rows(_TIMINGS[type(record)], [record])

    def add_drop(self, drop: Drop, *, host_ns: int | None = None, provenance: str = "") -> None:
        """Add the raw record of a drop with its edges, all or nothing.

        Parameters
        ----------
        drop
            Drop with a new pair of run and attempt.
        host_ns
            Host time at which the record was complete, if known.
        provenance
            Origin of the record, for example ``device`` or the imported file.
        """
        journal = self._writable()
        self._last_drop += 1
        journal.add(rows_of(drop, self._last_drop, host_ns, provenance))

    def add_state(
        self, run: int, attempt: int, state: RunState, host_ns: int, reasons: Sequence[Reason] = ()
    ) -> None:
        """Add an entry to the log of run states."""
        self.add_rows("run_state", [(run, attempt, str(state), write_reasons(reasons), host_ns)])

    def attach(self, name: str, data: bytes) -> None:
        """Add a file, such as a photograph of the rig."""
        self.add_rows("attachment", [(_now(), encodable(name), data)])

    def unblind(self) -> None:
        """Record, once and on disk, that results may be shown from now on.

        Raises
        ------
        SessionError
            The session is already unblinded, or the disk fails.
        """
        now = _now()
        self.add_rows("meta", [(UNBLINDED, now)])
        self.commit()
        self.meta = MappingProxyType({**self.meta, UNBLINDED: now})

    def _writable(self) -> Journal:
        _ = self.connection
        if self._loss is not None:
            raise self._loss
        if self.readonly:
            raise rig_error("session_read_only", path=self.path)
        return self._journal


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def _unused_name(path: Path) -> Path:
    """Return an unused file name beside a session."""
    names = (path.with_name(f"{path.name}.saved-{number}") for number in count(1))
    return next(name for name in names if not name.exists())
