"""Speed of the falls, as ratios between things timed in turns on one machine.

A machine's speed drifts while it is measured. So everything is timed in every round, ratios are
taken within a round, and their median is given with the least and the most.
"""

from __future__ import annotations

import ctypes
import math
import os
import shlex
import shutil
import statistics
import subprocess
import time
from dataclasses import dataclass
from decimal import Decimal
from itertools import accumulate
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.frame import Findings
from rig.commands.output import say
from rig.errors import RigError
from rig.model.batch import FallBatch, Floats, falls, given_impacts
from rig.model.chain import Chain
from rig.model.fall import Fall, fall, kicks

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator, Mapping, Sequence

RODS, LENGTH = 25, 1.165  # the paper's chain, m
ALPHA, GAMMA, DROP, GRAVITY = 0.155, 4.0 / 3.0, 0.18, 9.81  # and its fall at 40°
C_SOURCE = Path(__file__).with_name("fall_loop.c")
C_OPTIONS = ("-O2", "-shared", "-fPIC")
AT_ROUNDING = 1e-14
"""Relative error at which a solver counts as good as the closed forms."""
_TOLERANCES = (1e-3, 1e-6, 1e-9, 1e-12)
# Turns long enough for the clock, and short enough to fit between two interruptions.
_SINGLE_FALLS, _ROOTS = 50, 500
_TRIES = 5


@dataclass(frozen=True, slots=True)
class Batch:
    """Falls of one chain, one number a fall in each array."""

    alpha: Floats
    gamma: Floats
    drop: Floats
    gravity: Floats
    initial_speed: Floats


def paper_chain() -> Chain:
    """Return the paper's uniform chain: 25 rods over 1.165 m."""
    return Chain((1.0,) * RODS, tuple(LENGTH * k / (RODS - 1) for k in range(RODS)))


def varied(count: int, seed: int = 1) -> Batch:
    """Falls like those of the lab, no two alike."""
    source = np.random.default_rng(seed)
    ranges = (0.01, 0.4), (1.2, 1.5), (0.1, 0.3), (9.7, 9.9), (0.0, 0.1)
    return Batch(*(source.uniform(low, high, count) for low, high in ranges))


def run(arguments: Namespace) -> Iterator[Findings]:
    """Find how long falls take, as ratios."""
    ratios = bulk(arguments.falls, arguments.rounds)
    yield Findings(ratios, _table(ratios))


def bulk(count: int, rounds: int) -> dict[str, Any]:
    """Time the falls against square roots, a C loop and a general solver.

    Parameters
    ----------
    count
        Falls in a batch.
    rounds
        Of measurement, each with all contestants.

    Raises
    ------
    RigError
        Where there is no C compiler although the environment's ``CI`` asks for all of it, or
        where the compiler fails.
    """
    chain, batch = paper_chain(), varied(count)
    roots = [float(k + 1) for k in range(chain.rods)]
    timed: dict[str, Callable[[], float]] = {
        "roots": lambda: _per_turn(lambda: _square_roots(roots), _ROOTS),
        "single": lambda: _per_turn(lambda: _single(chain), _SINGLE_FALLS),
        "batch": lambda: _per_turn(lambda: batch_falls(chain, batch), 1) / count,
    }
    found: dict[str, Any] = {"rods": chain.rods, "falls": count, "rounds": rounds}
    with TemporaryDirectory() as folder:
        compiler = find_compiler()
        if compiler:
            loop = CLoop(compiler, Path(folder))
            timed["c"] = lambda: _per_turn(lambda: loop.falls(chain, batch), 1) / count
            found["compiler"] = shlex.join((*compiler, *C_OPTIONS))
        elif os.environ.get("CI"):
            raise RigError("there is no C compiler here", "install one, or name it in CC")
        else:
            say("no C compiler here: left out the C loop (install one, or name it in CC)")
        solver = _solver(chain)
        if solver is not None:
            found["solver"] = solver
            timed["solver"] = lambda: _per_turn(lambda: solve(chain, solver["rtol"]), 1)
        measured = _in_turns(timed, rounds)
    ratios = {"single_over_roots": ("single", "roots"), "single_over_batch": ("single", "batch")}
    ratios |= {"batch_over_c": ("batch", "c"), "solver_over_single": ("solver", "single")}
    found["falls_per_s"] = _spread([1.0 / seconds for seconds in measured["batch"]])
    for name, (above, below) in ratios.items():
        if above in measured and below in measured:
            pairs = zip(measured[above], measured[below], strict=True)
            found[name] = _spread([a / b for a, b in pairs])
    return found


def batch_falls(chain: Chain, batch: Batch) -> FallBatch:
    """All falls at once, in numpy."""
    impacts = given_impacts(batch.alpha, batch.gamma)
    return falls(
        chain.masses, chain.heights, impacts, batch.drop, batch.gravity, batch.initial_speed
    )


def find_compiler() -> list[str] | None:
    """Return the C compiler's command: ``$CC`` or ``cc``; `None` where there is none."""
    command = shlex.split(os.environ.get("CC", "")) or ["cc"]
    found = shutil.which(command[0])
    return [found, *command[1:]] if found else None


