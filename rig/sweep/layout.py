"""From a protocol and ``NAME=LOW..HIGH:COUNT`` to the grid and all that stays as it is."""

import math
import re
from collections.abc import Container, Iterable, Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from rig.arrays import Array
from rig.errors import InputError
from rig.model.chain import Chain
from rig.model.surface import Pile
from rig.protocol.protocol import Protocol
from rig.reasons import rig_error
from rig.sweep.variables import VARIABLES, Grid, scene_values
from rig.units import UnitError, did_you_mean, parse, quote

MOST_POINTS = 20_000_000
"""Their results take 17 bytes each, all in memory until the file is written."""
MOST_VALUES = 1_000_000
_EXAMPLE = "write for example restitution=-0.4..0.9:200 or incline=40deg"


class Layout(NamedTuple):
    """One sweep, ready to be computed: all combinations of the axes' values, the last fastest.

    Attributes
    ----------
    values
        Of each parameter, in SI, angles in degrees, rising or as the plan lists them. Those with
        several are the axes.
    layered
        Whether the first axis are the plan's inclines, there being several and none asked for.
    chain
        The one that strikes.
    longer_m
        How much longer the free chain is; it adds to every separation.
    pile
        The surface's rule for rods that gather, if it has one and it matters.
    two_chains
        Whether a chain falls freely beside it; without, Δz is from a twin that nobody hung.
    """

    values: Grid
    layered: bool
    chain: Chain
    longer_m: float
    pile: Pile | None
    two_chains: bool

    @property
    def axes(self) -> Grid:
        """Values of the parameters that vary."""
        return {name: numbers for name, numbers in self.values.items() if len(numbers) > 1}

    @property
    def fixed_values(self) -> dict[str, float]:
        """Values of the others."""
        return {name: numbers[0] for name, numbers in self.values.items() if len(numbers) == 1}

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values along each axis."""
        return tuple(map(len, self.axes.values()))

    @property
    def size(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    def chunks(self, length: int) -> Iterator[slice]:
        """Cut the points, in their order, into pieces of `length`; the last may be shorter."""
        for start in range(0, self.size, length):
            yield slice(start, min(start + length, self.size))

    def along_axes(self, points: slice) -> dict[str, Array]:
        """Return the values of a piece's points, axis by axis."""
        numbers = np.unravel_index(np.arange(points.start, points.stop), self.shape)
        axes = zip(self.axes.items(), numbers, strict=True)
        return {name: np.array(values)[places] for (name, values), places in axes}


def lay_out(protocol: Protocol, vary: Iterable[str]) -> Layout:
    """Lay out a sweep.

    Parameters
    ----------
    protocol
        The scene; of unlike chains the first one strikes, as in ``rig predict``.
    vary
        As in `read_vary`.

    Raises
    ------
    InputError
        If the scene has no surface, `vary` has faults, or there are more than `MOST_POINTS`.
    """
    scene = scene_values(protocol)
    varied = read_vary(vary, tuple(scene))
    stated = {name: values for name, values in scene.items() if name not in varied}
    first, *twins = (rods.chain for rods in protocol.chains.values())
    layout = Layout(
        values=stated | varied,
        layered=any(len(numbers) > 1 for numbers in stated.values()),
        chain=first,
        longer_m=twins[0].length - first.length if twins else 0.0,
        pile=protocol.surface.pile if protocol.surface and "incline" in scene else None,
        two_chains=protocol.two_chains,
    )
    if layout.size > MOST_POINTS:
        shape = " × ".join(map(str, layout.shape))
        raise rig_error("sweep_too_large", shape=shape, points=layout.size, most=MOST_POINTS)
    return layout


class _FaultError(Exception):
    """The column (from 0) at which the part of a text starts that is wrong, and the message."""


def read_vary(texts: Iterable[str], names: Sequence[str]) -> Grid:
    """Read all ``--vary`` of a command line.

    Parameters
    ----------
    texts
        Each ``NAME=LOW..HIGH:COUNT``, or ``NAME=VALUE`` to hold a parameter at another value than
        the protocol's. Quantities have their unit, as in a protocol.
    names
        Of the parameters that the scene has.

    Returns
    -------
    dict of str to tuple of float
        Values by name in the order given, in SI, angles in degrees; one value where one was given.

    Raises
    ------
    InputError
        With every problem found, each with its text and column.
    """
    varied_values: Grid = {}
    problems = []
    for text in texts:
        try:
            name, values = _read(text, names, varied_values)
        except _FaultError as fault:
            column, message = fault.args
            problems.append(f"--vary {quote(text, 80)}, column {column + 1}: {message}")
        else:
            varied_values[name] = values
    if problems:
        raise InputError("\n".join(problems))
    if all(len(values) == 1 for values in varied_values.values()):
        raise rig_error("nothing_varied")
    return varied_values


_VARY = re.compile(r"(?s)(?P<name>[^=]*)=(?P<low>.*?)(\.\.(?P<high>[^:]*)(:(?P<count>.*))?)?")


def _read(text: str, names: Sequence[str], taken: Container[str]) -> tuple[str, tuple[float, ...]]:
    parts = _VARY.fullmatch(text)
    if parts is None:
        raise _FaultError(0, _EXAMPLE)
    name, low, high, count = (part and part.strip() for part in parts.group(*_VARY.groupindex))
    middle = parts.start("high")
    if name not in names:
        guess = did_you_mean(name, tuple(names))
        raise _FaultError(0, f"not in this scene; {guess}it can vary: {', '.join(names)}")
    if name in taken:
        raise _FaultError(0, "given twice; keep one of them")
    if high is None:
        if ":" in low:
            raise _FaultError(parts.start("low"), f"a range is LOW..HIGH:COUNT; {_EXAMPLE}")
        return name, (_value(name, parts, "low"),)
    if parts["high"].startswith("."):  # 1...5 may be 1. to .5 or a slip
        message = "between LOW and HIGH are two dots, and before a dot is a digit"
        raise _FaultError(middle - 2, message)
    ends = _value(name, parts, "low"), _value(name, parts, "high")
    if not ends[0] < ends[1]:
        raise _FaultError(middle, f"found {high}; it must be more than {low}")
    if count is None:
        raise _FaultError(parts.end("high"), f"say how many values: {text.strip()}:81")
    if not (re.fullmatch("[0-9]{1,9}", count) and 2 <= int(count) <= MOST_VALUES):
        message = f"found {quote(count)}; a whole number from 2 to {MOST_VALUES} is wanted"
        raise _FaultError(parts.start("count"), message)
    return name, linspace(*ends, int(count))


def _value(name: str, parts: re.Match[str], part: str) -> float:
    accepted, text = VARIABLES[name].accepted, parts[part].strip()
    try:
        read = parse(text, accepted.dimension)
    except UnitError as error:
        raise _FaultError(parts.start(part), str(error)) from None
    if read.u > 0:
        raise _FaultError(parts.start(part), f"found {text}; no uncertainty is used here")
    if read.value not in accepted:
        raise _FaultError(parts.start(part), f"found {text}; accepted: {accepted}")
    return read.value


def linspace(low: float, high: float, count: int) -> tuple[float, ...]:
    """Return `count` evenly spaced numbers from `low` to `high`, both among them.

    Each is the float nearest to what a person finds by decimal arithmetic: 0 to 0.9 in nine steps
    has 0.3 and not 0.30000000000000004.

    Parameters
    ----------
    low, high
        Finite.
    count
        At least 2.
    """
    start, end = Fraction(repr(low)), Fraction(repr(high))
    step = (end - start) / (count - 1)
    return tuple(float(start + step * number) for number in range(count))
