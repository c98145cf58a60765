"""Looking at the gates for a while: which are blocked, and which do not keep still."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rig.boards import GATES

if TYPE_CHECKING:
    from collections.abc import Callable

    from rig.clock.host import Clock

_LOOK_S = 0.0017  # in step with neither a USB frame nor the mains


class GateStates(NamedTuple):
    """Masks of the gates that were blocked all the time, and of those that changed."""

    stuck: int
    flickering: int


def name_gates(mask: int) -> str:
    """Name the gates of a mask, as in ``gates 1, 8``."""
    numbers = [str(n) for n in range(GATES) if mask >> n & 1]
    return f"gate{'s' * (len(numbers) > 1)} {', '.join(numbers)}"


def watch_gates(look: Callable[[], int], clock: Clock, seconds: float) -> GateStates:
    """Look again and again.

    Parameters
    ----------
    look
        Gives the mask of the gates that are blocked now.
    clock
        The port's time.
    seconds
        For how long.
    """
    always = ever = look()
    end = clock.now_ns() + round(seconds * 1e9)
    while clock.now_ns() < end:
        now = look()
        always, ever = always & now, ever | now
        clock.sleep(_LOOK_S)
    return GateStates(always, ever & ~always)