class CLoop:
    """``fall_loop.c``, compiled into a folder.

    Raises
    ------
    RigError
        Where the compiler fails; its own words are the hint.
    """

    def __init__(self, compiler: Sequence[str], folder: Path) -> None:
        library = folder / "fall_loop.so"
        command = [*compiler, *C_OPTIONS, "-o", str(library), str(C_SOURCE), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RigError(f"the C compiler failed: {shlex.join(command)}", done.stderr.strip())
        self._falls = ctypes.CDLL(str(library)).falls
        numbers = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
        self._falls.argtypes = [ctypes.c_size_t, ctypes.c_size_t, *[numbers] * 11]
        self._falls.restype = None

    def falls(self, chain: Chain, batch: Batch) -> tuple[Floats, Floats, Floats]:
        """Δz, V and t of each fall."""
        above = [*list(accumulate(chain.masses[:0:-1]))[::-1], 0.0]
        profile = [np.array(one, dtype=np.float64) for one in (chain.masses, above, chain.heights)]
        inputs = batch.alpha, batch.gamma, batch.drop, batch.gravity, batch.initial_speed
        separation, speed, seconds = (np.empty(batch.alpha.size) for _ in range(3))
        self._falls(batch.alpha.size, chain.rods, *profile, *inputs, separation, speed, seconds)
        return separation, speed, seconds


def solve(chain: Chain, rtol: float) -> Fall:
    """The paper's fall by scipy's `solve_ivp`, stopped by an event at each impact."""
    from scipy.integrate import solve_ivp  # noqa: PLC0415 - only here, and not always installed

    def motion(_: float, state: Floats) -> list[float]:
        return [-state[1], GRAVITY, -state[3], GRAVITY]

    clock, arrival = 0.0, 0.0
    state = np.array([DROP, 0.0, DROP, 0.0])  # height and speed of this chain and of the free one
    for height, gain in zip(chain.heights, kicks(chain, [ALPHA] * chain.rods, GAMMA), strict=True):

        def strikes(_: float, state: Floats, height: float = height) -> float:
            return float(state[0]) + height

        strikes.terminal = True  # type: ignore[attr-defined]  # this is how scipy wants it
        leg = solve_ivp(motion, (clock, clock + 1.0), state, rtol=rtol, atol=rtol, events=strikes)
        clock, state = float(leg.t[-1]), leg.y[:, -1].copy()
        arrival = float(state[1])
        state[1] *= 1.0 + gain
    return Fall(float(state[2] - state[0]), arrival, clock)


def _solver(chain: Chain) -> dict[str, float] | None:
    """Find the loosest tolerance whose result is as good as rounding allows; none: left out."""
    try:
        from rig.bench.reference import exact_fall  # noqa: PLC0415 - needs mpmath

        exact = exact_fall(
            chain.masses,
            chain.heights,
            [Decimal(ALPHA)] * chain.rods,
            [Decimal(GAMMA)] * chain.rods,
            DROP,
            GRAVITY,
        )
        errors = {rtol: _error(solve(chain, rtol), exact) for rtol in _TOLERANCES}
    except ModuleNotFoundError as error:
        say(f"no {error.name} here: left out the solver")
        return None
    rtol = next(
        (t for t in _TOLERANCES if errors[t] <= AT_ROUNDING), min(errors, key=errors.__getitem__)
    )
    return {"rtol": rtol, "error": errors[rtol], "single_error": _error(_single(chain), exact)}


def _error(found: Fall, exact: Sequence[Decimal]) -> float:
    """Return the largest relative error of Δz, V and t."""
    values = found.separation_m, found.speed_m_s, found.time_s
    return max(
        abs(float(Decimal(value) / true - 1)) for value, true in zip(values, exact, strict=True)
    )


def _single(chain: Chain) -> Fall:
    return fall(chain, ALPHA, GAMMA, DROP, GRAVITY)


def _square_roots(numbers: Sequence[float]) -> None:
    root = math.sqrt
    for number in numbers:
        root(number)


def _per_turn(work: Callable[[], object], turns: int) -> float:
    """Seconds that one turn takes."""
    begin = time.perf_counter()
    for _ in range(turns):
        work()
    return (time.perf_counter() - begin) / turns


def _in_turns(timed: dict[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    """Time everything in turns, `_TRIES` times a round; a round's best counts.

    Other programs on the machine only ever make a time longer.
    """
    measured: dict[str, list[float]] = {name: [] for name in timed}
    for _ in range(rounds):
        tries = [[clock() for clock in timed.values()] for _ in range(_TRIES)]
        for name, *seconds in zip(timed, *tries, strict=True):
            measured[name].append(min(seconds))
    return measured


def _spread(values: Sequence[float]) -> dict[str, float]:
    return {"median": statistics.median(values), "least": min(values), "most": max(values)}


def _table(found: Mapping[str, Any]) -> list[str]:
    rods = found["rods"]
    lines = [
        f"{rods} rods, batches of {found['falls']} falls; median of {found['rounds']} rounds, "
        "least to most",
        _line(f"one fall over {rods} square roots", found["single_over_roots"], "×"),
        _line("falls of a batch, million/s", found["falls_per_s"], "", 1e-6),
        _line("one fall over one of a batch", found["single_over_batch"], "×"),
    ]
    if "batch_over_c" in found:
        line = _line("batch over a C loop", found["batch_over_c"], "×")
        lines.append(f"{line}   {found['compiler']}")
    if "solver_over_single" in found:
        solver = found["solver"]
        lines.append(
            f"{_line('solve_ivp over one fall', found['solver_over_single'], '×')}   "
            f"rtol {solver['rtol']:g}: error {solver['error']:.0e}, "
            f"of one fall {solver['single_error']:.0e}"
        )
    return lines


def _line(label: str, spread: Mapping[str, float], unit: str, scale: float = 1.0) -> str:
    median, least, most = (spread[key] * scale for key in ("median", "least", "most"))
    return f"{label:<32}{f'{median:.4g}{unit}':>9}   {least:.4g} to {most:.4g}"
