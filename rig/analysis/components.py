"""How much each kind of nuisance scatters: stated beforehand, or found by a joint fit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rig.protocol.protocol import Priors

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.model.chain import Chain
    from rig.protocol.protocol import Protocol

_DEFAULT = Priors()
SHARPEST = 1e-6
"""Of an edge, m: no rod is round to less, and no beam's edge sharper, whatever is stated."""


@dataclass(frozen=True, slots=True)
class Components:
    """Variance components, all as standard deviations; the defaults are those of `Priors`.

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
    departure
        How far off its chain a rod that passes a beam may be once rods have struck, m: strings
        bounce, rods turn, and none of that is in the equations.
    few
        And how far besides where but few rods still fall: over their number. A joint fit keeps it
        in proportion to `departure`.
    impulse, impulse_floor
        Scatter of single impulses about α: relative to α, and where α is small.
    bounce
        What strings that bounce add to the scatter of the last pull, relative to α. One rod alone
        goes with what its own string does; where M are left it counts by 1/M.
    landed
        By how much rods strike too early to be seen pass: relative to what a drop has beforehand.
    stretch
        Of what strings do to a chain together: relative to the protocol's own.
    gates, rods
        Beam heights and rod places: relative to the protocol's own uncertainties.
    swing
        Of the square of the speed with which chains swing: relative to the protocol's own.
    """

    floor: float = _DEFAULT.edge_floor
    jitter: float = _DEFAULT.jitter
    hang: float = _DEFAULT.hang
    beam: float = _DEFAULT.beam_offset
    departure: float = _DEFAULT.departure
    few: float = _DEFAULT.last_rods
    impulse: float = _DEFAULT.impulses
    impulse_floor: float = _DEFAULT.impulse_floor
    bounce: float = _DEFAULT.last_impulse
    gates: float = 1.0
    rods: float = 1.0
    swing: float = 1.0
    landed: float = 1.0
    stretch: float = 1.0

    def ratios(self, others: Components) -> NDArray[np.float64]:
        """Logarithm of how much larger each of others is, in their order; 0 of what is exact."""
        pairs = ((getattr(self, name), getattr(others, name)) for name in self.__slots__)
        return np.log([max(b / a, np.finfo(float).tiny) if a else 1.0 for a, b in pairs])

    def times(self, ratios: NDArray[np.float64]) -> Components:
        """Return them larger by such ratios."""
        factors = zip(self.__slots__, np.exp(ratios).tolist(), strict=True)
        return Components(**{name: getattr(self, name) * factor for name, factor in factors})

    def departures(self, loose: NDArray[np.float64]) -> NDArray[np.float64]:
        """Variance of how far rods are off their chain, m².

        Parameters
        ----------
        loose
            See `rig.analysis.trajectory.Trajectory.loose`.
        """
        return (loose > 0.0) * self.departure**2 + (self.few * loose) ** 2

    def impulses(self, alpha: float, above: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scatter of each impulse's α, for an α.

        Parameters
        ----------
        above
            Number of rods above the one that strikes; shape ``(rods,)``.
        """
        even = math.hypot(self.impulse * alpha, self.impulse_floor)
        return np.hypot(even, self.bounce * alpha / above)


def above(chain: Chain) -> NDArray[np.float64]:
    """How many times a rod's mass hangs above it, bottom up.

    Of rods that are alike it is their number; at least 1, as for the top rod, whose impact pulls
    nothing.
    """
    masses = np.array(chain.masses)
    heavier: NDArray[np.float64] = (np.cumsum(masses[::-1])[::-1] - masses) / masses
    return np.maximum(heavier, 1.0)


def stated(protocol: Protocol) -> Components:
    """How much everything scatters by a protocol's priors."""
    priors = protocol.priors
    return Components(
        max(priors.edge_floor, SHARPEST),
        priors.jitter,
        priors.hang,
        priors.beam_offset,
        priors.departure,
        priors.last_rods,
        priors.impulses,
        priors.impulse_floor,
        priors.last_impulse,
    )


LEAST_SHARE = 0.01
"""Of what is stated, below which nothing is believed: no rod is round to less than a micrometre, no
stamp better than 20 ns, and a perfect simulation must not make the edges infinitely sure."""
