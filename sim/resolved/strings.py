"""The strings of a batch of chains: two between neighbours, from end to end, which only pull."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sim.resolved.contact_law import damping, push

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sim.resolved.bodies import Bodies
    from sim.resolved.scene import Chain, Numbers


class StringForces:
    """Shapes are (2, B, N − 1): left and right end, chain, the gap above each rod.

    Attributes
    ----------
    lost
        Energy lost in each chain's strings, J; shape (B,).
    tight
        Which strings pulled at the last call.
    """

    def __init__(self, chains: Sequence[Chain], bodies: Bodies) -> None:
        self._rest = _lengths(bodies.place, bodies)
        along = np.array([[chain.strings.stiffness] for chain in chains])
        self.stiffness = along / self._rest
        self._damping = np.array([[damping(chain.strings.restitution)] for chain in chains])
        self._fastest = np.zeros_like(self._rest)
        self.stretch = np.zeros_like(self._rest)
        self.tight = self.stretch > 0.0
        self.lost = np.zeros(len(chains))

    def stretched(self, place: Numbers, bodies: Bodies) -> Numbers:
        """How much longer than at rest strings are with the rods' middles elsewhere, m."""
        return np.asarray(_lengths(place, bodies) - self._rest)

    def forces(self, ends: Numbers, moving: Numbers, step: float) -> Numbers | None:
        """Force on each end, N; shape (2, 3, B, N), as `ends` in m and `moving` in m/s are."""
        gap = ends[..., 1:] - ends[..., :-1]
        length = np.sqrt(gap[:, 0] * gap[:, 0] + gap[:, 1] * gap[:, 1] + gap[:, 2] * gap[:, 2])
        self.stretch = length - self._rest
        self.tight = self.stretch > 0.0
        if not self.tight.any():
            self._fastest[:] = 0.0
            return None
        apart = moving[..., 1:] - moving[..., :-1]
        rate = gap[:, 0] * apart[:, 0] + gap[:, 1] * apart[:, 1] + gap[:, 2] * apart[:, 2]
        rate /= length
        force, self._fastest = push(
            self.stretch, rate, self._fastest, self.stiffness, self._damping
        )
        elastic = self.stiffness * self.stretch * self.tight
        self.lost += step * ((force - elastic) * rate).sum(axis=(0, 2))
        pull = (force / length)[:, None] * gap
        total = np.zeros_like(ends)
        total[..., :-1] = pull
        total[..., 1:] -= pull
        return total

    def energy(self) -> Numbers:
        """Elastic energy of each chain's strings, J."""
        held = 0.5 * self.stiffness * np.maximum(self.stretch, 0.0) ** 2
        return np.asarray(held.sum(axis=(0, 2)))


def _lengths(place: Numbers, bodies: Bodies) -> Numbers:
    """From end to end of neighbours, m; shape (2, B, N − 1)."""
    sides = np.array([-1.0, 1.0])[:, None, None, None]
    gaps = np.diff(place + sides * bodies.half * bodies.axis, axis=-1)
    return np.asarray(np.sqrt((gaps**2).sum(axis=1)))
