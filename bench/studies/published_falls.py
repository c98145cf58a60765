"""What others published, as resolved falls.

Grewal, Johnson and Ruina (2011) dropped chains of tilted rods from 75 cm onto a table; how many
rods is not known here, so there are several. Calkin and March (1989) let a folded chain fall with
one end fixed. Corbin and others (2017) found a delay before the pull begins: so here is each rod's
impulse beside Eq. 9, by its place in the chain. At the end the paper's chain once more, for each
guess of this world that might have been another.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.studies.resolved_chain import BETA, GRAVITY, MU, paper_chain
from rig.model.impact import alpha_inclined, alpha_level, gamma_finite
from sim.resolved.fall import fall
from sim.resolved.scene import Chain, Rods, Strings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from sim.resolved.scene import Fall, Numbers

FALLS = 16
GREWAL_DROP, GREWAL_RODS = 0.75, (15, 20, 25)
FOLDED_RODS = (20, 40, 80)
INCLINES = tuple(range(0, 81, 10))
PARTS = {"first": slice(0, 1), "2 to 5": slice(1, 5), "6 to 24": slice(5, 24)}
"""Places in a chain of 25 rods; the top rod pulls nothing."""
SLIPPING = (5, 11, 17, 20, 25, 30, 40, 60)
"""Inclines, in degrees; friction is 0.2, so a block would stick below 11.3."""


def _bounce(chain: Chain, **changes: float) -> Chain:
    assert chain.board is not None
    assert chain.touching is not None
    board = replace(chain.board, bounce=replace(chain.board.bounce, **changes))
    return replace(chain, board=board, touching=replace(chain.touching, **changes))


def _rods(chain: Chain, **changes: float) -> Chain:
    assert chain.touching is not None
    return replace(chain, touching=replace(chain.touching, **changes))


GUESSES: dict[str, Callable[[Chain], Chain]] = {
    "default": lambda one: one,
    "dead strings": lambda one: replace(one, strings=Strings(0.1)),
    "lively strings": lambda one: replace(one, strings=Strings(0.7)),
    "strings of 2 %": lambda one: replace(one, strings=Strings(strain_at_break=0.02)),
    "touches of 0.1 ms": partial(_bounce, time_s=1e-4),
    "touches of 0.4 ms": partial(_bounce, time_s=4e-4),
    "no rods on rods": lambda one: replace(one, touching=None),
    "rods on rods: restitution 0.2": partial(_rods, restitution=0.2),
    "rods on rods: restitution 0.8": partial(_rods, restitution=0.8),
    "rods on rods: friction 0.1": partial(_rods, friction=0.1),
    "rods on rods: friction 0.5": partial(_rods, friction=0.5),
    "no rolling": lambda one: replace(one, rods=replace(one.rods, rolling=False)),
}
GUESSED_AT = (0, 30, 40, 60)
"""Inclines, in degrees."""


def results() -> Iterator[dict[str, Any]]:
    """Let all of it fall."""
    for rods in GREWAL_RODS:
        some = [paper_chain(0.0, np.random.default_rng(n), rods=rods, drop=GREWAL_DROP)
                for n in range(FALLS)]  # fmt: skip
        ahead = [_separation(one, fall(one, after=0.0)) for one in some]
        yield _line("Grewal: ahead at strike (m)", f"{rods} rods", ahead)
    for rods in FOLDED_RODS:
        yield _line("Calkin and March: T/T_ff", f"{rods} rods", [folded_time(rods)])
    for incline in INCLINES:
        ratios = np.array([_impulses(incline, n) for n in range(FALLS)])
        for name, part in PARTS.items():
            yield _line(
                "impulse over Eq. 9, rods", f"{name}, {incline}°", ratios[:, part].mean(axis=1)
            )
    for incline in SLIPPING:
        shares = [_friction(incline, n) for n in range(FALLS)]
        yield _line("friction along the slope over μN", f"{incline}°", shares)
    for name, other in GUESSES.items():
        for incline in GUESSED_AT:
            some = [other(paper_chain(incline, np.random.default_rng(n))) for n in range(FALLS)]
            apart = [_separation(one, fall(one, after=0.0)) for one in some]
            yield _line("separation at strike (m)", f"{name}, {incline}°", apart)


def _line(what: str, of: str, values: Numbers | list[float]) -> dict[str, Any]:
    spread = float(np.std(values, ddof=1)) if len(values) > 1 else None
    return {"what": what, "of": of, "mean": float(np.mean(values)), "sd": spread, "n": len(values)}


def _separation(chain: Chain, found: Fall) -> float:
    top = chain.start + float(chain.rods.heights[-1])
    return top - 0.5 * chain.gravity * found.strike_s**2 - float(found.touched_height[-1])


def folded_time(count: int, step: float = 4e-6) -> float:
    """Time of a folded chain's loose end until it is lowest, over that of free fall as far."""
    pitch = 1.0 / (count - 1)
    down = -pitch * np.arange(count // 2)
    zero = np.zeros(count)
    rods = Rods(
        np.full(count, 0.145 / count), np.concatenate([down, down[::-1]]), np.full(count, 1e-3),
        zero, zero, pitch * (np.arange(count) >= count // 2), 0.1,
    )  # fmt: skip
    found = fall(Chain(rods, Strings(1.0), 0.0, GRAVITY, held=1), until=0.45, step=step)
    end = found.heights[:, -1]
    lowest = int(end.argmin())
    return float(found.times[lowest] / math.sqrt(2.0 * (end[0] - end[lowest]) / GRAVITY))


def _impulses(incline: float, seed: int) -> Numbers:
    """Impulse of each rod but the top one over Eq. 9's at the speed that the chain has then."""
    chain = paper_chain(incline, np.random.default_rng(seed))
    found = fall(chain, after=0.0)
    alpha = alpha_inclined(BETA, MU, incline) if incline else alpha_level(BETA)
    mass = float(chain.rods.masses[0])
    above = mass * np.arange(chain.rods.masses.size - 1, 0, -1)
    pulled = found.pulled[:-1]
    gained = np.concatenate([[0.0], np.cumsum(pulled / above)[:-1]])
    speed = GRAVITY * found.touched_s[:-1] + gained
    return np.asarray(pulled * (1.0 + gamma_finite(1 / 3) * mass / above) / (alpha * mass * speed))


def _friction(incline: float, seed: int) -> float:
    """Of the first rod's impact at 4.4 m/s, up the slope, over μ times the normal impulse."""
    chain = paper_chain(incline, np.random.default_rng(seed), rods=3, drop=1.0)
    first = fall(chain, after=0.0).touched_s[0]
    given = fall(chain, until=first + 0.6e-3).board_impulse
    sin, cos = math.sin(math.radians(incline)), math.cos(math.radians(incline))
    return float(-(given[1] * cos - given[2] * sin) / (MU * (given[1] * sin + given[2] * cos)))
