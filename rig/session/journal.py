"""Writes that wait in memory until the disk has them, so that a full disk costs no data."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from time import monotonic

from rig.session.faults import as_session_error
from rig.session.hashes import ChainEnd, extend_chain
from rig.session.schema import TABLES, Record

_BAD_ROW = (
    sqlite3.IntegrityError,
    sqlite3.DataError,
    sqlite3.InterfaceError,
    sqlite3.ProgrammingError,
    OverflowError,  # a number beyond 64 bits
    ValueError,
    TypeError,
)
"""Errors of the row itself: trying again cannot help. All others are the disk's."""


class Journal:
    """The open transaction, and a copy of it that survives a failed commit.

    SQLite rolls the whole transaction back when the disk is full. The rows are still here then,
    and the next `commit` writes them; only the end of the process loses them.

    Parameters
    ----------
    connection
        In manual transaction mode (``isolation_level=None``).
    path
        For messages.

    Attributes
    ----------
    pending
        Records not yet on the disk.
    begun_s
        When the disk began with the write under way, by the monotonic clock; `None` for none.
    """

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        self._connection = connection
        self._path = path
        self.pending: list[Record] = []
        self._applied = 0  # how many of the pending the open transaction holds
        self.begun_s: float | None = None
        self._chain_end: ChainEnd | None = None  # as committed, once that is known

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Time a write; when the disk fails all that is pending is applied anew by the next."""
        self.begun_s = monotonic()
        try:
            yield
        except sqlite3.Error as error:
            self._connection.rollback()
            raise as_session_error(self._path, error) from error
        finally:
            self.begun_s = None

    def add(self, record: Record) -> None:
        """Put rows into the open transaction, all or none of them.

        Raises
        ------
        SessionError
            If the rows are refused (they are forgotten) or the disk fails (they are kept).
        """
        # What waits is in the open transaction. Without one the disk has failed, then wait for
        # commit(): trying the whole backlog at every row would be quadratic, and the caller
        # already knows.
        failed = bool(self.pending) and not self._connection.in_transaction
        self.pending.append(record)
        if not failed:
            with self._writing():
                refusal = self._run()
            if refusal is not None:
                raise as_session_error(self._path, refusal) from refusal

    def commit(self) -> None:
        """Make everything added so far durable.

        Raises
        ------
        SessionError
            If the disk fails; nothing is forgotten and a later call tries again.
        """
        if self.pending:
            with self._writing():
                self._commit()

    def save(self, place: Path) -> int:
        """Write what is committed and what waits into a new file; nothing waits any more.

        Parameters
        ----------
        place
            Where nothing is yet.

        Returns
        -------
        int
            How many records it refuses.

        Raises
        ------
        sqlite3.Error, OSError
            It cannot be read, or not be written there.
        """
        self._connection.rollback()
        with closing(sqlite3.connect(place, isolation_level=None)) as target:
            self._connection.backup(target)
            target.execute("PRAGMA synchronous = FULL")
            rescue = Journal(target, place)
            rescue.pending = self.pending
            refused = len(self.pending)
            rescue._run()
            refused -= len(self.pending)
            rescue._commit()
        return refused

    def _commit(self) -> None:
        refusal = self._run()
        if self._connection.in_transaction:
            end = extend_chain(self._connection, self._chain_end)
            self._connection.execute("COMMIT")
            self._chain_end = end
        self.pending.clear()
        if refusal is not None:
            raise as_session_error(self._path, refusal) from refusal

    def _run(self) -> Exception | None:
        """Apply what is pending; records that are refused are left out, the last one returned."""
        refusal: Exception | None = None
        if not self._connection.in_transaction:
            self._applied = 0
            self._connection.execute("BEGIN IMMEDIATE")
        while self._applied < len(self.pending):
            try:
                self._apply(self.pending[self._applied])
            except _BAD_ROW as error:
                del self.pending[self._applied]
                refusal = error
            else:
                self._applied += 1
        return refusal

    def _apply(self, record: Record) -> None:
        # Even one executemany can fail half-way through its rows.
        self._connection.execute("SAVEPOINT record")
        try:
            for table, rows in record.items():
                self._connection.executemany(TABLES[table].insert, rows)
        except _BAD_ROW:
            self._connection.execute("ROLLBACK TO record")
            raise
        finally:
            # When the disk failed SQLite has already rolled everything back, savepoint included.
            if self._connection.in_transaction:
                self._connection.execute("RELEASE record")
