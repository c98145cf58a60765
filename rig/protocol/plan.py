"""Expansion of a plan into its runs, in the order of execution."""

from itertools import product
from typing import TypeVar

from rig.protocol.protocol import Order, Protocol, Run

T = TypeVar("T")


# Which chain is on the impact side, repeating. ABBA cancels a drift that is linear in time.
PATTERNS: dict[Order, tuple[int, ...]] = {"ABBA": (0, 1, 1, 0), "alternate": (0, 1), "fixed": (0,)}


def runs(protocol: Protocol) -> tuple[Run, ...]:
    """Return all planned runs of a protocol.

    At each incline and setting the impact chain of runs 1, 2, 3, 4 … is A, B, B, A … (``ABBA``),
    A, B, A, B … (``alternate``) or always A (``fixed``), A being the chain named first.
    ``randomize: incline`` shuffles inclines and settings together, and leaves each block whole;
    ``randomize: all`` shuffles the runs themselves, so each chain keeps its number of impacts in
    each case.

    Parameters
    ----------
    protocol
        A checked protocol.

    Returns
    -------
    tuple of Run
        A run for each incline, setting and repeat, numbered from 1 in the order of execution. The
        same protocol gives the same runs on every machine.
    """
    plan = protocol.plan
    cases = list(product(plan.inclines, protocol.settings))
    if plan.randomize == "incline":
        cases = _shuffle(cases, plan.seed)
    pattern = PATTERNS[plan.order]
    drops = [
        (incline, *_sides(protocol, pattern[repeat % len(pattern)]), setting)
        for incline, setting in cases
        for repeat in range(plan.repeats)
    ]
    if plan.randomize == "all":
        drops = _shuffle(drops, plan.seed)
    return tuple(Run(number, *drop) for number, drop in enumerate(drops, start=1))


def _sides(protocol: Protocol, first: int) -> tuple[str | None, str | None]:
    """Return the names of the chains on the impact and the free side."""
    names = list(protocol.chains)
    if protocol.surface is None:
        return None, names[0]
    if len(names) == 1:
        return names[0], None
    return names[first], names[1 - first]


def _shuffle(items: list[T], seed: int) -> list[T]:
    """Return a Fisher–Yates shuffle that is the same everywhere.

    Python promises the sequence of ``random()`` for a given seed across versions and platforms,
    but not what ``shuffle()`` makes of it.
    """
    import random  # noqa: PLC0415 - most plans are not shuffled

    source = random.Random(seed)
    result = list(items)
    for last in reversed(range(1, len(result))):
        swap = int(source.random() * (last + 1))
        result[last], result[swap] = result[swap], result[last]
    return result
