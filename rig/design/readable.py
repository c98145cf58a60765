"""Whether the edges of a layout can be given to rods: beams that tell most must also be read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.pattern import guess, guess_release
from rig.analysis.verdict import LEAD, SUPPORT
from rig.design.cases import perfect, with_beams
from rig.protocol.plan import runs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.protocol.protocol import Protocol
    from rig.protocol.protocol import Side as Role

MARGIN = 0.03
"""Beyond what a verdict asks for: real edges are missed, and flicker."""
_OFF = 2.0  # standard uncertainties that the drop may be off


def margin(protocol: Protocol, beams: Sequence[tuple[Role, float]]) -> float:
    """Share of the expected edges by which the right fall leads the next best one.

    The least over both chains at the outermost inclines, hung higher or lower than stated; less
    what a drop needs not to be void.
    """
    protocol = with_beams(protocol, beams)
    planned, gravity = runs(protocol), protocol.gravity.value
    ends = {run.incline_deg: run for run in reversed(planned)}
    least = 1.0
    for incline in {min(ends), max(ends)}:
        for off in (-_OFF, _OFF):
            for side, _ in perfect(protocol, ends[incline], off * protocol.drop.u):
                found = guess(side, protocol.drop, gravity)
                lead = found.share - found.runner_up
                if side.ratios is not None:
                    # The other chain's fall is found in two steps: when it was let go, then α.
                    pitch = float(np.diff(side.chain.chain.heights).min())
                    first = guess_release(side, protocol.drop, gravity, 0.0, pitch / 6.0)
                    lead = min(lead, first.share - first.runner_up)
                least = min(least, lead - LEAD, found.share - SUPPORT)
    return least


def readable(protocol: Protocol, beams: Sequence[tuple[Role, float]]) -> bool:
    """Whether every edge of a layout finds its rod, with something in hand."""
    return margin(protocol, beams) >= MARGIN
