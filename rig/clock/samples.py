"""Clock samples as columns of integers, on one axis of host time over its sleep and restarts.

A night has a hundred thousand of them.
"""

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rig.records import ClockSample, HostBreak

Samples: TypeAlias = "NDArray[np.int64]"
"""Shape (n, 3): `rig.records.ClockSample`'s host time before and after, ns, and tick."""
SEND, RECV, TICK = range(3)
_APART_NS = 3600 * 10**9  # between two connections whose distance in time nobody knows


def samples(pings: Sequence[ClockSample]) -> Samples:
    """Turn clock samples into columns."""
    return np.array(pings, np.int64).reshape(-1, 3)


class Stretch(NamedTuple):
    """From when on, by the host's clock, what is added to put a time on the axis."""

    begin_ns: int
    shift_ns: int


class HostTime(NamedTuple):
    """Clock samples on one axis of time.

    Attributes
    ----------
    pings
        In order of time, host times put on the axis.
    cuts_ns
        Moments of the axis over which no two samples may be compared: the board or the host's
        clock may have begun again there.
    lives
        For each life of the host's clock its stretches, in order: sleep begins a new one.
    """

    pings: Samples
    cuts_ns: tuple[int, ...]
    lives: tuple[tuple[Stretch, ...], ...]

    def shifts(self, host_ns: int) -> list[int]:
        """Find what to add to a host time: one value for each life it may be of.

        Of a record without a sample beside it nobody knows in which life it was made.
        """
        return [_shift(life, host_ns) for life in self.lives]


def one_axis(
    pings: Samples, boots_ns: Sequence[int] = (), breaks: Sequence[HostBreak] = ()
) -> HostTime:
    """Put samples on one axis where the host's clock began again or stood still in between.

    Parameters
    ----------
    pings
        In order of recording.
    boots_ns
        When the board may have begun again, by the host's clock of that time.
    breaks
        When the host slept or its clock was set.
    """
    columns = pings.copy()
    befores, afters = columns[:-1, RECV].copy(), columns[1:, SEND].copy()
    odd = afters < befores
    for pause in breaks:
        odd |= (befores <= pause.host_ns) & (pause.host_ns <= afters)
    shift = 0
    lives = [[Stretch(0, 0)]]
    cuts: list[int] = []
    for gap in np.flatnonzero(odd).tolist():
        before, after, shifted = int(befores[gap]), int(afters[gap]), shift
        if after < before:
            cuts.append(before + shift)
            shift += before + _APART_NS - after
            lives.append([Stretch(0, shift)])
        else:
            for pause in breaks:
                if before <= pause.host_ns <= after:
                    shift += pause.slept_ns
                    lives[-1].append(Stretch(pause.host_ns, shift))
        columns[gap + 1 :, : RECV + 1] += shift - shifted
    moments = [*boots_ns, *(pause.host_ns for pause in breaks)]
    cuts += [moment + _shift(life, moment) for life in lives for moment in moments]
    return HostTime(columns, tuple(sorted(cuts)), tuple(map(tuple, lives)))


def _shift(life: Sequence[Stretch], host_ns: int) -> int:
    return max((part for part in life if part.begin_ns <= host_ns), default=life[0]).shift_ns
