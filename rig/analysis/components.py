"""How much each kind of nuisance scatters: stated beforehand, or found by a joint fit."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Components:
    """Variance components, all as standard deviations; the defaults are what is stated.

    Attributes
    ----------
    floor
        What an edge may be off for reasons not in the equations (a rod not quite round), m.
    jitter
        Scatter of one time stamp, s.
    hang
        Scatter of where a chain hangs from run to run, m.
    beam
        How far off a rod's middle a beam may run, m; times tan(tilt) it shifts edges rod by rod.
    impulse, impulse_floor
        Scatter of single impulses about α: relative to α, and where α is small.
    gates, rods
        Beam heights and rod places: relative to the protocol's own uncertainties.
    """

    floor: float = 0.1e-3
    jitter: float = 2e-6
    hang: float = 0.3e-3
    beam: float = 1.0e-3
    impulse: float = 0.05
    impulse_floor: float = 0.003
    gates: float = 1.0
    rods: float = 1.0

    def impulses(self, alpha: float) -> float:
        """Scatter of one impulse's α, for an α."""
        return math.hypot(self.impulse * alpha, self.impulse_floor)


STATED = Components()
LEAST_SHARE = 0.01
"""Of what is stated, below which nothing is believed: no rod is round to less than a micrometre, no
stamp better than 20 ns, and a perfect simulation must not make the edges infinitely sure."""
