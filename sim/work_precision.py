"""Error against run time of the resolved world: ``python -m sim.work_precision`` prints JSON lines.

Chains of three rods, which do not touch each other: longer falls are chaotic, and no step makes a
single one exact. A tilt that differs by 1 nrad moves Δz of three rods by up to 0.1 nm, of five by
0.3 µm, of eight by 0.6 mm. Each line is one setting: its step, what it changes, the largest and the
rms error of Δz at the strike, and processor time for a fall.
"""

from __future__ import annotations

import json
import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sim.resolved.fall import fall
from sim.resolved.scene import Board, Bounce, Chain, Rods, Strings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

RODS, PITCH, DROP, GRAVITY = 3, 1.165 / 24, 0.18, 9.81
INCLINES = (40.0, 50.0, 60.0, 70.0)
STEPS = (1.6e-5, 1e-5, 6e-6, 3e-6)
REFERENCE = 1.5e-6
TIMES = (0.8e-3, 0.4e-3, 0.2e-3, 0.1e-3)
"""Of a touch, s; the shortest is what the others are held against."""


def chains(touch_s: float = 0.2e-3) -> list[Chain]:
    """Hang the first rods of the paper's chain, one chain for each of `INCLINES`."""
    rng = np.random.default_rng(1)
    found = []
    for incline in INCLINES:
        signs = (-1.0) ** np.arange(RODS)
        rods = Rods(
            masses=np.full(RODS, 5.8e-3),
            heights=PITCH * np.arange(RODS),
            diameters=np.full(RODS, 12.7e-3),
            tilts=signs * np.radians(12.0 + rng.normal(size=RODS)),
            yaws=np.radians(2.0 * rng.normal(size=RODS)),
            aside=0.5e-3 * rng.normal(size=RODS),
            length=0.102,
        )
        board = Board(math.radians(incline), Bounce(0.5, touch_s, 0.2))
        found.append(Chain(rods, Strings(), DROP, GRAVITY, board))
    return found


def separations(some: Sequence[Chain], step: float) -> tuple[list[float], float]:
    """Δz at the strike of each chain, m, and processor time for one, s."""
    begin = time.process_time()
    found = fall(some, step=step, after=0.0)
    spent = (time.process_time() - begin) / len(some)
    top = DROP + PITCH * (RODS - 1)
    return [
        top - 0.5 * GRAVITY * one.strike_s**2 - float(one.touched_height[-1]) for one in found
    ], spent


def settings() -> Iterator[dict[str, float | str]]:
    """Try every setting."""
    exact, _ = separations(chains(), REFERENCE)
    for step in STEPS:
        yield _line("step", step, 0.2e-3, exact, *separations(chains(), step))
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


if __name__ == "__main__":
    for line in settings():
        print(json.dumps(line), flush=True)
