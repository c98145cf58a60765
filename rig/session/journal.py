"""Journal of writes, kept in memory until they are on disk, so that a full disk loses no data."""

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
"""Errors of the row itself, for which a retry cannot help. All others are errors of the disk."""


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
        Monotonic time at which the present write began, s; `None` without a write.
    """

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        self._connection = connection
        self._path = path
        self.pending: list[Record] = []
        self._applied = 0  # number of pending records in the open transaction
        self.begun_s: float | None = None
        self._chain_end: ChainEnd | None = None  # end of the committed chain, once known
        self._refusal: Exception | None = None  # of the last refused record of a write

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Time a write; if the disk fails, the next write applies all pending records anew.

        If a record is refused, all others are written, and then the error is raised.
        """
        self.begun_s, self._refusal = monotonic(), None
        try:
            yield
        except sqlite3.Error as error:
            self._connection.rollback()
            raise as_session_error(self._path, error) from error
        finally:
            self.begun_s = None
        if self._refusal is not None:
            raise as_session_error(self._path, self._refusal) from self._refusal

    def add(self, record: Record) -> None:
        """Put rows into the open transaction, all or none of them.

        Raises
        ------
        SessionError
            The rows are refused (they are dropped) or the disk fails (they are kept).
        """
        # Pending records are in the open transaction. Without a transaction the disk has failed;
        # then wait for commit(): a retry of the backlog for every row would take quadratic time,
        # and the caller knows already.
        failed = bool(self.pending) and not self._connection.in_transaction
        self.pending.append(record)
        if not failed:
            with self._writing():
                self._run()

    def commit(self) -> None:
        """Write all added records to the disk.

        Raises
        ------
        SessionError
            The disk fails; all records are kept, and a later call tries again.
        """
        if self.pending:
            with self._writing():
                self._commit()

    def save(self, place: Path) -> int:
        """Write committed and pending records into a new file, and clear the pending ones.

        To be called behind a commit: one that failed has left no transaction open.

        Parameters
        ----------
        place
            Path of the new file.

        Returns
        -------
        int
            Number of refused records.

        Raises
        ------
        sqlite3.Error, OSError
            The session cannot be read, or the new file not written.
        """
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
        self._run()
        if self._connection.in_transaction:
            end = extend_chain(self._connection, self._chain_end)
            self._connection.execute("COMMIT")
            self._chain_end = end
        self.pending.clear()

    def _run(self) -> None:
        """Apply pending records; drop refused ones, and keep the last error."""
        if not self._connection.in_transaction:
            self._applied = 0
            self._connection.execute("BEGIN IMMEDIATE")
        while self._applied < len(self.pending):
            try:
                self._apply(self.pending[self._applied])
            except _BAD_ROW as error:
                del self.pending[self._applied]
                self._refusal = error
            else:
                self._applied += 1

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
            # If the disk failed, SQLite has rolled everything back, including the savepoint.
            if self._connection.in_transaction:
                self._connection.execute("RELEASE record")
