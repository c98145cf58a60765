"""No command that only reads alters a session: not a byte, not its time, no file beside it."""

import hashlib
import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest

from bench.mutants import make_session
from rig import door
from rig.results.live import LiveAnalysis
from tests.session.altering import outdate
from tests.tables import read_table

WRITER = """
import os, sys
from rig.session.schema import RunState
from rig.session.store import Session
session = Session.open(sys.argv[1])
session.add_state(1, 1, RunState.RECORDED, 1)
session.commit()
if sys.argv[2] == "die":
    os._exit(9)
print("ready", flush=True)
sys.stdin.read()
"""
pytestmark = pytest.mark.usefixtures("undrawn")
COMMANDS = [words.split() for words in read_table(__file__, "commands")["read"]]


def log_beside(session):
    return session.with_name(session.name + "-wal")


def with_kept_results(session):
    """As programs before this one left them."""
    with closing(sqlite3.connect(session)) as connection, connection:
        connection.execute("INSERT INTO result VALUES (1, 1, '0.1.0', '{\"run\": 1}')")


def interrupted(session):
    """Its writer was killed: what came last is in the log beside it only."""
    subprocess.run([sys.executable, "-c", WRITER, session, "die"], check=False)
    assert log_beside(session).stat().st_size


def state(folder):
    return {
        path.name: (hashlib.sha256(path.read_bytes()).hexdigest(), path.stat().st_mtime_ns)
        for path in folder.iterdir()
        if not path.name.endswith("-shm")  # where SQLite notes who reads
    } | {"names": sorted(path.name for path in folder.iterdir())}


def read_all(call, session, out, commands=COMMANDS):
    out.mkdir(exist_ok=True)
    for number, words in enumerate(commands):
        (out / str(number)).mkdir()
        given = [
            word.replace("SESSION", str(session)).replace("OUT", str(out / str(number)))
            for word in words
        ]
        # A doctor's word is of this computer too, and a fence has no impacts to estimate.
        call(*given, code={"doctor": {0, 4}, "estimate": {0, 2}}.get(words[0], 0))
        yield words
    with door.open(session) as opened:
        opened.analyze()
        opened.edges(1)
    yield ("rig.open",)
    LiveAnalysis(session).read()
    yield ("the terminal",)


READERS = [COMMANDS[0], *COMMANDS[6:9]]
"""Commands that open a session in ways of their own; the others do it as the first of these."""


STATES = {
    "fresh": (lambda _: None, READERS),
    "of the first format": (lambda session: outdate(session, 1), READERS),
    "with kept results": (with_kept_results, READERS),
    "interrupted": (interrupted, COMMANDS),
    "with an emptied log": (lambda session: log_beside(session).touch(), READERS),
    "read-only": (lambda session: session.chmod(0o400), READERS),
    "in a read-only folder": (lambda session: session.parent.chmod(0o500), COMMANDS),
}


@pytest.mark.parametrize(("prepare", "commands"), STATES.values(), ids=STATES)
def test_reading_alters_nothing(prepare, commands, call, tmp_path):
    folder = tmp_path / "sessions"
    folder.mkdir()
    session = make_session(folder)
    prepare(session)
    before = state(folder)
    try:
        for words in read_all(call, session, tmp_path / "out", commands):
            assert state(folder) == before, words
    finally:
        folder.chmod(0o700)


def test_reading_beside_a_writer_alters_nothing(call, tmp_path):
    folder = tmp_path / "sessions"
    folder.mkdir()
    session = make_session(folder)
    command = [sys.executable, "-c", WRITER, session, "wait"]
    with subprocess.Popen(command, stdin=-1, stdout=-1, text=True) as writer:
        assert writer.stdout.readline() == "ready\n"
        before = state(folder)
        for words in read_all(call, session, tmp_path / "out"):
            assert state(folder) == before, words
        writer.stdin.close()
    assert not log_beside(session).exists()


def test_what_an_interrupted_writer_committed_is_read(tmp_path):
    session = make_session(tmp_path)
    with door.open(session) as opened:
        before = len(opened._file.states())
    interrupted(session)
    with door.open(session) as opened:
        assert len(opened._file.states()) == before + 1
