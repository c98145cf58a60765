"""The rods of a batch of chains as arrays, and how they move while nothing acts on them.

Arrays are (3, B, N): component, chain of the batch, rod. Only + − × ÷ and square roots are used
on the way, element by element, so a fall is the same to the last bit whatever falls beside it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sim.resolved.scene import Chain, Numbers

_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]


def cross(a: Numbers, b: Numbers) -> Numbers:
    """Vector product along the first axis."""
    return np.asarray(a[_NEXT] * b[_AFTER] - a[_AFTER] * b[_NEXT])


def dot(a: Numbers, b: Numbers) -> Numbers:
    """Scalar product along the first axis."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


class Bodies:
    """Places and velocities at half steps and whole steps of a leapfrog.

    Attributes
    ----------
    place, velocity, axis, spin
        Middle, its velocity, unit vector along the rod, angular momentum; shape (3, B, N).
    mass, radius, half, across, roll
        kg, m, m, moment of inertia about the middle in kg m², and 1/(own axis' moment) − 1/across,
        with 0 for the former where rods do not roll; shape (B, N).
    """

    def __init__(self, chains: Sequence[Chain]) -> None:
        rods = [chain.rods for chain in chains]
        self.mass = np.array([one.masses for one in rods])
        self.radius = np.array([one.diameters for one in rods]) / 2.0
        self.half = np.array([[one.length / 2.0] * one.masses.size for one in rods])
        self.gravity = np.array([[chain.gravity] for chain in chains])
        self.across = self.mass * (self.half**2 / 3.0 + self.radius**2 / 4.0)
        rolls = np.array([[float(one.rolling)] for one in rods])
        self.roll = rolls / (self.mass * self.radius**2 / 2.0) - 1.0 / self.across
        shape = (3, *self.mass.shape)
        tilts = np.array([one.tilts for one in rods])
        yaws = np.array([one.yaws for one in rods])
        self.axis = np.stack(
            [np.cos(tilts) * np.cos(yaws), np.cos(tilts) * np.sin(yaws), np.sin(tilts)]
        )
        self.place = np.zeros(shape)
        self.place[1] = [one.aside for one in rods]
        self.place[2] = [chain.start + chain.rods.heights for chain in chains]
        self.velocity = np.zeros(shape)
        self.spin = np.zeros(shape)
        for b, chain in enumerate(chains):
            if chain.swing is not None:
                self.velocity[1, b] = chain.swing
            turning = np.zeros((3, tilts.shape[1]))
            turning[2] = chain.spin
            along = dot(turning, self.axis[:, b])
            self.spin[:, b] = self.across[b] * (turning - along * self.axis[:, b])

    def drift(self, step: float) -> None:
        """Move on without forces: the axis of a free symmetric rod turns about its spin."""
        self.place += step * self.velocity
        axis = self.axis + step * cross(self.spin / self.across, self.axis)
        self.axis = axis / np.sqrt(dot(axis, axis))

    def kinetic(self, velocity: Numbers, spin: Numbers) -> Numbers:
        """Kinetic energy of each rod, J; shape (B, N)."""
        moving = self.mass * dot(velocity, velocity)
        turning = dot(spin, spin) / self.across
        rolling = dot(spin, self.axis) ** 2 * self.roll
        return 0.5 * np.asarray(moving + turning + rolling)

    def fallen(self, time: Numbers, drag: Numbers) -> tuple[Numbers, Numbers]:
        """Distance and speed of rods that fall from rest by themselves, air included.

        Parameters
        ----------
        time
            s; shape (T, B).
        drag
            κ of v' = g − κv², 1/m; shape (B, 1).

        Returns
        -------
        distance, speed
            m and m/s; shape (T, B).
        """
        kappa, g = drag[:, 0], self.gravity[:, 0]
        still = kappa == 0.0
        rate = np.sqrt(g * np.where(still, 1.0, kappa))
        x = rate * time
        # ln cosh x = ln(1 + 2 sinh²(x/2)): all digits of a short fall.
        slowed = np.log1p(2.0 * np.sinh(x / 2.0) ** 2) / np.where(still, 1.0, kappa)
        speed = np.tanh(x) * g / rate
        return (
            np.where(still, 0.5 * g * time * time, slowed),
            np.where(still, g * time, speed),
        )
