"""Altering a session behind its back, as somebody would who takes its guards away for a moment."""

import sqlite3
from contextlib import closing, contextmanager


@contextmanager
def unguarded(session):
    """Give a connection on which raw records can be altered; the guards come back behind it."""
    with closing(sqlite3.connect(session)) as connection, connection:
        sql = "SELECT name, sql FROM sqlite_master WHERE type = 'trigger'"
        guards = connection.execute(sql).fetchall()
        for name, _ in guards:
            connection.execute(f"DROP TRIGGER {name}")
        yield connection
        for _, again in guards:
            connection.execute(again)
