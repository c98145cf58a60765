"""Many falls of one chain: error against processor time a fall, in Python, numpy, numba and C.

A point's parameter is how many falls are computed at once. The other limits of speed that this
project sets itself are measured beside it, as ratios within one run.
"""

from __future__ import annotations

import ctypes
import math
import os
import shlex
import shutil
import subprocess
import venv
from dataclasses import replace
from functools import partial
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.bench import references
from rig.bench.work import Answer, Method, WorkProblem, measure
from rig.commands.bench_precision import Study
from rig.commands.output import say
from rig.errors import RigError
from rig.model import paper
from rig.model.batch import falls, given_impacts
from rig.model.fall import fall

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator, Sequence

    from rig.bench.findings import Findings

    Batch = Sequence[Any]  # a number a fall in an array for each of `INPUTS`
    Ends = Sequence[Any]  # Δz, V and t, an array each

CHAIN = paper.UNIFORM
INPUTS = {"alpha": 0.155, "gamma": 4.0 / 3.0, "drop": 0.18, "gravity": 9.81, "initial_speed": 0.0}
"""The paper's fall at 40°: the first of every batch."""
C_SOURCE = Path(__file__).with_name("fall_loop.c")
C_OPTIONS = ("-O3", "-march=native", "-fno-math-errno")
"""Without errno a square root is one instruction, and a loop of them can be vectorised."""
_C = "C, vectors"
_SIZES = (1, 10, 100, 1000, 10_000, 100_000)
_HEAD = """\
# Many falls at once

`./run bench bulk`: relative error and processor time of one fall, by how many are computed at once.

The batch's goal is out of reach, and lines below say why. numpy computes in passes over arrays: its
roots and divisions alone, which the C loop does in the same vector instructions, take longer than
that whole loop, and its additions and products come on top. Who needs more falls a second compiles
the loop. `rig --help` and Python alone are timed in an environment that has nothing else installed.

"""


def draw_falls(count: int, seed: int = 1) -> Batch:
    """Draw falls of `CHAIN` as a lab has them, no two alike; the first is that of `INPUTS`."""
    source = np.random.default_rng(seed)
    ranges = (0.01, 0.4), (1.2, 1.5), (0.1, 0.3), (9.7, 9.9), (0.0, 0.1)
    arrays = [source.uniform(low, high, count) for low, high in ranges]
    for array, first in zip(arrays, INPUTS.values(), strict=True):
        array[0] = first
    return arrays


def run(arguments: Namespace) -> Iterator[Findings]:
    """Measure falls and limits."""
    with TemporaryDirectory() as folder:
        contestants = methods(Path(folder))
        sizes = [size for size in _SIZES if size <= arguments.falls]
        problem = _problem(contestants, sizes)
        study = Study("bulk", _HEAD)
        points, left_out = measure(problem)
        times = "cpu_s", "lower_s", "upper_s"
        each = [  # of one fall, not of the batch
            point._replace(**{name: getattr(point, name) / point.value for name in times})
            for point in points
        ]
        study.add(problem, each, left_out)
        limits = measure_limits(contestants, sizes[-1], arguments.rounds)
    found = study.findings(study.table())
    lines = [*found.lines, "", *(f"{words}: {value:.3g}" for words, value in limits.items())]
    yield replace(found, record={**found.record, "limits": limits}, lines=lines)


def methods(folder: Path) -> dict[str, Callable[[Batch], Ends]]:
    """Return every way to compute a batch, ours first; what is not installed is left out.

    Raises
    ------
    RigError
        Where there is no C compiler although the environment's ``CI`` asks for all of it, or
        where the compiler fails.
    """
    found: dict[str, Callable[[Batch], Ends]] = {
        "numpy (rig)": by_numpy,
        "Python (rig)": one_by_one,
        "numpy, float32": by_float32,
    }
    compiler = find_compiler()
    if compiler:
        found[_C] = c_loop(compiler, folder)
    elif os.environ.get("CI"):
        raise RigError("there is no C compiler here", "install one, or name it in CC")
    else:
        say("no C compiler here: left out the C loop (install one, or name it in CC)")
    try:
        found["numba"] = numba_loop()
    except ModuleNotFoundError:
        say("no numba here: left out its loop")
    return found


