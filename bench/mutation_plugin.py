"""What pytest is told by `bench.mutation`: which test runs through which line, or which to run."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from coverage import Coverage

RECORD, SELECT = "RIG_MUTATION_RECORD", "RIG_MUTATION_SELECT"
"""Names of what says where to write the record, and where the list of tests stands."""


class _Recorder:
    """Notes for each test how long it took and through which lines it ran, here or in a child."""

    def __init__(self, target: Path, sources: list[str]) -> None:
        from coverage import Coverage  # noqa: PLC0415 - only where lines are recorded

        self._target, self._seconds = target, dict[str, float]()
        self._coverage: Coverage = Coverage(data_file=None, include=[f"{s}/*" for s in sources])
        self._coverage.set_option("run:disable_warnings", ["no-data-collected"])  # of the core in C
        self._coverage.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self._coverage.switch_context(item.nodeid)
        try:
            return (yield)
        finally:
            self._coverage.switch_context("")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        spent = self._seconds.get(report.nodeid, 0.0) + report.duration
        self._seconds[report.nodeid] = round(spent, 4)

    def pytest_sessionfinish(self) -> None:
        self._coverage.stop()
        from coverage import CoverageData  # noqa: PLC0415

        data, here = self._coverage.get_data(), Path.cwd()
        for child in sorted(self._target.parent.glob(f"{self._target.name}.children.*")):
            of_child = CoverageData(str(child))
            of_child.read()
            data.update(of_child)
            child.unlink()
        lines: dict[str, dict[int, list[str]]] = {
            str(Path(file).relative_to(here)): {
                line: sorted(self._seconds.keys() & contexts)
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
