"""The falling chain of even density as a continuum (section III.D and S IV of the paper).

Eq. 1 with the tension of Eq. 11 has an exact speed, Eq. 14; the time to fall is the quadrature
S15 and the separation follows from it by S16. In terms of

    A = z₀ + γs,   x = ln(A/(z + γs)), which runs from 0 to X = ln(1 + z₀/γs),

Eq. 14 reads ``V² = e^{2αx} [V_h² + 2gA (1 − e^{−(1+2α)x})/(1+2α)]``, a sum of positive terms.

S16 as printed takes Δz as the difference of two heights. Here Δz is the integral over time of
the speed gained from the surface, ``U(x) = α∫V dx``, so that it keeps its relative precision as
α → 0 and as γs/z₀ → ∞, and the limits g → 0 and h → ∞ cost nothing. In S15 V is taken as a speed
and in S16 as a velocity (V(z₀) < 0); with speeds S16 is ``Δz = z₀ − V_h t − ½gt²``.

Where the paper's text and its equations part (25 rods over 1.165 m, h = 0.18 m, 40°):

- "The speed at the end grows logarithmically as s → 0": Eq. 14 gives a power, V ∝ (γs)^−α. It is
  logarithmic, V ≈ V₀ [1 + α ln(z₀/γs) + …], only to first order in α.
- "Eq. 14 reproduces the numerical simulation within 4 %": at ξ = ⅓ it is 5.7 % above the discrete
  model (z = 0 against just before the last impact). A rod's kick is best spread half a spacing to
  either side: Eq. 14 down to z = s/2 and free fall from there is within 0.7 % for every ξ.
- "Eq. 15 reproduces Δz within 4 %": it is 1.8 % low at ξ = ⅓, but 8 % at ξ = 0.05 and 0.9 and
  13 % at 0.01. At ξ = ⅓ two approximations offset each other: h = 0 alone is 8.3 % low. With
  neither, S15 and S16 are 0.6 % low at ξ = ⅓ and 2.2 % at ξ = 0.01.
- "Δz is only 20 % larger for very large initial speeds": for γs ≪ z₀ it is 29 % larger as α → 0
  and 26 % at α = 0.1. The comparison in the text (18 % at α = 0.1) sets S17, which holds to all
  orders in α, against Eq. 15, which is of first order.
"""

import math
from dataclasses import dataclass

import numpy as np

from rig.errors import DomainError
from rig.model.fall import Fall, free_leg
from rig.model.quadrature import gauss
from rig.reasons import rig_error

_FARTHEST = 45.0
"""Largest x of the integrals: beyond are e^−45 of the chain, and 1e-18 of Δz and of t."""


@dataclass(frozen=True, slots=True)
class UniformChain:
    """An evenly dense chain above a surface.

    Attributes
    ----------
    length_m
        z₀, the length of the chain above the surface as it first strikes.
    spacing_m
        s, the distance between rods; it enters only as γs.
    alpha, gamma
        Impact coefficients of Eq. 11.
    drop_m
        h, how far the chain falls before it first strikes.
    gravity
        m/s².
    initial_speed
        Downward speed at release, m/s.

    Raises
    ------
    DomainError
        A number is negative or not finite, the length is 0, or the chain would never move.
    """

    length_m: float
    spacing_m: float
    alpha: float
    gamma: float
    drop_m: float
    gravity: float
    initial_speed: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise DomainError(f"{name} = {value:g}: a finite number not below 0 is wanted")
        if self.length_m == 0.0:
            raise DomainError("length_m = 0: there is no chain")
        if self.gravity == 0.0 and self.initial_speed == 0.0:
            raise rig_error("never_falls")

    @property
    def reach_m(self) -> float:
        """γs: the length of chain over which the pull fades at the end (Eq. 11)."""
        return self.gamma * self.spacing_m

    @property
    def power(self) -> float:
        """1 + 2α of Eq. 14."""
        return 1.0 + 2.0 * self.alpha

    @property
    def pull(self) -> float:
        """2gA of Eq. 14, m²/s²."""
        return 2.0 * self.gravity * (self.length_m + self.reach_m)

    @property
    def strike_speed(self) -> float:
        """V_h, speed as the chain first strikes, m/s."""
        return free_leg(self.drop_m, self.initial_speed, self.gravity)[0]


@dataclass(frozen=True, slots=True)
class ContinuumEnd(Fall):
    """The end of a fall, at the instant the chain's top end reaches the surface.

    Attributes
    ----------
    speed_m_s
        V at z = 0; infinite where γs = 0 and α > 0.
    lay_down_s
        Time since the first strike, t of S15.
    evaluations
        Number of evaluations of the speed.
    """

    lay_down_s: float
    evaluations: int


