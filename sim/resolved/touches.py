"""Touches of rods with the board and with each other, on lists of those that are near.

A rod is a cylinder to the board, which its end's rim strikes, and a cylinder with rounded ends to
another rod. Lists hold flat numbers b·N + k of rods; they are made anew every few steps.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sim.resolved.bodies import cross, dot
from sim.resolved.contact_law import damping, push, rubbing

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sim.resolved.bodies import Bodies
    from sim.resolved.scene import Bounce, Chain, Numbers

REACH = 4e-3
"""Gaps up to this are on the list, m: no rod comes so far until the list is made anew."""
_PARALLEL = 1e-6  # sin² of the angle between rods that are as good as parallel


def _stiffness(mass: Numbers, bounce: Bounce) -> Numbers:
    """Of a point at the end of a rod, which weighs a quarter of it when it strikes, N/m."""
    return np.asarray(mass / 4.0 * (math.pi / bounce.time_s) ** 2)


class Loads:
    """Forces and torques about the middles, gathered over all touches; shapes (3, B·N)."""

    def __init__(self, rods: int) -> None:
        self._rods = rods
        self._rows = rods * np.arange(6)[:, None]
        self.force = np.zeros((3, rods))
        self.torque = np.zeros((3, rods))

    def add(self, rods: NDArray[np.intp], force: Numbers, arm: Numbers) -> None:
        """Let forces act on rods, at arms from their middles."""
        both = np.concatenate([force, cross(arm, force)])
        places = (self._rows + rods).ravel()
        total = np.bincount(places, both.ravel(), 6 * self._rods).reshape(2, 3, -1)
        self.force += total[0]
        self.torque += total[1]


class Flat:
    """The rods of all chains in one row, as touches see them at one moment.

    Attributes
    ----------
    place, velocity, axis, turning
        Shape (3, B·N); `turning` is the angular velocity.
    """

    def __init__(self, bodies: Bodies, velocity: Numbers, spin: Numbers) -> None:
        axis = bodies.axis
        turning = spin / bodies.across + dot(spin, axis) * bodies.roll * axis
        self.place = bodies.place.reshape(3, -1)
        self.velocity = velocity.reshape(3, -1)
        self.axis = axis.reshape(3, -1)
        self.turning = turning.reshape(3, -1)

    def moving(self, rods: NDArray[np.intp], arm: Numbers) -> Numbers:
        """Velocity of points of rods, m/s."""
        return self.velocity[:, rods] + cross(self.turning[:, rods], arm)


class BoardTouches:
    """Rims of rods on boards.

    Attributes
    ----------
    lost, rubbed
        Energy lost to restitution and friction, J; shape (B,).
    impulse
        On all rods of a chain, N s; shape (3, B).
    now
        Force of the board on each chain at the last call, N; shape (3, B).
    energy
        Elastic energy in the touches at the last call, J; shape (B,).
    """

    def __init__(self, chains: Sequence[Chain], bodies: Bodies) -> None:
        batch, rods = bodies.mass.shape
        self._rods = rods
        self._radius, self._half = bodies.radius.ravel(), bodies.half.ravel()
        self._mass = bodies.mass.ravel()
        self._normal = np.zeros((3, batch))
        self._level = np.full(batch, -math.inf)
        self._friction, self._damping = np.zeros(batch), np.zeros(batch)
        stiffness = np.zeros((batch, rods))
        for b, chain in enumerate(chains):
            if chain.board is None:
                continue
            angle, bounce = chain.board.incline, chain.board.bounce
            # Of 90° − θ: near a wall all digits of cos θ would be those of π/2 − θ.
            normal = 0.0, math.sin(angle), math.sin(math.pi / 2 - angle)
            self._normal[:, b] = normal
            tilt = float(np.abs(chain.rods.tilts).mean())
            along = math.sin(tilt) * normal[2]
            self._level[b] = -(
                chain.rods.length / 2.0 * abs(along)
                + float(chain.rods.diameters[-1]) / 2.0 * math.sqrt(1.0 - along**2)
            )
            self._friction[b], self._damping[b] = bounce.friction, damping(bounce.restitution)
            stiffness[b] = _stiffness(bodies.mass[b], bounce)
        self._stiffness = stiffness.ravel()
        self._fastest = np.zeros(2 * batch * rods)
        self._listed = np.zeros(0, np.intp)
        self.energy = np.zeros(batch)
        self.lost, self.rubbed = np.zeros(batch), np.zeros(batch)
        self.impulse = np.zeros((3, batch))
        self.now = np.zeros((3, batch))

    def _rims(
        self, place: Numbers, axis: Numbers, rods: NDArray[np.intp], side: Numbers
    ) -> tuple[Numbers, Numbers, Numbers]:
        """Overlap, arm and normal of rims; `side` is −1 or 1."""
        normal = self._normal[:, rods // self._rods]
        axis = axis[:, rods]
        lean = dot(normal, axis)
        down = np.sqrt(np.maximum(1.0 - lean * lean, 1e-12))
        rim = (self._radius[rods] / down) * (normal - lean * axis)
        arm = (side * self._half[rods]) * axis - rim
        level = self._level[rods // self._rods]
        return level - dot(normal, place[:, rods] + arm), arm, normal

    def gaps(self, bodies: Bodies) -> Numbers:
        """How far each rod's lower rim is above its board, m, along the normal; shape (B, N)."""
        rods = np.arange(self._mass.size)
        place, axis = bodies.place.reshape(3, -1), bodies.axis.reshape(3, -1)
        both = [
            self._rims(place, axis, rods, side + np.zeros(rods.size))[0] for side in (-1.0, 1.0)
        ]
        return -np.maximum(*both).reshape(bodies.mass.shape)

    def look(self, bodies: Bodies) -> None:
        """List the rims that are near."""
        gaps = self.gaps(bodies)
        reach = bodies.half * 2.0 * np.abs(dot(self._normal[:, :, None], bodies.axis))
        near = np.flatnonzero((gaps < REACH).ravel())
        both = np.flatnonzero((gaps + reach < REACH).ravel())
        lower = np.where(
            dot(self._normal[:, near // self._rods], bodies.axis.reshape(3, -1)[:, near]) > 0.0,
            0,
            1,
        )
        upper = 1 - np.where(
            dot(self._normal[:, both // self._rods], bodies.axis.reshape(3, -1)[:, both]) > 0.0,
            0,
            1,
        )
        self._listed = np.sort(np.concatenate([2 * near + lower, 2 * both + upper]))
        kept = np.zeros_like(self._fastest)
        kept[self._listed] = self._fastest[self._listed]
        self._fastest = kept

    def act(self, flat: Flat, loads: Loads, since: Numbers, step: float) -> None:
        """Let the board push; `since` (B·N,) gets how long ago each touch began at most, s."""
        listed = self._listed
        self.energy[:] = self.now[:] = 0.0
        if not listed.size:
            return
        rods = listed // 2
        chain = rods // self._rods
        overlap, arm, normal = self._rims(flat.place, flat.axis, rods, 2.0 * (listed % 2) - 1.0)
        moving = flat.moving(rods, arm)
        rate = -dot(normal, moving)
        stiffness = self._stiffness[rods]
        force, fastest = push(overlap, rate, self._fastest[listed], stiffness, self._damping[chain])
        self._fastest[listed] = fastest
        slip = moving + rate * normal
        rub = rubbing(slip, force, self._friction[chain], self._mass[rods], step)
        whole = force * normal + rub
        loads.add(rods, whole, arm)
        note_touches(rods, overlap, rate, since)
        batch = self.lost.size
        elastic = stiffness * np.maximum(overlap, 0.0)
        self.lost += step * np.bincount(chain, (force - elastic) * rate, batch)
        self.rubbed -= step * np.bincount(chain, dot(rub, slip), batch)
        self.energy += np.bincount(chain, 0.5 * elastic * overlap, batch)
        for c in range(3):
            self.now[c] = step * np.bincount(chain, whole[c], batch)
        self.impulse += self.now
        self.now /= step


def note_touches(rods: NDArray[np.intp], overlap: Numbers, rate: Numbers, since: Numbers) -> None:
    """Note for rods that touch how long ago that began, as their rates say, s."""
    now = overlap > 0.0
    ago = overlap[now] / np.maximum(rate[now], 1e-3)
    np.maximum.at(since, rods[now], ago)


class RodTouches:
    """Rods on rods of the same chain.

    Attributes
    ----------
    lost, rubbed
        Energy lost to restitution and friction, J; shape (B,).
    """

    def __init__(self, chains: Sequence[Chain], bodies: Bodies) -> None:
        batch, rods = bodies.mass.shape
        self._rods, self._batch = rods, batch
        self._radius, self._half = bodies.radius.ravel(), bodies.half.ravel()
        self._mass = bodies.mass.ravel()
        lower, upper = np.triu_indices(rods, 1)
        solid = np.array([b for b, chain in enumerate(chains) if chain.touching], dtype=np.intp)
        self._one = (solid[:, None] * rods + lower).ravel()
        self._other = (solid[:, None] * rods + upper).ravel()
        self._fastest = np.zeros(self._one.size)
        self._friction, self._damping = np.zeros(batch), np.zeros(batch)
        self._stiffness = np.zeros(self._one.size)
        if solid.size:
            lighter = (
                self._mass[self._one]
                * self._mass[self._other]
                / (self._mass[self._one] + self._mass[self._other])
            )
            for row, b in enumerate(solid):
                bounce = chains[b].touching
                assert bounce is not None
                self._friction[b], self._damping[b] = bounce.friction, damping(bounce.restitution)
                mine = slice(row * lower.size, (row + 1) * lower.size)
                self._stiffness[mine] = _stiffness(lighter[mine], bounce)
        self._listed = np.zeros(0, np.intp)
        self.energy = np.zeros(batch)
        self.lost, self.rubbed = np.zeros(batch), np.zeros(batch)

    def look(self, bodies: Bodies) -> None:
        """List the pairs that are near: first by height alone, then by their distance."""
        place, axis = bodies.place.reshape(3, -1), bodies.axis.reshape(3, -1)
        tall = self._half * np.abs(axis[2]) + self._radius + REACH
        one, other = self._one, self._other
        near = np.abs(place[2, one] - place[2, other]) < tall[one] + tall[other]
        near &= self._half[one] + self._half[other] > np.abs(place[1, one] - place[1, other])
        listed = np.flatnonzero(near)
        if listed.size:
            overlap = self._closest(place, axis, listed)[0]
            listed = listed[overlap > -REACH]
        kept = np.zeros_like(self._fastest)
        kept[listed] = self._fastest[listed]
        self._fastest, self._listed = kept, listed

    def _closest(
        self, place: Numbers, axis: Numbers, pairs: NDArray[np.intp]
    ) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """Overlap, both arms, and the normal from the other rod to the one."""
        one, other = self._one[pairs], self._other[pairs]
        u, w = axis[:, one], axis[:, other]
        apart = place[:, one] - place[:, other]
        b, c, f = dot(u, w), dot(u, apart), dot(w, apart)
        across = 1.0 - b * b
        s = np.where(across > _PARALLEL, (b * f - c) / np.maximum(across, _PARALLEL), 0.0)
        half, other_half = self._half[one], self._half[other]
        s = np.minimum(np.maximum(s, -half), half)
        t = np.minimum(np.maximum(b * s + f, -other_half), other_half)
        s = np.minimum(np.maximum(b * t - c, -half), half)
        arm, other_arm = s * u, t * w
        between = apart + arm - other_arm
        distance = np.sqrt(np.maximum(dot(between, between), 1e-18))
        normal = between / distance
        radius, other_radius = self._radius[one], self._radius[other]
        overlap = radius + other_radius - distance
        return overlap, arm - radius * normal, other_arm + other_radius * normal, normal

    def act(self, flat: Flat, loads: Loads, since: Numbers, step: float) -> None:
        """Let rods push each other; `since` as for the board."""
        listed = self._listed
        self.energy[:] = 0.0
        if not listed.size:
            return
        one, other = self._one[listed], self._other[listed]
        chain = one // self._rods
        overlap, arm, other_arm, normal = self._closest(flat.place, flat.axis, listed)
        moving = flat.moving(one, arm) - flat.moving(other, other_arm)
        rate = -dot(normal, moving)
        stiffness = self._stiffness[listed]
        force, fastest = push(overlap, rate, self._fastest[listed], stiffness, self._damping[chain])
        self._fastest[listed] = fastest
        slip = moving + rate * normal
        lighter = np.minimum(self._mass[one], self._mass[other]) / 2.0
        rub = rubbing(slip, force, self._friction[chain], lighter, step)
        whole = force * normal + rub
        both = np.concatenate([one, other])
        arms = np.concatenate([arm, other_arm], axis=1)
        loads.add(both, np.concatenate([whole, -whole], axis=1), arms)
        note_touches(both, np.tile(overlap, 2), np.tile(rate, 2), since)
        elastic = stiffness * np.maximum(overlap, 0.0)
        self.lost += step * np.bincount(chain, (force - elastic) * rate, self._batch)
        self.rubbed -= step * np.bincount(chain, dot(rub, slip), self._batch)
        self.energy += np.bincount(chain, 0.5 * elastic * overlap, self._batch)
