"""Variance components of the nuisance parameters: stated, or estimated by a joint fit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rig.arrays import Array
from rig.model.chain import Chain
from rig.protocol.protocol import Priors, Protocol

_DEFAULT = Priors()
ANY_ALPHA = (-0.10, 0.60)
"""Range of the impact coefficient: energy allows 0 to ½, with a margin at both ends."""
ALPHA_SD = float(np.ptp(ANY_ALPHA)) / math.sqrt(12.0)
"""Standard deviation of a uniform distribution over this range."""
SHARPEST = 1e-6
"""Least scatter of an edge, m: no rod is rounder and no beam sharper, whatever is stated."""


@dataclass(frozen=True, slots=True)
class Components:
    """Variance components, all as standard deviations; the defaults are those of `Priors`.

    Attributes
    ----------
    floor
        Unmodelled scatter of an edge (a rod not quite round), m.
    jitter
        Scatter of a time stamp, s.
    hang
        Scatter of a chain's start height from run to run, m.
    beam
        Sideways offset of a beam from a rod's middle, m; times tan(tilt) it shifts edges.
    departure
        Departure of a rod from its chain once rods have struck, m: strings bounce and rods turn,
        which the equations leave out.
    few
        Further departure, divided by the number of rods still falling, m. A joint fit keeps it in
        proportion to `departure`.
    impulse, impulse_floor
        Scatter of single impulses about α: relative to α, and a floor for small α.
    bounce
        Scatter of the last pull by bouncing strings, relative to α; divided by the number of rods
        above.
    landed
        Scatter of edges of rods that may have struck before, relative to its prior.
    stretch
        Stretch of a chain by its strings, relative to the protocol's prior.
    gates, rods
        Beam heights and rod places, relative to the protocol's uncertainties.
    swing
        Squared speed of a chain's swing, relative to the protocol's prior.
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

    def ratios(self, others: Components) -> Array:
        """Return the log ratio of each component in `others` to this one; 0 for exact ones."""
        pairs = ((getattr(self, name), getattr(others, name)) for name in self.__slots__)
        return np.log([max(b / a, np.finfo(float).tiny) if a else 1.0 for a, b in pairs])

    def times(self, ratios: Array) -> Components:
        """Return the components multiplied by the exponentials of `ratios`."""
        factors = zip(self.__slots__, np.exp(ratios).tolist(), strict=True)
        return Components(**{name: getattr(self, name) * factor for name, factor in factors})

    def departures(self, loose: Array) -> Array:
        """Return the variance of rods' departures from their chain, m².

        Parameters
        ----------
        loose
            See `rig.analysis.trajectory.Trajectory.loose`.
        """
        return (loose > 0.0) * self.departure**2 + (self.few * loose) ** 2

    def impulses(self, alpha: float, above: Array) -> Array:
        """Return the standard deviation of each impulse's α, for a mean α.

        No impulse scatters by more than the range of α.

        Parameters
        ----------
        above
            Number of rods above the striking rod; shape ``(rods,)``.
        """
        even = math.hypot(self.impulse * alpha, self.impulse_floor)
        return np.minimum(np.hypot(even, self.bounce * alpha / above), ALPHA_SD)


def above(chain: Chain) -> Array:
    """Return the mass above each rod in units of its own, bottom up; at least 1.

    For equal rods this is their number. The top rod, which pulls nothing, has 1.
    """
    masses = np.array(chain.masses)
    heavier: Array = (np.cumsum(masses[::-1])[::-1] - masses) / masses
    return np.maximum(heavier, 1.0)


def priors(protocol: Protocol) -> Components:
    """Return the variance components of a protocol's priors."""
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
"""Lower bound of a component as a share of the stated value: no rod is round to less than a
micrometre, no stamp better than 20 ns, and a perfect simulation must not give zero scatter."""
