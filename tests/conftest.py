"""What holds for every test."""

import asyncio
import gc
import inspect
import os
import shutil
import signal
import sys
from collections.abc import Callable, Container, Iterator
from contextlib import AbstractAsyncContextManager, AsyncExitStack
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers

from bench.mutation_plugin import RECORD, SELECT
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
# Only the bench of faults has its own children in this way (bench/children).
KEPT = {"PYTHONPATH"} if {RECORD, SELECT} & os.environ.keys() else set()
for setting in {name for name in os.environ if name.startswith("PYTHON")} - KEPT:
    del os.environ[setting]
sys.dont_write_bytecode = False

_ORDER = (
    "cli/test_resume.py", "tui/", "daemon/", "flash/", "selftest/", "doctor/", "cli/test_run.py",
    "cli/test_unfired.py", "cli/test_errors.py", "cli/test_ctrl_c.py",
    "",
    "firmware/test_pico", "timers/test_import_shapes.py", "scenes/", "test_readme.py",
)  # fmt: skip
"""From what goes by a clock of its own, and mostly waits, to what computes longest."""


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
    """Give a test that is a coroutine a loop of its own, and fixtures that are entered in it."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None

    async def work() -> None:
        given = {name: pyfuncitem.funcargs[name] for name in names}
        async with AsyncExitStack() as stack:
            for name, value in given.items():
                if isinstance(value, AbstractAsyncContextManager):
                    given[name] = await stack.enter_async_context(value)
            await pyfuncitem.obj(**given)

    names = inspect.signature(pyfuncitem.obj).parameters
    asyncio.run(work())
    return True


@pytest.hookimpl(wrapper=True)
def pytest_report_teststatus(report: pytest.TestReport) -> Iterator[object]:
    """Name a test when it fails, with the place, and not only at the end of all."""
    category, letter, word = yield
    if report.failed:
        crash = getattr(report.longrepr, "reprcrash", None)
        letter = f"\n{word} {report.nodeid}" + (f": {crash}" if crash else "") + "\n"
    return category, letter, word


def _computes(worker: str) -> bool:
    """Say whether a worker (``gw0``, ``gw1`` ...) begins with tests that compute."""
    return int(worker.removeprefix("gw")) < (os.cpu_count() or 1)


def pytest_sessionstart(session: pytest.Session) -> None:
    """Have a worker that computes step back for those that wait.

    A board that is not heard of for a quarter of a second disarms itself, as it should: beside
    tests that need all processors that is no rare event.
    """
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker and _computes(worker):
        os.nice(5)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Hand out whole files: what computes longest to those that compute, what waits to others."""
    from xdist.scheduler import LoadFileScheduling

    def rank(file: str) -> int:
        name = file.removeprefix("tests/")
        return _ORDER.index(max(filter(name.startswith, _ORDER), key=len))

    class Scheduler(LoadFileScheduling):
        def _assign_work_unit(self, node) -> None:
            choose = max if _computes(node.gateway.id) else min
            self.workqueue.move_to_end(choose(self.workqueue, key=rank), last=False)
            super()._assign_work_unit(node)

    return Scheduler(config, log)


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
    """Have no test see what another has kept; `analysed_once` has those of a module share it.

    What was kept of `finished` as it was recorded is there for all who look at it.
    """
    if "analysed_once" not in request.fixturenames:
        folder = Path(os.environ["XDG_CACHE_HOME"]) / f"{hash(request.node.nodeid):x}"
        monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    if "finished" in request.fixturenames:
        kept = request.getfixturevalue("finished").session.with_name("caches")
        shutil.copytree(kept, os.environ["XDG_CACHE_HOME"], dirs_exist_ok=True)
