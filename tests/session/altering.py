"""Sessions that come to harm: altered behind their back, outdated, their writer killed."""

import os
import sqlite3
import subprocess
import sys
from contextlib import closing, contextmanager
from pathlib import Path

import rig
from rig.session.schema import TABLES
from tests.tables import read_table

LATER = read_table(__file__, "later")


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


def alter(session, *statements):
    """Alter raw records; nothing of what was there is left in a free page."""
    with unguarded(session) as connection:
        for statement in statements:
            connection.execute(statement)
    with closing(sqlite3.connect(session)) as connection:
        connection.execute("VACUUM")


def outdate(session, version):
    """Make a session one of an older format, as its program wrote it."""
    with closing(sqlite3.connect(session)) as connection:
        for name in (name for since, names in LATER.items() if since > version for name in names):
            table = name in TABLES
            sql = f"DROP TABLE {name}" if table else f'ALTER TABLE "drop" DROP COLUMN {name}'
            connection.execute(sql)
        connection.execute(f"PRAGMA user_version = {version}")
        connection.execute("VACUUM")


_OPEN = """
import sys
from rig.session.store import Session
session = Session.create(sys.argv[1], "p", "p", simulated=True, origin="sim://")
"""


@contextmanager
def killed(code, path):
    """Run a program that writes a session; kill it behind the block."""
    environment = {**os.environ, "PYTHONPATH": str(Path(rig.__file__).parents[1])}
    command = [sys.executable, "-c", _OPEN + code, path]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, env=environment, **pipes) as child:
        yield child
        child.kill()
