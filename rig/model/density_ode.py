"""A chain of any smooth density by numerical integration of Eq. 1 with Eq. 11.

scipy is half a second to load, and so no prediction imports this.

The independent variable is p of `rig.model.continuum.end`: x = ln(A/(z + γs)) = X p (a p + b).
With V = e √n and e = dx/(X dp), every right-hand side is smooth from p = 0 on, also where the
chain starts from rest on the surface, and the pull enters as pull × (z + γs), which stays moderate
near the end. Δz is integrated from the speed gained, so that it keeps its digits as α → 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.integrate import solve_ivp

from rig.errors import DomainError
from rig.model.continuum import UniformChain, substitution
from rig.model.density import pull

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.model.density import Density

Method = Literal["RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA"]


@dataclass(frozen=True, slots=True)
class OdeEnd:
    """The end of a fall, at the instant the chain's top end reaches the surface.

    Attributes
    ----------
    separation_m
        Δz: how far the freely falling twin is above it.
    speed_m_s
        V at z = 0.
    time_s
        Time since release.
    lay_down_s
        Time since the first strike.
    evaluations
        How often the right-hand side was evaluated.
    steps
        Steps accepted.
    """

    separation_m: float
    speed_m_s: float
    time_s: float
    lay_down_s: float
    evaluations: int
    steps: int


def end(
    density: Density,
    alpha: float,
    gamma: float,
    spacing_m: float,
    drop_m: float,
    gravity: float,
    initial_speed: float = 0.0,
    *,
    method: Method = "DOP853",
    rtol: float = 1e-12,
) -> OdeEnd:
    """Δz, V and t of a fall of a chain of any smooth density.

    Parameters
    ----------
    alpha, gamma, spacing_m, drop_m, gravity, initial_speed
        As in `rig.model.continuum.UniformChain`.
    method
        Any of scipy's.
    rtol
        Relative tolerance of a step; the absolute one is a millionth of it in units in which
        everything is of order one.

    Raises
    ------
    DomainError
        As for `rig.model.continuum.UniformChain`; where γs = 0, so that the end is infinitely
        fast; or where the method fails.
    """
    chain = UniformChain(density.length_m, spacing_m, alpha, gamma, drop_m, gravity, initial_speed)
    if chain.reach_m == 0.0:
        raise DomainError("γs = 0: the end is infinitely fast and x has no end")
    fall = _Fall(chain, density)
    solved = solve_ivp(
        fall.slopes, (0.0, 1.0), fall.start(), method=method, rtol=rtol, atol=1e-6 * rtol
    )
    if not solved.success:
        raise DomainError(f"{method} fails at p = {solved.t[-1]:g}: {solved.message}")
    return fall.ended(solved.y[:, -1], int(solved.nfev), solved.t.size - 1)


class _Fall:
    """The equations in units in which they are of order one.

    State: n = V²/e² in units of V₁² = V_h² + 2gAX; time in AX/V₁; speed gained in αXV₁;
    separation in αAX².
    """

    def __init__(self, chain: UniformChain, density: Density) -> None:
        self.chain = chain
        self.density = density
        self.whole = chain.length_m + chain.reach_m
        self.span = math.log1p(chain.length_m / chain.reach_m)
        self.square, self.line = substitution(chain, self.span)
        squared = chain.strike_speed**2 + 2.0 * chain.gravity * self.whole * self.span
        self.unit = math.sqrt(squared)
        self.weight = 2.0 * chain.gravity * self.whole * self.span / squared

    def start(self) -> NDArray[np.float64]:
        """State at the first strike."""
        if self.line > 0.0:
            n = (self.chain.strike_speed / self.unit / self.line) ** 2
        else:
            n = self.weight / (4.0 * self.square)
        return np.array([n, 0.0, 0.0, 0.0])

    def slopes(self, p: float, state: NDArray[np.float64]) -> list[float]:
        """Derivatives of the state by p."""
        n, _, gained, _ = state.tolist()
        x = self.span * p * (self.square * p + self.line)
        stretch = 2.0 * self.square * p + self.line
        decay = math.exp(-x)
        drag = self.whole * decay * pull(self.density, self._height(x), self.chain.reach_m)
        # Where the chain starts from rest the first term is 0/0 at p = 0, with the limit 0.
        settling = (self.weight * decay - 4.0 * self.square * n) / stretch if stretch else 0.0
        root = math.sqrt(n)
        passing = decay / root
        return [
            settling + 2.0 * self.chain.alpha * self.span * drag * stretch * n,
            passing,
            drag * root * stretch * stretch,
            gained * passing,
        ]

    def ended(self, state: NDArray[np.float64], evaluations: int, steps: int) -> OdeEnd:
        """The end in SI units."""
        n, time, _, separation = state.tolist()
        lay_down = time * self.whole * self.span / self.unit
        return OdeEnd(
            separation * self.chain.alpha * self.whole * self.span**2,
            (2.0 * self.square + self.line) * math.sqrt(n) * self.unit,
            self.chain.drop_time_s + lay_down,
            lay_down,
            evaluations,
            steps,
        )

    def _height(self, x: float) -> float:
        """z, from the end of the chain that is the nearer one for the digits."""
        length, reach = self.chain.length_m, self.chain.reach_m
        if reach < length:
            return max(self.whole * math.exp(-x) - reach, 0.0)
        return max(length + self.whole * math.expm1(-x), 0.0)
