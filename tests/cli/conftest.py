"""Small finished sessions and protocols."""

import json
import os
import shutil
import signal
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from tests.cli.lab import record, rig, short, short_fence
from tests.once import (
    analysed_once,  # noqa: F401 - a fixture
    filled_once,
)
from tests.programs import Done
from tests.report.undrawn import undrawn  # noqa: F401 - a fixture


@dataclass(frozen=True)
class Finished:
    """A session of four runs at two inclines, as a process of its own made it."""

    session: Path
    protocol: Path
    table: Done

    def copy(self, folder):
        """Copy the session to a place where it may be changed."""
        return shutil.copy(self.session, folder / "copy.session")


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    def fill(folder):
        protocol, session = folder / "short.yaml", folder / "short.session"
        protocol.write_text(short(), "utf-8")
        kept = os.environ | {"XDG_CACHE_HOME": str(folder / "caches")}
        words = ("run", protocol, "--port", "sim://", "--session", session, "--seed", 1)
        told = rig(*words, env=kept)
        (folder / "told.json").write_text(json.dumps(told), "utf-8")

    folder = filled_once(tmp_path_factory, "finished", fill)
    told = json.loads((folder / "told.json").read_text("utf-8"))
    return Finished(folder / "short.session", folder / "short.yaml", Done(*told))


@pytest.fixture(scope="session")
def fences(tmp_path_factory):
    """Record five drops of a fence, which are quickly analysed; its protocol lies beside it."""

    def fill(folder):
        record(folder, short_fence(5, "5 s"), "sim://?seed=2", "fences")

    return filled_once(tmp_path_factory, "fences", fill) / "fences.session"


@pytest.fixture(scope="session")
def analysis(finished, tmp_path_factory):
    """What ``rig analyze --json`` prints of the finished session."""

    def fill(folder):
        (folder / "said.json").write_text(rig("analyze", finished.session, "--json").out, "utf-8")

    folder = filled_once(tmp_path_factory, "analysis", fill)
    return json.loads((folder / "said.json").read_text("utf-8"))


@pytest.fixture
def protocol(tmp_path):
    """Write a protocol of two runs: at 40° and at 60°."""
    path = tmp_path / "short.yaml"
    path.write_text(short(repeats=1), "utf-8")
    return path


@pytest.fixture
def fence(tmp_path):
    """Write a protocol of two drops that are quickly analysed."""
    path = tmp_path / "fence.yaml"
    path.write_text(short_fence(), "utf-8")
    return path


@pytest.fixture
def run(call, tmp_path, fence):
    """Record two drops of a fence: what falls is all the same to a recording."""
    words = ("run", fence, "--port", "sim://?seed=1", "--session", tmp_path / "s", "--yes")
    return partial(call, *words)


@pytest.fixture
def unread():
    """Open a stream at whose other end nobody listens."""
    ours, theirs = os.pipe()
    os.close(ours)
    yield theirs
    os.close(theirs)


@pytest.fixture(autouse=True)
def _signals():
    """Have Ctrl-C not ignored, as it is behind a shell's ``&``, and see handlers put back."""
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    if before[0] is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    now = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    yield
    left = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    signal.signal(signal.SIGINT, before[0])
    signal.signal(signal.SIGTERM, before[1])
    assert left == now
