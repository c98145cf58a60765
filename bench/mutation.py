"""Faults put into the software, one at a time, and whether any test notices.

A fault is tried on a copy of the project, by the tests that run through its line, until one fails:
those of its own room before others, and the quickest first. Which run through it is known from one
run of all rooms' tests.
"""

from __future__ import annotations

import ast
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import accumulate, chain
from pathlib import Path
from queue import SimpleQueue
from statistics import fmean
from tempfile import TemporaryDirectory
from time import monotonic
from typing import TYPE_CHECKING, NamedTuple

from bench.mutation_plugin import RECORD, SELECT
from bench.mutators import c_faults, python_faults
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.errors import InputError
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable, Iterator

    from bench.mutators import Fault

ROOT = Path(__file__).parent.parent
KEPT = ROOT / "out" / "mutation"
"""Where the records of which test runs through which line stay."""
_MEMORY_BYTES = 6 << 30
_PATIENCE = 10.0
"""How many times as long as before tests may take until a fault counts as one that hangs."""
_MOST_S = 60.0
"""What the tests of a fault from other rooms may take together, without it."""
_START_S = 120.0  # until pytest has loaded everything, on a busy machine
ROOMS = {
    "analysis": ("rig/analysis", "rig/results"),
    "link": ("rig/link",),
    "session": ("rig/session",),
    "model": ("rig/model",),
    "daemon": ("rig/daemon", "rig/recorder"),
    "timers": ("rig/timers",),
    "core": ("firmware/core",),
}
"""Where faults are put."""
CORE_TESTS = "tests/firmware/test_avr.py"
LEAST_KILLED = 0.9
_HEAD = """\
# Faults put into the source

`./run bench mutation`: {count} faults drawn by seed {seed}, one at a time, each tried by the tests
that run through its line: all of its room's, and a minute of the others, the quickest first."""


class Mutant(NamedTuple):
    """One fault at its place."""

    room: str
    path: str
    fault: Fault

    def __str__(self) -> str:
        """Say where it is and what."""
        return f"{self.path}:{self.fault.line} {self.fault}"


class Outcome(NamedTuple):
    """What became of it: `by` is the test that noticed, empty when none did."""

    mutant: Mutant
    by: str
    tests: int
    seconds: float

    def row(self) -> dict[str, object]:
        """Return a line of the table."""
        room, path, fault = self.mutant
        return {
            "room": room, "file": path, "line": fault.line, "old": fault.old, "new": fault.new,
            "noticed_by": self.by, "tests": self.tests,
        }  # fmt: skip


@dataclass(frozen=True, slots=True)
class Reached:
    """Which tests run through what, from one run of all rooms' tests.

    Attributes
    ----------
    seconds
        Of each test.
    lines
        For each file, tests by line, by their places; what runs only when a file is loaded has
        none.
    """

    seconds: dict[str, float]
    lines: dict[str, dict[str, list[int]]]

    def tests(self, path: str, line: int) -> list[str]:
        """List the tests that may notice a fault, as ranked above, until they take too long.

        Where none is known to run through the line (it runs when the file is loaded, or in a
        process that was killed), all that run through the file are, and all of its room, else all
        there are. Of the core in C no lines are recorded, and its memory outlives a test: all its
        tests, in order.
        """
        if not path.endswith(".py"):
            return [one for one in self.seconds if one.startswith(CORE_TESTS)]
        by_line, names = self.lines.get(path, {}), [*self.seconds]
        room = next(room for room, folders in ROOMS.items() if path.startswith(folders))
        own = f"tests/{room}/", f"tests/{path.split('/')[1]}/"
        whole = {n for n, name in enumerate(names) if name.startswith(own)}.union(*by_line.values())
        span = map(str, _within_a_function(path, line))
        found = set().union(*(by_line.get(at, ()) for at in span)) or whole or range(len(names))
        ranked = sorted((names[n] for n in sorted(found)), key=self.seconds.__getitem__)
        ranked.sort(key=lambda one: not one.startswith(own))
        spent = accumulate(self.seconds[one] * (not one.startswith(own)) for one in ranked)
        return [one for one, seconds in zip(ranked, spent, strict=True) if seconds <= _MOST_S]


def _within_a_function(path: str, line: int) -> range:
    """Lines of the innermost statement of a function that a line is of; none outside of all."""
    nodes = [*ast.walk(ast.parse((ROOT / path).read_text("utf-8")))]
    functions = [one for one in nodes if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef)]
    spans = [
        range(node.lineno, (node.end_lineno or node.lineno) + 1)
        for node in chain.from_iterable(map(ast.walk, functions))
        if isinstance(node, ast.stmt)
    ]
    return min((span for span in spans if line in span), key=len, default=range(0))


def run(arguments: Namespace) -> Iterator[Findings]:
    """Put faults in and see what is noticed; it has failed when less than nine of ten were."""
    rooms = arguments.rooms or list(ROOMS)
    mutants = list(_sampled(rooms, arguments.mutants, arguments.seed))
    copies: SimpleQueue[Path] = SimpleQueue()
    with TemporaryDirectory(prefix="rig-mutation-") as folder:
        for number in range(arguments.jobs):
            copies.put(_copied(Path(folder) / str(number)))
        outcomes = list(_tried(mutants, _reached(copies), copies, arguments.jobs))
    table = [["room", "faults", "noticed", "share"]]
    for room in [*ROOMS, "all"]:
        by = [outcome.by != "" for outcome in outcomes if room in {"all", outcome.mutant.room}]
        table += [[room, str(len(by)), str(sum(by)), f"{fmean(by):.0%}"]] if by else []
    survived = [outcome.mutant for outcome in outcomes if not outcome.by]
    lines = [*text_table(table, left={0}, rule=True), "", "not noticed:", *map(str, survived)]
    yield Findings(
        {"outcomes": [[*map(str, outcome)] for outcome in outcomes]},
        lines,
        _HEAD.format(count=len(outcomes), seed=arguments.seed),
        [outcome.row() for outcome in outcomes],
        failed=len(survived) > (1.0 - LEAST_KILLED) * len(outcomes),
    )


