"""Error against run time of the resolved world; run as a module, it prints JSON lines.

Chains of three rods, which do not touch each other: longer falls are chaotic, and no step makes a
single one exact. A tilt that differs by 1 nrad moves Δz of three rods by up to 0.1 nm, of five by
0.3 µm, of eight by 0.6 mm. Each line is one setting: its step, what it changes, the largest and the
rms error of Δz at the strike, and processor time for a fall; the last two are 25 rods, whose error
means nothing, with compiled loops and without.
"""

from __future__ import annotations

import json
import os
import sys
import time
from dataclasses import replace
from subprocess import PIPE, run
from typing import TYPE_CHECKING

import numpy as np

from bench.studies import resolved_chain as paper
from bench.studies.integrators import euler, runge_kutta, strike
from sim.resolved.fall import STEP, fall
from sim.resolved.scene import Strings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bench.studies.integrators import Follow
    from sim.resolved.scene import Chain

RODS = 3
INCLINES = (40.0, 50.0, 60.0, 70.0)
STEPS = (1.6e-5, 1e-5, 6e-6, 3e-6)
REFERENCE = 7.5e-7
TIMES = (0.8e-3, 0.4e-3, 0.2e-3, 0.1e-3)
"""Of a touch, s; the shortest is what the others are held against."""
INTEGRATORS = {"step": None, "Euler": euler, "Runge and Kutta": runge_kutta}
"""`None` is the leapfrog, which all else is held against."""
SHORT_S = 0.21
"""How long a chain of 25 rods falls that no loop was compiled for, s."""


def chains(touch_s: float = 0.2e-3, rods: int = RODS) -> list[Chain]:
    """Hang the first rods of the paper's chain, one chain for each of `INCLINES`."""
    rng = np.random.default_rng(1)
    return [
        paper.paper_chain(one, rng, rods=rods, touch_s=touch_s, touching=rods > RODS)
        for one in INCLINES
    ]


def separations(
    some: Sequence[Chain], step: float, follow: Follow | None = None
) -> tuple[list[float], float]:
    """Δz at the strike of each chain, m, and processor time for one, s."""
    _struck(some[0], step, follow)  # compiles
    begin = time.process_time()
    found = [_struck(one, step, follow) for one in some]
    spent = (time.process_time() - begin) / len(some)
    top = paper.DROP + paper.PITCH * (RODS - 1)
    return [top - 0.5 * paper.GRAVITY * when**2 - height for when, height in found], spent


def _struck(chain: Chain, step: float, follow: Follow | None) -> tuple[float, float]:
    if follow is not None:
        return strike(chain, follow, step)
    found = fall(chain, step=step, after=0.0)
    return found.strike_s, float(found.touched_height[-1])


def settings() -> Iterator[dict[str, float | str]]:
    """Try every setting."""
    exact, _ = separations(chains(), REFERENCE)
    for name, follow in INTEGRATORS.items():
        for step in STEPS:
            yield _line(name, step, 0.2e-3, exact, *separations(chains(), step, follow))
    # A touch that is n times as long bears a step n times as long, once the strings do too.
    soft = [_softer(chains(touch), touch) for touch in TIMES]
    stiffest, spent = separations(soft[-1], 5e-6)
    for touch, some in zip(TIMES, soft, strict=True):
        last = touch == TIMES[-1]
        found = (stiffest, spent) if last else separations(some, 5e-6 * touch / TIMES[-1])
        yield _line("touch", 5e-6 * touch / TIMES[-1], touch, stiffest, *found)


def _softer(some: Sequence[Chain], touch: float) -> list[Chain]:
    """Give strings that ring as slowly as the touch lasts."""
    strain = Strings().strain_at_break * (touch / 0.2e-3) ** 2
    return [replace(one, strings=Strings(strain_at_break=strain)) for one in some]


def _line(
    changed: str, step: float, touch: float, exact: list[float], found: list[float], spent: float
) -> dict[str, float | str]:
    errors = np.abs(np.subtract(found, exact))
    return {
        "changed": changed,
        "step_s": step,
        "touch_s": touch,
        "rms_m": float(np.sqrt((errors**2).mean())),
        "worst_m": float(errors.max()),
        "cpu_s": spent,
    }


def speeds() -> Iterator[dict[str, float | str | None]]:
    """Let 25 rods fall, with compiled loops and for a while without."""
    fall(chains(rods=paper.RODS)[0], until=0.0)
    yield _speed(f"{paper.RODS} rods", time_of_many(None))
    yield _speed(f"{paper.RODS} rods until {SHORT_S:g} s", time_of_many(SHORT_S))
    command = [
        sys.executable,
        "-c",
        f"from {__package__}.resolved_precision import *; print(time_of_many(SHORT_S))",
    ]
    plain = run(command, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, stdout=PIPE, check=True)
    yield _speed(f"{paper.RODS} rods until {SHORT_S:g} s, not compiled", float(plain.stdout))


def time_of_many(until: float | None) -> float:
    """Processor time for a fall of 25 rods, s: the mean over `INCLINES`."""
    begin = time.process_time()
    for one in chains(rods=paper.RODS):
        fall(one, until=until)
    return (time.process_time() - begin) / len(INCLINES)


def _speed(changed: str, spent: float) -> dict[str, float | str | None]:
    return {"changed": changed, "step_s": STEP, "touch_s": 0.2e-3, "rms_m": None,
            "worst_m": None, "cpu_s": spent}  # fmt: skip


if __name__ == "__main__":
    for line in (*settings(), *speeds()):
        print(json.dumps(line), flush=True)