def end_speed(chain: UniformChain) -> float:
    """Return the speed as the chain's top end reaches the surface, Eq. 14 at z = 0, m/s.

    With any initial speed ``V² = V_h² (A/γs)^2α + 2gγs ((A/γs)^(1+2α) − 1)/(1+2α)``, written as a
    sum of positive terms; infinite where γs = 0 and α > 0.
    """
    ratio = chain.length_m / chain.reach_m if chain.reach_m > 0.0 else math.inf
    power = chain.power
    pulled = chain.pull * math.expm1(-power * math.log1p(ratio)) / power
    try:
        # A power of the ratio itself: its logarithm would be rounded before it is multiplied up.
        grown = math.pow(1.0 + ratio, chain.alpha)
    except OverflowError:
        return math.inf
    return grown * math.sqrt(chain.strike_speed**2 - pulled)


def end(chain: UniformChain, *, nodes: int = 16) -> ContinuumEnd:
    """Return Δz, V and t of a fall by composite Gauss–Legendre quadrature of S15 and S16.

    The substitution x = X p (p + q)/(1 + q) makes x + x₀ the square of p + q/2, x₀ being how far
    before the first strike V² has its zero. V is then smooth in p however small the drop is: it
    starts like p where h = 0 and like a constant where g = 0.

    Parameters
    ----------
    nodes
        Nodes in each panel; 16 for full precision.
    """
    span = _FARTHEST  # X, as far as it matters for Δz and t
    if chain.reach_m > 0.0:
        span = min(math.log1p(chain.length_m / chain.reach_m), span)
    square, line = _substitution(chain, span)
    panels = 1 + math.ceil(math.sqrt(span) + 0.2 * chain.alpha * span)
    rule, half = gauss(nodes), 0.5 / panels
    p = half * (2.0 * np.arange(panels)[:, None] + 1.0 + rule.nodes)
    x = span * p * (square * p + line)
    stretch = half * span * (2.0 * square * p + line)  # dx per unit of the rule
    pulled = chain.pull * np.expm1(-chain.power * x) / chain.power
    v = np.exp(chain.alpha * x) * np.sqrt(chain.strike_speed**2 - pulled)  # Eq. 14
    passing = (chain.length_m + chain.reach_m) * np.exp(-x) / v * stretch
    gaining = v * stretch
    panel_gains = gaining @ rule.weights
    before = np.concatenate(([0.0], np.cumsum(panel_gains[:-1])))
    gained = before[:, None] + gaining @ rule.running.T
    lay_down = float(np.sum(passing @ rule.weights))
    return ContinuumEnd(
        separation_m=chain.alpha * float(np.sum((gained * passing) @ rule.weights)),
        speed_m_s=end_speed(chain),
        time_s=free_leg(chain.drop_m, chain.initial_speed, chain.gravity)[1] + lay_down,
        lay_down_s=lay_down,
        evaluations=v.size,
    )


def _substitution(chain: UniformChain, span: float) -> tuple[float, float]:
    """Return a and b of x = X p (a p + b), that is 1/(1 + q) and q/(1 + q).

    V² is zero at x = −x₀ (x₀ ≈ V_h²/2gA for a small drop), and x + x₀ is to be the square of
    p + q/2 but for a factor: q²/(4(1 + q)) = x₀/X.
    """
    ratio = chain.strike_speed**2 / chain.pull if chain.pull > 0.0 else math.inf
    zero = math.log1p(chain.power * ratio) / chain.power / span
    if math.isinf(zero):
        return 0.0, 1.0
    q = 2.0 * (zero + math.sqrt(zero) * math.sqrt(1.0 + zero))
    return 1.0 / (1.0 + q), q / (1.0 + q)


def separation_leading_order(alpha: float, length_m: float, reach_m: float) -> float:
    """Return Δz from rest on the surface (h = 0) to first order in α, Eq. 15, m.

    With y = 1/√(1 + γs/z₀) the braces of Eq. 15 are ``2 artanh(y)/y + ln(1 − y²)/y² − 1``, which
    cancel as y → 0 and equal ``Σ y^2k/((k + 1)(2k + 1))``, k = 1, 2, …

    Parameters
    ----------
    reach_m
        γs.
    """
    ratio = reach_m / length_m
    if ratio > 1.0:  # y² < ½
        y2, total, power, k = 1.0 / (1.0 + ratio), 0.0, 1.0, 0
        while power > 1e-18 * total:
            k += 1
            power *= y2
            total += power / ((k + 1) * (2 * k + 1))
        return 2.0 * alpha * length_m * total
    c = math.sqrt(1.0 + ratio)
    braces = (c * c + c) * math.log1p(1.0 / c) - 1.0
    if ratio > 0.0:
        braces += c * ratio / (c + 1.0) * math.log(ratio / (c * (c + 1.0)))
    return 2.0 * alpha * length_m * braces