def _sampled(rooms: list[str], count: int, seed: int) -> Iterator[Mutant]:
    """Draw as many faults of each room; fewer are the first of more."""
    for room in rooms:
        found = [
            Mutant(room, str(path.relative_to(ROOT)), fault)
            for folder in ROOMS[room]
            for path in sorted((ROOT / folder).glob("*.c" if room == "core" else "*.py"))
            for fault in (c_faults if room == "core" else python_faults)(path.read_text("utf-8"))
        ]
        random.Random(f"{room} {seed}").shuffle(found)
        yield from found[: -(-count // len(rooms))]


# ---------------------------------------------------------------- copies of the project


def _copied(place: Path) -> Path:
    """Copy what tests need; what was built too, with its times."""
    skipped = shutil.ignore_patterns(".*", "out", "__pycache__", "*.egg-info")
    shutil.copytree(ROOT, place, ignore=skipped, symlinks=True)
    return place


def _reached(copies: SimpleQueue[Path]) -> Reached:
    """Read which tests run through which lines, or run them to find out."""
    kept = KEPT / f"{_last_change()}.json"
    if not kept.exists():
        KEPT.mkdir(parents=True, exist_ok=True)
        copy = copies.get()
        say("which tests run through which lines")
        sources = [str(copy / one) for folders in ROOMS.values() for one in folders]
        asked = {RECORD: os.pathsep.join([str(kept.with_suffix(".new")), *sources])}
        tests = sorted(str(one.relative_to(ROOT)) for one in (ROOT / "tests").glob("*/"))
        code, told = _pytest(copy, asked, tests, None)
        copies.put(copy)
        if code not in {0, 1}:
            raise InputError(f"the tests cannot be run\n{told[-2000:]}")
        for one in dict.fromkeys(_failed(told)):  # in a copy of the project
            say(f"left out, for it fails without any fault: {one}")
        kept.with_suffix(".new").replace(kept)
    return Reached(**json.loads(kept.read_text("utf-8")))


def _last_change() -> int:
    folders = (ROOT / name for name in ("rig", "sim", "firmware", "tests"))
    paths = (path for folder in folders for path in folder.rglob("*.[pchy]*"))
    return max(path.stat().st_mtime_ns for path in paths if path.suffix != ".pyc")


def _pytest(
    copy: Path, asked: dict[str, str], tests: Iterable[str], patience_s: float | None
) -> tuple[int | None, str]:
    """Run tests on a copy; give the exit code, `None` when it hangs, and what was said."""
    process = subprocess.Popen(
        [sys.executable, "-m", "pytest", *["-x"] * (SELECT in asked),
         "-q", "--no-header", "--tb=no", "-rf",
         "-p", "bench.mutation_plugin", "-p", "no:cacheprovider", "-p", "no:xdist",
         "-m", "not slow", *tests],
        cwd=copy,
        env=os.environ
        | asked
        | {"PYTHONPATH": os.pathsep.join([str(copy), str(copy / "bench" / "children")])},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
        start_new_session=True,
    )  # fmt: skip
    resource.prlimit(process.pid, resource.RLIMIT_AS, (_MEMORY_BYTES, _MEMORY_BYTES))
    try:
        told, _ = process.communicate(timeout=patience_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return None, ""
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)
        raise
    return process.returncode, told


# ---------------------------------------------------------------- one fault after another


def _tried(
    mutants: list[Mutant], reached: Reached, copies: SimpleQueue[Path], jobs: int
) -> Iterator[Outcome]:
    def each(mutant: Mutant) -> Outcome:
        copy = copies.get()
        try:
            return _try(mutant, reached, copy)
        finally:
            copies.put(copy)

    with ThreadPoolExecutor(jobs) as pool:
        for number, one in enumerate(pool.map(each, mutants), 1):
            by = one.by or "NOT NOTICED"
            say(f"{number}/{len(mutants)} {one.seconds:.0f} s {one.mutant}: {by}")
            yield one


def _try(mutant: Mutant, reached: Reached, copy: Path) -> Outcome:
    tests = reached.tests(mutant.path, mutant.fault.line)
    begun = monotonic()
    place = copy / mutant.path
    sound = place.read_text("utf-8")
    _put(place, mutant.fault.put_into(sound))
    selected = copy / "selected.json"
    selected.write_text(json.dumps(tests), "utf-8")
    patience_s = _START_S + _PATIENCE * sum(reached.seconds[one] for one in tests)
    try:
        files = sorted({one.partition("::")[0] for one in tests})
        code, told = _pytest(copy, {SELECT: str(selected)}, files, patience_s)
    finally:
        _put(place, sound)
    return Outcome(mutant, _noticed_by(code, told), len(tests), monotonic() - begun)


def _put(place: Path, source: str) -> None:
    """Write a source and forget what was compiled of it, which looks as new for a second."""
    place.write_text(source, "utf-8")
    for compiled in (place.parent / "__pycache__").glob(f"{place.stem}.*.pyc"):
        compiled.unlink()


def _noticed_by(code: int | None, told: str) -> str:
    if code is None:
        return "it hangs"
    if code == 0:
        return ""
    return next(iter(_failed(told)), "it ends the tests")


def _failed(told: str) -> list[str]:
    lines = (line.split(" ") for line in told.splitlines())
    return [words[1].rstrip(":") for words in lines if words[0] in {"FAILED", "ERROR"}]