def by_numpy(batch: Batch) -> Ends:
    """Compute all falls at once, as the program does."""
    alpha, gamma, *rest = batch
    return [*falls(CHAIN.masses, CHAIN.heights, given_impacts(alpha, gamma), *rest)]


def one_by_one(batch: Batch) -> Ends:
    """Compute fall after fall, as the program does with a single one."""
    ends = [fall(CHAIN, *inputs) for inputs in zip(*(a.tolist() for a in batch), strict=True)]
    return [
        [end.separation_m for end in ends], [end.speed_m_s for end in ends],
        [end.time_s for end in ends],
    ]  # fmt: skip


def by_float32(batch: Batch) -> Ends:
    """Compute all falls at once in half as many bits."""
    alpha, gamma, drop, gravity, start = (a.astype(np.float32) for a in batch)
    ends: Ends = _loop(np.array(CHAIN.legs, np.float32), alpha, gamma, drop, gravity, start)
    return ends


def numba_loop() -> Callable[[Batch], Ends]:
    """Compile `_loop` for numbers, fall by fall."""
    from numba import njit  # noqa: PLC0415 - an extra

    loop, legs = njit(error_model="numpy")(_loop), np.array(CHAIN.legs)

    @njit(error_model="numpy")
    def every(legs: Any, a: Any, b: Any, c: Any, d: Any, e: Any) -> Any:
        ends = np.empty((3, a.size))
        for n in range(a.size):
            ends[0, n], ends[1, n], ends[2, n] = loop(legs, a[n], b[n], c[n], d[n], e[n])
        return ends

    return lambda batch: every(legs, *batch)


def _loop(legs: Any, alpha: Any, gamma: Any, drop: Any, gravity: Any, start: Any) -> Any:
    """Compute one fall, or arrays of them in arrays' own precision."""
    arrival = np.sqrt(start * start + 2 * gravity * drop)
    time = 2 * drop / (start + arrival)
    gained, separation = 0 * arrival, 0 * arrival
    for k in range(len(legs)):
        gap, ratio = legs[k, 0], legs[k, 1]
        step = arrival * (alpha / (gamma + ratio))
        gained = gained + step
        after = arrival + step
        arrival = np.sqrt(after * after + 2 * gravity * gap)
        duration = 2 * gap / (after + arrival)
        time = time + duration
        separation = separation + gained * duration
    return separation, arrival, time


def find_compiler() -> list[str] | None:
    """Return the C compiler's command: ``$CC`` or ``cc``; `None` where there is none."""
    command = shlex.split(os.environ.get("CC", "")) or ["cc"]
    found = shutil.which(command[0])
    return [found, *command[1:]] if found else None


