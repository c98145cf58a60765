"""What pytest is told by `bench.mutation`: which test runs through which line, or which to run."""

from __future__ import annotations

import json
import os
from collections import defaultdict
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from coverage import Coverage

_FIXTURE = "fixture "
RECORD, SELECT = "RIG_MUTATION_RECORD", "RIG_MUTATION_SELECT"
"""Names of what says where to write the record, and where the list of tests stands."""


class _Recorder:
    """Notes for each test how long it took and through which lines it ran, here or in a child.

    Tests that fail are left out. What a fixture of many tests runs through, all these run through.
    """

    def __init__(self, target: Path, sources: list[str]) -> None:
        from coverage import Coverage  # noqa: PLC0415 - only where lines are recorded

        self._target, self._seconds = target, dict[str, float]()
        self._context, self._users = "", defaultdict[str, set[str]](set)
        self._failed = set[str]()
        self._coverage: Coverage = Coverage(data_file=None, include=[f"{s}/*" for s in sources])
        self._coverage.set_option("run:disable_warnings", ["no-data-collected"])  # of the core in C
        self._coverage.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        for name in getattr(item, "fixturenames", ()):
            self._users[f"{_FIXTURE}{name}"].add(item.nodeid)
        with self._within(item.nodeid):
            return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[Any]) -> Iterator[None]:
        if fixturedef.scope == "function":
            return (yield)
        with self._within(f"{_FIXTURE}{fixturedef.argname}"):
            return (yield)

    @contextmanager
    def _within(self, context: str) -> Iterator[None]:
        before, self._context = self._context, context
        self._coverage.switch_context(context)
        try:
            yield
        finally:
            self._context = before
            self._coverage.switch_context(before)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        spent = self._seconds.get(report.nodeid, 0.0) + report.duration
        self._seconds[report.nodeid] = round(spent, 4)
        self._failed |= {report.nodeid} if report.failed else set()

    def pytest_sessionfinish(self) -> None:
        self._coverage.stop()
        from coverage import CoverageData  # noqa: PLC0415

        for nodeid in self._failed:  # without any fault
            del self._seconds[nodeid]
        data, here = self._coverage.get_data(), Path.cwd()
        for child in sorted(self._target.parent.glob(f"{self._target.name}.children.*")):
            of_child = CoverageData(str(child))
            of_child.read()
            data.update(of_child)
            child.unlink()
        places = {nodeid: place for place, nodeid in enumerate(self._seconds)}
        lines: dict[str, dict[int, list[int]]] = {
            str(Path(file).relative_to(here)): {
                line: sorted(
                    {
                        places[test]
                        for context in contexts
                        for test in self._users.get(context, {context})
                        if test in places
                    }
                )
                for line, contexts in data.contexts_by_lineno(file).items()
            }
            for file in sorted(data.measured_files())
        }
        record: dict[str, Any] = {"seconds": self._seconds, "lines": lines}
        self._target.write_text(json.dumps(record), "utf-8")


class _Selection:
    """Runs only the tests of a list, in its order."""

    def __init__(self, wanted: list[str]) -> None:
        self._places = {nodeid: place for place, nodeid in enumerate(wanted)}

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items[:] = sorted(
            (item for item in items if item.nodeid in self._places),
            key=lambda item: self._places[item.nodeid],
        )


def pytest_configure(config: pytest.Config) -> None:
    """Do what the environment asks for."""
    if target := os.environ.get(RECORD):
        name, *sources = target.split(os.pathsep)
        config.pluginmanager.register(_Recorder(Path(name), sources))
    if wanted := os.environ.get(SELECT):
        config.pluginmanager.register(_Selection(json.loads(Path(wanted).read_text("utf-8"))))
