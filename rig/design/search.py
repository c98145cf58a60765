"""Better heights for the beams that are there: one beam at a time goes where it tells most.

Beams that tell most must also be read: a layout whose edges could be given to wrong rods is none.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from rig.analysis.components import Components
from rig.design.cases import cases
from rig.design.forecast import GateLayout, forecast
from rig.design.trials import MARGIN, margin
from rig.measurands import averaged
from rig.protocol.gates import blocking_rod, hanging_rods
from rig.protocol.protocol import Gate, Gates, Protocol
from rig.reasons import rig_error
from rig.threads import one_thread

COEFFICIENTS = ("restitution", "friction")
"""What a layout is judged by beside the measurands that have means: the mean of the logarithms."""
FEW = 3
"""Inclines that the search looks at; the forecast looks at all of them."""
_GRID_M = 4e-3  # between candidates
_ROUNDING_M = 1e-9
_COARSE = 5  # every so many of them are tried first, then those about the best
_SWEEPS = 4
_BEFORE = 2  # beams of a side above the chain's lower end that stay there
_WORTH = 1e-3  # a gain in the mean logarithm that is worth moving a beam for


class Room(NamedTuple):
    """Where beams may be, m.

    Attributes
    ----------
    lowest, highest
        Limits of height.
    spacing
        Least distance of two beams of one side.
    """

    lowest: float
    highest: float
    spacing: float


def room(protocol: Protocol, lowest: float | None, highest: float | None, spacing: float) -> Room:
    """Take limits as they are given, else from the gates that are there and the chains."""
    heights = [gate.height for gate in protocol.gates.gates]
    top = min(protocol.drop.value + rods.chain.length for rods in protocol.chains.values())
    lowest = min(heights) if lowest is None else lowest
    highest = max(heights) if highest is None else highest
    return Room(lowest, min(top, highest), spacing)


def candidates(protocol: Protocol, limits: Room) -> list[float]:
    """Heights on a grid at which no hanging rod blocks a beam."""
    rods = hanging_rods(protocol.chains.values(), protocol.drop)
    grid = np.arange(limits.lowest, limits.highest + 1e-9, _GRID_M).tolist()
    return [round(height, 4) for height in grid if blocking_rod(rods, height) is None]


@one_thread
def better(
    protocol: Protocol,
    components: Components,
    limits: Room,
    say: Callable[[str], None] = lambda _: None,
) -> Protocol:
    """Return a protocol with its gates at better heights; those of a side keep their order.

    Each beam in turn is tried at candidate heights while the others stay; sweeps go on until none
    moves. That finds no worse a layout than it begins with, and not always the best of all. A
    layout whose edges could be given to wrong rods is none, see `readable`.

    Parameters
    ----------
    components
        How much everything scatters.
    limits
        Where beams may be.
    say
        Told how far it is.
    """
    if protocol.variants:
        raise rig_error("search_varied")
    present, heights = protocol.gates, candidates(protocol, limits)
    gates = [*present.gates, *(Gate(0, z, side) for side in present.posts for z in heights)]
    inclines = sorted(protocol.plan.inclines)
    few = {inclines[round(n * (len(inclines) - 1) / (FEW - 1))] for n in range(FEW)}
    fewer = replace(protocol, plan=replace(protocol.plan, inclines=tuple(few)))
    all_cases = cases(fewer.with_gates(gates), components)
    layout = list(range(len(present.gates)))
    # Where the layout that is there is itself hard to read, one that is no harder will do.
    floor = min(MARGIN, margin(protocol))
    best = present_score = score(protocol, GateLayout.of(all_cases, layout))
    for sweep in range(1, _SWEEPS + 1):
        before = best
        for slot, gate in enumerate(present.gates):
            stay = [n for other, n in enumerate(layout) if other != slot]
            fixed = GateLayout.of(all_cases, stay).triangles()
            taken = np.array([gates[n].height for n in stay if gates[n].side == gate.side])
            places = [
                n
                for n, place in enumerate(gates)
                if n >= len(layout)
                and place.side == gate.side
                and (np.abs(place.height - taken) >= limits.spacing - _ROUNDING_M).all()
            ]
            for stride, reach in ((_COARSE, len(places)), (1, _COARSE - 1)):
                centre = places.index(layout[slot]) if layout[slot] in places else len(places) // 2
                for n in places[max(0, centre - reach) : centre + reach + 1 : stride]:
                    trial = score(protocol, fixed.plus(n))
                    if trial >= best - _WORTH:
                        continue
                    # Only now: whether it can be read takes a few drops to be read.
                    numbers = *layout[:slot], n, *layout[slot + 1 :]
                    proposed = protocol.with_gates(gates[number] for number in numbers)
                    if _see_before(protocol, proposed) and margin(proposed) >= floor:
                        best, layout[slot] = trial, n
        ratio = math.exp(best - present_score)
        say(f"sweep {sweep}: uncertainties × {ratio:.3g} in the geometric mean")
        if before - best < _WORTH:
            break
    return protocol.with_gates(_in_order(present, [gates[n] for n in layout]))


def _see_before(protocol: Protocol, proposed: Protocol) -> bool:
    """Whether enough beams of each side still see the chain before anything strikes.

    With fewer, one missed edge too many leaves the fall open.
    """
    before, after = (
        Counter(gate.side for gate in p.gates.gates if gate.height > protocol.drop.value)
        for p in (protocol, proposed)
    )
    enough = (after[side] >= min(number, _BEFORE) for side, number in before.items())
    return protocol.surface is None or all(enough)


def score(protocol: Protocol, layout: GateLayout) -> float:
    """Mean of the logarithms of all uncertainties that count; less is better."""
    goals = (*(row.name for row in averaged()), *COEFFICIENTS)
    expected = forecast(protocol, layout, goals)
    uncertainties = {name: expected.typical(name) for name in expected.single}
    uncertainties |= expected.coefficients
    values = [math.log(uncertainties[name]) for name in goals if name in uncertainties]
    return sum(values) / len(values)


def _in_order(present: Gates, moved: Sequence[Gate]) -> list[Gate]:
    """Give the lowest gate of each side its lowest new height, and so on upwards."""
    upwards = attrgetter("side", "height")
    pairs = zip(sorted(present.gates, key=upwards), sorted(moved, key=upwards), strict=True)
    heights = {gate.channel: place.height for gate, place in pairs}
    return [replace(gate, height=heights[gate.channel]) for gate in present.gates]