def c_loop(compiler: Sequence[str], folder: Path) -> Callable[[Batch], Ends]:
    """Compile ``fall_loop.c`` into a folder and return its function.

    Raises
    ------
    RigError
        Where the compiler fails; its own words are the hint.
    """
    library = folder / "fall.so"
    command = [*compiler, *C_OPTIONS, "-shared", "-fPIC", "-o", str(library), str(C_SOURCE), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RigError(f"the C compiler {compiler[0]} failed", done.stderr.strip())
    function = ctypes.CDLL(str(library)).falls
    numbers = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
    function.argtypes, function.restype = [ctypes.c_size_t] * 2 + [numbers] * 10, None
    legs = [np.array(column) for column in zip(*CHAIN.legs, strict=True)]

    def loop(batch: Batch) -> Ends:
        count = batch[0].size
        ends = [np.empty(count) for _ in range(3)]
        function(count, CHAIN.rods, *legs, *batch, *ends)
        return ends

    return loop


def _problem(contestants: dict[str, Callable[[Batch], Ends]], sizes: Sequence[int]) -> WorkProblem:
    alpha, gamma, *where = INPUTS.values()
    coefficients = [alpha] * CHAIN.rods, [gamma] * CHAIN.rods

    def first(compute: Callable[[Batch], Ends], size: float) -> Answer:
        ends = compute(batches[int(size)])
        names = ("separation", "speed", "time")
        values = {name: float(end[0]) for name, end in zip(names, ends, strict=True)}
        return Answer(values, CHAIN.rods * int(size))

    batches = {size: draw_falls(size) for size in sizes}
    title = f"{CHAIN.rods} rods, falls at once"
    return WorkProblem(
        "falls", title, {"drop": where[0], "gravity": where[1]},
        partial(references.exact_fall, CHAIN.masses, CHAIN.heights, *coefficients),
        "legs as printed, with digits to spare",
        tuple(
            # One by one, no number of falls makes a fall cheaper.
            Method(name, sizes[: 4 if name.startswith("Python") else None], "{:.0f} falls",
                   partial(first, compute))
            for name, compute in contestants.items()
        ),
    )  # fmt: skip


def measure_limits(
    contestants: dict[str, Callable[[Batch], Ends]], count: int, rounds: int
) -> dict[str, float]:
    """Measure the limits that the project sets itself, as medians of ratios within a round."""
    batch, roots = draw_falls(count), [float(k + 1) for k in range(CHAIN.rods)]
    single, rows = [*INPUTS.values()], np.ones((2, 8192))
    works: dict[str, tuple[Callable[[], object], int]] = {
        "roots": (lambda: _square_roots(roots), 500),
        "fall": (lambda: fall(CHAIN, *single), 100),
        "numpy": (lambda: by_numpy(batch), 1),
        "root": (lambda: np.sqrt(rows[0], out=rows[1]), 200),
        "division": (lambda: np.divide(rows[0], rows[1], out=rows[1]), 200),
        "addition": (lambda: np.add(rows[0], rows[1], out=rows[1]), 200),
    }
    if _C in contestants:
        works[_C] = (lambda: contestants[_C](batch), 1)
    times = [
        {name: _least(work, turns) for name, (work, turns) in works.items()} for _ in range(rounds)
    ]
    passes = (CHAIN.rods - 1) * count / rows[0].size

    def ratio(below: str, **counts: float) -> float:
        return median(
            sum(n * turn[name] for name, n in counts.items()) / turn[below] for turn in times
        )

    found = {f"one fall over {CHAIN.rods} square roots (goal 10)": ratio("roots", fall=1)}
    if _C in contestants:
        found |= {
            "numpy batch over the C loop with vectors (goal 1)": ratio(_C, numpy=1),
            "  its roots and divisions alone": ratio(_C, root=passes, division=2 * passes),
            "  its additions and products alone": ratio(_C, addition=11 * passes),
        }
    with TemporaryDirectory() as folder:
        bare = bare_python(Path(folder))
        starts = [(bare("-c", ""), bare("-m", "rig", "--help")) for _ in range(rounds)]
    name = "rig --help over Python, without other packages (goal 2.3)"
    return found | {name: median(ours / python for python, ours in starts)}


def _square_roots(numbers: Sequence[float]) -> None:
    root = math.sqrt
    for number in numbers:
        root(number)


def _least(work: Callable[[], object], turns: int) -> float:
    """Least processor time of a turn in five tries: other programs only ever make it longer."""
    tries = []
    for _ in range(5):
        begin = process_time()
        for _ in range(turns):
            work()
        tries.append((process_time() - begin) / turns)
    return min(tries)


def bare_python(folder: Path) -> Callable[..., float]:
    """Make an environment without packages; return what times a command of its Python, s.

    What is installed beside this program starts with every Python there, and so would flatter it.
    """
    venv.create(folder, with_pip=False)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}

    def time(*arguments: str) -> float:
        before = getrusage(RUSAGE_CHILDREN)
        command = [str(folder / "bin/python"), *arguments]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=True, env=environment)
        after = getrusage(RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return time
