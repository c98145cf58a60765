"""A bench for each test."""

import shutil
import tempfile
from pathlib import Path

import pytest

from bench.process_fixture import ProcessFixture
from tests.cli.conftest import finished  # noqa: F401 - a fixture
from tests.cli.lab import short_fence
from tests.tui.lab import Lab, unseen

_FENCE = short_fence(3).replace("Free fall of a picket fence", "TITLE")


@pytest.fixture(autouse=True)
def _unseen(monkeypatch):
    unseen(monkeypatch)


@pytest.fixture
def folder():
    """Make a folder with a name that a socket's address has room for."""
    made = Path(tempfile.mkdtemp(prefix="rig-"))
    yield made
    shutil.rmtree(made, ignore_errors=True)  # a daemon may be ending in it


@pytest.fixture
def lab(folder):
    """A quickly analysed scene before a daemon that runs."""
    protocol = folder / "fence.yaml"
    protocol.write_text(_FENCE.replace("TITLE", "A short fence"), "utf-8")
    bench = Lab(folder, protocol)
    bench.start()
    yield bench
    bench.stop()


@pytest.fixture
def cabled():
    """A board behind a cable, and a daemon that owns its port."""
    with ProcessFixture(runs=2, seed=3) as processes:
        bench = Lab(processes.folder, processes.protocol, str(processes.port))
        bench.start()
        yield processes, bench
        bench.stop()


@pytest.fixture
def fence():
    """The scene's text; TITLE stands for its title."""
    return _FENCE
