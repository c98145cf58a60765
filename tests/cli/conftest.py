"""A small finished session, and ``rig`` called inside this process."""

import json
import shutil
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from rig.cli import main
from tests.cli.lab import PROTOCOLS, rig, short
from tests.once import analysed_once  # noqa: F401 - a fixture


class Done(NamedTuple):
    """How a call ended."""

    code: int
    out: str
    err: str


@dataclass(frozen=True)
class Finished:
    """A session of four runs at two inclines, as a process of its own made it."""

    session: Path
    protocol: Path
    table: Done

    def copy(self, folder: Path) -> Path:
        """Copy the session to a place where it may be changed."""
        return shutil.copy(self.session, folder / "copy.session")


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    folder = tmp_path_factory.mktemp("finished")
    protocol, session = folder / "short.yaml", folder / "short.session"
    protocol.write_text(short(), "utf-8")
    done = rig("run", protocol, "--port", "sim://", "--session", session, "--seed", 1)
    return Finished(session, protocol, Done(done.returncode, done.stdout, done.stderr))


@pytest.fixture(scope="session")
def fences(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record ten drops of a fence, which are quickly analysed."""
    protocol, session = PROTOCOLS / "picket-fence.yaml", tmp_path_factory.mktemp("fences") / "s"
    assert main(["run", str(protocol), "--port", "sim://?seed=2", "--session", str(session)]) == 0
    return session


@pytest.fixture(scope="session")
def analysis(finished: Finished) -> dict[str, Any]:
    """What ``rig analyze --json`` prints of the finished session."""
    return json.loads(rig("analyze", finished.session, "--json").stdout)


@pytest.fixture(scope="session")
def page(finished: Finished, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return what ``rig report`` writes of the finished session."""
    path = tmp_path_factory.mktemp("page") / "report.html"
    done = rig("report", finished.session, "-o", path)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    assert done.stderr == f"report: {path}\n"
    return path


@pytest.fixture
def protocol(tmp_path: Path) -> Path:
    """Write a protocol of two runs: at 40° and at 60°."""
    path = tmp_path / "short.yaml"
    path.write_text(short(repeats=1), "utf-8")
    return path


@pytest.fixture
def fence(tmp_path: Path) -> Path:
    """Write a protocol of two drops that are quickly analysed."""
    text = (PROTOCOLS / "picket-fence.yaml").read_text("utf-8")
    path = tmp_path / "fence.yaml"
    path.write_text(
        text.replace("{repeats: 10, settle: 5 s}", "{repeats: 2, settle: 1 s}"), "utf-8"
    )
    return path


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Call ``rig`` in this process."""

    def run(*arguments: object) -> Done:
        capsys.readouterr()
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as stop:  # argparse's way
            code = stop.code
        out, err = capsys.readouterr()
        return Done(code, out, err)

    return run


@pytest.fixture(autouse=True)
def _signals() -> Iterator[None]:
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
