"""How much it matters that impacts last: the way to the discrete fall as τ → 0, and how far it is.

With impacts that are over before the next one, Δz and V depart from the discrete fall in
proportion to τ. Where they still go on they do not, and V may even come back and fall short.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from rig.errors import DomainError
from rig.model.contact import contact_fall
from rig.model.fall import Fall
from rig.model.motion import Motion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.model.chain import Chain

    Measurand = Literal["separation", "speed"]

_SCAN = 1.1  # ratio of neighbouring contact times in the search for the first crossing
_NEAR, _FAR = 1e-3, 1e6  # where it starts (times share) and ends, in durations of the fall
_HALVINGS = 60  # of a tenth of a logarithm: to the last digit


@dataclass(frozen=True, slots=True)
class Departure:
    """Fall with impacts that last, less the discrete one.

    Attributes
    ----------
    contact_time_s
        τ.
    separation_m, speed_m_s
        Differences of Δz and of V.
    """

    contact_time_s: float
    separation_m: float
    speed_m_s: float


@dataclass(frozen=True, slots=True)
class Order:
    """Order of convergence p between two contact times: the departures go as τᵖ."""

    separation: float
    speed: float


def discrete_fall(
    chain: Chain, gains: Sequence[float], drop: float, gravity: float, initial_speed: float = 0.0
) -> Fall:
    """The fall with impacts that take no time, from the same gains."""
    motion = Motion(chain, gains, drop, gravity, initial_speed)
    end = motion.at(motion.end_s)
    return Fall(end.separation_m, end.speed_m_s, end.time_s)


def departures(
    chain: Chain,
    gains: Sequence[float],
    drop: float,
    gravity: float,
    contact_times: Sequence[float],
    initial_speed: float = 0.0,
) -> list[Departure]:
    """How far each contact time takes Δz and V from the discrete fall.

    Parameters
    ----------
    chain, gains, drop, gravity, initial_speed
        As in `rig.model.contact.contact_fall`.
    contact_times
        τ, s.
    """
    instant = discrete_fall(chain, gains, drop, gravity, initial_speed)
    found = []
    for tau in contact_times:
        end = contact_fall(chain, gains, drop, gravity, tau, initial_speed)
        found.append(
            Departure(
                tau,
                end.separation_m - instant.separation_m,
                end.speed_m_s - instant.speed_m_s,
            )
        )
    return found


def orders(found: Sequence[Departure]) -> list[Order]:
    """Order of convergence between each two neighbours; 1 once impacts are over in time.

    Raises
    ------
    DomainError
        Where one of two neighbours does not depart at all, or both have the same contact time.
    """
    return [
        Order(
            _order(one.contact_time_s, one.separation_m, other.contact_time_s, other.separation_m),
            _order(one.contact_time_s, one.speed_m_s, other.contact_time_s, other.speed_m_s),
        )
        for one, other in pairwise(found)
    ]


def longest_contact(
    chain: Chain,
    gains: Sequence[float],
    drop: float,
    gravity: float,
    measurand: Measurand,
    share: float,
    initial_speed: float = 0.0,
) -> float:
    """Longest contact time up to which Δz or V changes by less than a share of itself, s.

    It is the first crossing: found by going up in steps of a tenth, then by halving. Infinite where
    no contact time changes it by that much, as V cannot change by more than its gain on free fall.

    Parameters
    ----------
    chain, gains, drop, gravity, initial_speed
        As in `rig.model.contact.contact_fall`.
    share
        Such as 0.001; between 0 and 1.

    Raises
    ------
    DomainError
        For a share outside that range, or where no rod pulls.
    """
    if not 0.0 < share < 1.0:
        raise DomainError(f"a share of {share:g}", "give one between 0 and 1")
    instant = discrete_fall(chain, gains, drop, gravity, initial_speed)
    if instant.separation_m == 0.0:
        raise DomainError("no rod pulls: no contact time changes anything", "α must be above zero")

    def excess(tau: float) -> float:
        end = contact_fall(chain, gains, drop, gravity, tau, initial_speed)
        if measurand == "separation":
            return abs(end.separation_m / instant.separation_m - 1.0) - share
        return abs(end.speed_m_s / instant.speed_m_s - 1.0) - share

    below = _NEAR * share * instant.time_s
    while excess(below) >= 0.0:
        below *= 0.5
    while excess(above := below * _SCAN) < 0.0:
        below = above
        if below > _FAR * instant.time_s:
            return math.inf
    for _ in range(_HALVINGS):
        middle = math.sqrt(below * above)
        if not below < middle < above:
            break
        if excess(middle) < 0.0:
            below = middle
        else:
            above = middle
    return below


def _order(tau: float, change: float, other_tau: float, other_change: float) -> float:
    """Exponent p in change ∝ τᵖ."""
    if change == 0.0 or other_change == 0.0 or tau == other_tau:
        raise DomainError(
            f"no order of convergence between contact times of {tau:g} s and {other_tau:g} s",
            "both must differ, and so must the falls from the discrete one",
        )
    return math.log(abs(other_change / change)) / math.log(other_tau / tau)
