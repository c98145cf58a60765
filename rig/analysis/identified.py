"""Which rods a drop's edges are, found out once, at a round time scale.

The session's clock is known a little better with each further drop; which edge is which rod stays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.analysis.annealing import LEAST
from rig.analysis.chain_records import chain_records
from rig.analysis.fit import Begun
from rig.analysis.identify import identify
from rig.analysis.verdict import pattern_faults

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from rig.analysis.components import Components
    from rig.clock.calibration import TimeScale
    from rig.protocol import protocol as scene
    from rig.protocol.protocol import Run
    from rig.reasons import Reason
    from rig.records import Drop


@dataclass(frozen=True, slots=True)
class Identified:
    """What was found out about a drop's edges.

    Attributes
    ----------
    scale
        At which.
    unlike
        Why they are not one fall of each chain, by role; empty where they are.
    poor
        Roles of chains of which too few edges are where one fall would put them.
    begun
        The fall, as it was adjusted; `None` where there is none.
    explained
        What else than the protocol would explain edges that are like no fall; `None` if not sought.
    """

    scale: TimeScale
    unlike: Mapping[str, Reason]
    poor: tuple[str, ...] = ()
    begun: Begun | None = None
    explained: tuple[Reason, ...] | None = None


def identified(
    protocol: scene.Protocol,
    run: Run,
    drop: Drop,
    scale: TimeScale,
    components: Components,
    aside: Collection[int] = (),
) -> Identified:
    """Find out which rods a drop's edges are; arguments as in `rig.analysis.drop.DropCase`."""
    window = (-math.inf if drop.fire_tick is None else 0.0, math.inf)
    records = chain_records(protocol, run, drop, scale.hz, aside)
    identification = identify(protocol, records, scale.u, components, window)
    unlike, fit = pattern_faults(identification, protocol.vocabulary), identification.fit
    if unlike or fit is None:
        poor = tuple(role for role, share in identification.shares.items() if share < LEAST)
        return Identified(scale, unlike, poor)
    return Identified(scale, unlike, begun=Begun(fit.model.guesses, fit.matches, fit.x))
