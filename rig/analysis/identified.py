"""Which rods a drop's edges are, found out once, at a round time scale.

The session's clock is known a little better with each further drop; which edge is which rod stays.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.alone import Alone
from rig.analysis.chain_records import chain_records
from rig.analysis.fit import Begun
from rig.analysis.identify import identify
from rig.analysis.pattern import Guess
from rig.analysis.verdict import SUPPORT, pattern_faults
from rig.clock.calibration import TimeScale

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.analysis.components import Components
    from rig.protocol.protocol import Protocol, Run
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
    alone
        What they say by themselves; `None` before they were asked with all that `explained` takes.
    """

    scale: TimeScale
    unlike: Mapping[str, str]
    poor: tuple[str, ...] = ()
    begun: Begun | None = None
    explained: tuple[str, ...] | None = None
    alone: Alone | None = None

    def json(self) -> dict[str, Any]:
        """Return it so that `read` gives the same, to the last bit."""
        found: dict[str, Any] = {
            "scale": [*self.scale],
            "unlike": dict(self.unlike),
            "poor": [*self.poor],
            "explained": None if self.explained is None else [*self.explained],
        }
        if self.begun is not None:
            found["begun"] = {
                "guesses": {role: asdict(one) for role, one in self.begun.guesses.items()},
                "matches": {
                    role: [one.tolist() for one in side]
                    for role, side in self.begun.matches.items()
                },
                "x": self.begun.x.tolist(),
            }
        if self.alone is not None:
            found["alone"] = self.alone.json()
        return found

    @classmethod
    def read(cls, said: Mapping[str, Any]) -> Identified:
        """Take it from what `json` returned."""
        why, begun, alone = said["explained"], None, said.get("alone")
        if "begun" in said:
            kept = said["begun"]
            begun = Begun(
                {role: Guess(**one) for role, one in kept["guesses"].items()},
                {
                    role: [np.array(one, dtype=np.intp) for one in side]
                    for role, side in kept["matches"].items()
                },
                np.array(kept["x"], dtype=np.float64),
            )
        return cls(
            TimeScale(*said["scale"]),
            said["unlike"],
            tuple(said["poor"]),
            begun,
            None if why is None else tuple(why),
            None if alone is None else Alone.read(alone),
        )


def identified(
    protocol: Protocol, run: Run, drop: Drop, scale: TimeScale, components: Components
) -> Identified:
    """Find out which rods a drop's edges are; arguments as in `rig.analysis.drop.fit_drop`."""
    window = (-math.inf if drop.fire_tick is None else 0.0, math.inf)
    records = chain_records(protocol, run, drop, scale.hz)
    found = identify(protocol, records, scale.u, components, window)
    unlike, fit = pattern_faults(found), found.fit
    if unlike or fit is None:
        poor = tuple(role for role, share in found.shares.items() if share < SUPPORT)
        return Identified(scale, unlike, poor)
    return Identified(scale, unlike, begun=Begun(fit.model.guesses, fit.matches, fit.x))
