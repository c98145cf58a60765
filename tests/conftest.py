"""What holds for every test."""

import asyncio
import gc
import inspect
import os
import signal
import sys
from collections.abc import Callable, Container, Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers

from tests.once import loops_compiled  # noqa: F401 - a fixture
from tests.programs import Done, end

# `./run test` says the same every time: the same examples, and none that an earlier run has left.
# To look for new ones is for `./run bench search`, which keeps what it finds under .hypothesis/.
# A busy machine is no fault of the code: no example is timed.
settings.register_profile("same", derandomize=True, database=None, deadline=None)
settings.register_profile("search", max_examples=2000, deadline=None)
settings.load_profile("same")
# A user's shell tells Python nothing: PYTHONUNBUFFERED, say, would hide what an exit loses. Modules
# of the thousand programs that tests start are compiled once, whatever this shell prefers.
for setting in [name for name in os.environ if name.startswith("PYTHON")]:
    del os.environ[setting]
sys.dont_write_bytecode = False

_BY_THE_CLOCK = tuple(
    Path(__file__).parent / name
    for name in (
        "daemon", "doctor", "flash", "selftest", "tui", "cli/test_ctrl_c.py", "cli/test_errors.py",
        "cli/test_resume.py", "cli/test_run.py", "cli/test_unfired.py",
    )
)  # fmt: skip
"""Tests of what goes by a clock of its own."""


def pytest_configure() -> None:
    # A shell has what runs in its background ignore Ctrl-C, and so would all that tests start.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # Hypothesis also tries numbers that stand in the project's modules, those loaded so far: what
    # they are depends on which tests ran before in this process.
    if settings().derandomize:
        providers._get_local_constants = providers.Constants


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[object]:
    # Tests and modules stay to the end: the collector need not go through them again and again.
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Give a test that is a coroutine a loop of its own."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    names = inspect.signature(pyfuncitem.obj).parameters
    asyncio.run(pyfuncitem.obj(**{name: pyfuncitem.funcargs[name] for name in names}))
    return True


@pytest.hookimpl(wrapper=True)
def pytest_report_teststatus(report: pytest.TestReport) -> Iterator[object]:
    """Name a test when it fails, with the place, and not only at the end of all."""
    category, letter, word = yield
    if report.failed:
        crash = getattr(report.longrepr, "reprcrash", None)
        letter = f"\n{word} {report.nodeid}" + (f": {crash}" if crash else "") + "\n"
    return category, letter, word


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Have every worker begin with what goes by the clock, and only then compute.

    A board that is not heard of for a quarter of a second disarms itself, as it should: beside
    tests that need all processors that is no rare event. Those that wait are good neighbours.
    """
    workers = getattr(config, "workerinput", {}).get("workercount", 1)
    waiting: list[pytest.Item] = []
    computing: list[pytest.Item] = []
    clocked = {
        path: any(map(path.is_relative_to, _BY_THE_CLOCK)) for path in {i.path for i in items}
    }
    for one in items:
        (waiting if clocked[one.path] else computing).append(one)

    def share(of: list[pytest.Item], number: int) -> list[pytest.Item]:
        return of[len(of) * number // workers : len(of) * (number + 1) // workers]

    items[:] = [
        one for number in range(workers) for of in (waiting, computing) for one in share(of, number)
    ]


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Call ``rig`` in this process, and see that it ends with a code, or one of several."""

    def run(*arguments: object, code: int | Container[int] = 0) -> Done:
        from rig.cli import main

        capsys.readouterr()
        try:
            ended = main([str(argument) for argument in arguments])
        except SystemExit as stop:  # argparse's way
            ended = stop.code
        return end(ended, *capsys.readouterr(), code)

    return run


@pytest.fixture(scope="session", autouse=True)
def _no_users_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Have no test see what a user has kept, but for the fonts that matplotlib has listed."""
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MPLCONFIGDIR", os.environ.get("MPLCONFIGDIR") or str(caches / "matplotlib"))
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("caches")))
        yield


@pytest.fixture(autouse=True)
def _own_cache(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have no test see what another has kept; `analysed_once` has those of a module share it."""
    if "analysed_once" not in request.fixturenames:
        folder = Path(os.environ["XDG_CACHE_HOME"]) / f"{hash(request.node.nodeid):x}"
        monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
