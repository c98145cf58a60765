"""A chain as it hangs, as the arrays that the loops of `sim.resolved.motion` work on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .contact_law import damping
from .motion import AIR, Bodies, Ground, Neighbours, Record, StringPairs, World, rim

if TYPE_CHECKING:
    from .scene import Board, Bounce, Chain, Numbers, Rods

_FIXED = 1e6  # kg: in a second 10 kN move it by 5 mm
_SOUND = 0.5  # of 2, where the leapfrog of the stiffest string would break
_TOUCH = 10  # steps in the shortest touch: with three, touches give energy


def hang(chain: Chain) -> World:
    """Hang a chain, at the moment of its release."""
    bodies = _bodies(chain)
    return World(
        bodies,
        _strings(chain, bodies),
        _ground(chain, bodies),
        _neighbours(chain, bodies),
        _record(chain),
    )


def stable_step(chain: Chain) -> float:
    """The longest step, s, that touches and the stiffest string between the lightest rods bear."""
    bodies = _bodies(chain)
    stiffness = _strings(chain, bodies).stiffness.T
    both = np.zeros((2, bodies.mass.size))
    both[:, :-1] += stiffness
    both[:, 1:] += stiffness
    # A rod's end weighs a share of the rod; its two strings pull one against the other.
    fastest = np.sqrt(2.0 * both / chain.rods.end_mass / bodies.mass).max()
    strings = _SOUND / float(fastest) if fastest else math.inf
    bounces = chain.board.bounce if chain.board else None, chain.touching
    return min([strings, *(bounce.time_s / _TOUCH for bounce in bounces if bounce is not None)])


def gaps(world: World) -> Numbers:
    """How far each rod's lower rim is above the board, m, along the normal; infinite without one.

    Returns
    -------
    ndarray
        Shape (N,).
    """
    bodies, ground = world.bodies, world.ground
    normal = np.array(ground.normal)
    edges = bodies.place - np.array(
        [rim(bodies, ground.normal, k) for k in range(bodies.mass.size)]
    )
    return np.asarray(edges @ normal - np.abs(bodies.axis @ normal) * bodies.half - ground.level)


def lengths(place: Numbers, bodies: Bodies) -> Numbers:
    """Both distances from end to end of neighbours, m; shape (N − 1, 2)."""
    arms = bodies.half[:, None] * bodies.axis
    return np.stack(
        [np.linalg.norm(np.diff(place + side * arms, axis=0), axis=1) for side in (-1.0, 1.0)],
        axis=1,
    )


def _bodies(chain: Chain) -> Bodies:
    rods = chain.rods
    mass, radius = np.array(rods.masses, float), np.array(rods.diameters, float) / 2.0
    gravity = np.full(mass.size, chain.gravity)
    mass[: chain.held], gravity[: chain.held] = _FIXED, 0.0
    half = np.full(mass.size, rods.length / 2.0)
    across = mass * (half**2 * (12.0 * rods.inertia) / 3.0 + radius**2 / 4.0)
    level = np.cos(rods.tilts)
    axis = np.stack([level * np.cos(rods.yaws), level * np.sin(rods.yaws), np.sin(rods.tilts)], 1)
    place, velocity, turning, force, torque, foreseen, turns = np.zeros((7, mass.size, 3))
    place[:, 1] = rods.aside
    place[:, 2] = chain.start + rods.heights
    if chain.swing is not None:
        velocity[:, 1] = chain.swing
    turning[:, 2] = chain.spin
    along = (turning * axis).sum(1, keepdims=True)
    spin = across[:, None] * (turning - along * axis)
    motion = place, velocity, axis, spin, force, torque, foreseen, turns
    roll = float(rods.rolling) / (mass * radius**2 / 2.0) - 1.0 / across
    drag = np.zeros(mass.size) if chain.drag is None else np.array(chain.drag, float)
    ease = 2.0 + 1.0 / rods.end_mass
    return Bodies(*motion, mass, radius, half, across, roll, drag, gravity, ease)


def _strings(chain: Chain, bodies: Bodies) -> StringPairs:
    rest = lengths(bodies.place, bodies)
    d = damping(chain.strings.restitution)
    return StringPairs(rest, chain.strings.stiffness / rest, np.zeros_like(rest), d)


def _stiffness(rods: Rods, mass: Numbers, bounce: Bounce) -> Numbers:
    """Of what an end of a rod of so much mass strikes, N/m."""
    return np.asarray(rods.end_mass * mass * (math.pi / bounce.time_s) ** 2)


def _ground(chain: Chain, bodies: Bodies) -> Ground:
    count = bodies.mass.size
    if chain.board is None:
        return Ground((0.0, 0.0, 1.0), -math.inf, 0.0, 0.0, np.zeros(count), np.zeros((count, 2)))
    bounce, level = chain.board.bounce, -_contact(chain, chain.board)
    losses = bounce.friction, damping(bounce.restitution)
    stiffness = _stiffness(chain.rods, bodies.mass, bounce)
    return Ground(_normal(chain.board), level, *losses, stiffness, np.zeros((count, 2)))


def _normal(board: Board) -> tuple[float, float, float]:
    # Of 90° − θ: near a wall all digits of cos θ would be those of π/2 − θ.
    return 0.0, math.sin(board.incline), math.sin(math.pi / 2 - board.incline)


def _contact(chain: Chain, board: Board) -> float:
    """How far from the board, along its normal, an undisturbed rod's middle is as it touches, m."""
    rods = chain.rods
    along = math.sin(float(np.abs(rods.tilts).mean())) * _normal(board)[2]
    radius = float(rods.diameters[-1]) / 2.0
    return rods.length / 2.0 * abs(along) + radius * math.sqrt(1.0 - along**2)


def _neighbours(chain: Chain, bodies: Bodies) -> Neighbours:
    count = bodies.mass.size if chain.touching is not None else 0
    first, second = np.triu_indices(count, 1)
    both = bodies.mass[first] * bodies.mass[second] / (bodies.mass[first] + bodies.mass[second])
    rest = np.zeros(first.size), np.zeros(first.size, np.intp), np.zeros(1, np.intp)
    if chain.touching is None:
        return Neighbours(first, second, both, *rest, 0.0, 0.0)
    bounce = chain.touching
    stiffness = _stiffness(chain.rods, both, bounce)
    return Neighbours(first, second, stiffness, *rest, bounce.friction, damping(bounce.restitution))


def _record(chain: Chain) -> Record:
    count = chain.rods.masses.size
    touched = np.full(count, math.inf)
    height, after = np.full((2, count), math.nan)
    pulled, before, since = np.zeros((3, count))
    whole = np.zeros(AIR + 1), np.zeros(3), np.zeros(3), np.zeros(1), np.full(1, math.nan)
    return Record(touched, height, pulled, before, after, since, *whole)
