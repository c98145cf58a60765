"""How the rods of one chain move from step to step: all that is compiled, in one file.

A vector is a triple of floats. Only + − × ÷ and square roots are used, so the bits of a fall are
the same on every machine. A rod is a cylinder to the board, which its ends' rims strike, and a
cylinder with rounded ends to another rod.

A touch's force is k δ (1 + d v/v₀) for an overlap δ that grows at the rate v, with v₀ the greatest
rate of this touch (Hunt and Crossley's form, Gonthier and others' d). It begins and ends at zero,
takes energy and never gives any, and brings points back with one restitution whatever their masses
are and at whatever speed they come. Strings pull by the same law.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from .compiled import inlined, jit

if TYPE_CHECKING:
    from .scene import Numbers

    Vector = tuple[float, float, float]

SAMPLE = 5
"""Steps between two samples."""
FRAME = 100
"""Steps between two frames."""
LONGEST = 5.0
"""A chain whose top rod touches nothing falls at most so long, s."""
SLOWEST = 0.05
"""v₀ is at least this, m/s: what rests must not be damped by an infinite force."""
STICKS_BELOW = 0.02
"""Friction falls to zero below this rate of slip, m/s: what should stick creeps so slowly."""
REACH = 4e-3
"""Gaps of rods up to this are looked after, m: none closes until one looks again."""
_LOOK = 20  # steps between two looks at which rods are near each other
_PARALLEL = 1e-6  # sin² of the angle between rods that are as good as parallel
BOARD, BOARD_FRICTION, RODS, STRINGS, AIR = range(5)
"""Where energy goes: places in `Record.lost`."""
LOSSES = ("board", "board friction", "rods", "strings", "air")
"""Their names."""


class Bodies(NamedTuple):
    """Rods, bottom up: places at half steps, velocities at whole steps of a leapfrog.

    Attributes
    ----------
    place, velocity, axis, spin
        Middle, its velocity, unit vector along the rod, angular momentum; shape (N, 3).
    force, torque
        Last ones.
    foreseen, turning
        Velocity and angular velocity at the half step, as the last forces foretell them.
    mass, radius, half, across, roll, drag, gravity
        kg, m, m, moment of inertia about the middle in kg m², 1/(own axis' moment) − 1/across with
        0 for the former where rods do not roll, κ of the air in 1/m, and m/s²; shape (N,).
    ease
        How many times as easily as a whole rod its end gives way, which can also turn and roll.
    """

    place: Numbers
    velocity: Numbers
    axis: Numbers
    spin: Numbers
    force: Numbers
    torque: Numbers
    foreseen: Numbers
    turning: Numbers
    mass: Numbers
    radius: Numbers
    half: Numbers
    across: Numbers
    roll: Numbers
    drag: Numbers
    gravity: Numbers
    ease: float


class StringPairs(NamedTuple):
    """Two strings in each gap between rods; arrays have shape (N − 1, 2). Stiffness in N/m."""

    rest: Numbers
    stiffness: Numbers
    fastest: Numbers
    damping: float


class Ground(NamedTuple):
    """The board, a plane at `level` along its `normal`; −∞ where there is none.

    `stiffness` has shape (N,), `fastest` (N, 2).
    """

    normal: Vector
    level: float
    friction: float
    damping: float
    stiffness: Numbers
    fastest: Numbers


class Neighbours(NamedTuple):
    """Rods that may touch each other; `near` lists the `number[0]` that are close now."""

    first: Numbers
    second: Numbers
    stiffness: Numbers
    fastest: Numbers
    near: Numbers
    number: Numbers
    friction: float
    damping: float


class Record(NamedTuple):
    """What is noted on the way; see `sim.resolved.scene.Fall`.

    Attributes
    ----------
    touched, height, pulled_before, pulled_after
        Of each rod at its first touch.
    pulled
        Through the strings above each rod until now, N s.
    since
        How long ago each rod's touch began, s; −1 where it touches nothing.
    lost
        Energy lost where, J.
    impulse, now
        Of the board until now, and its force in this step.
    elastic
        Energy in strings and touches now, J, as the one number of an array.
    top
        Speed of the top rod as it strikes, as the one number of an array.
    """

    touched: Numbers
    height: Numbers
    pulled: Numbers
    pulled_before: Numbers
    pulled_after: Numbers
    since: Numbers
    lost: Numbers
    impulse: Numbers
    pushing: Numbers
    elastic: Numbers
    top: Numbers


class World(NamedTuple):
    """A chain and all that acts on it."""

    bodies: Bodies
    strings: StringPairs
    ground: Ground
    neighbours: Neighbours
    record: Record


class Clock(NamedTuple):
    """Time of the first step, length of a step, end, and how long after the top rod struck, s."""

    begin: float
    step: float
    until: float
    after: float


class Pages(NamedTuple):
    """Room for samples, one each `SAMPLE` steps, and for frames, one each `FRAME` steps."""

    heights: Numbers
    sideways: Numbers
    slopes: Numbers
    places: Numbers
    axes: Numbers
    energy: Numbers
    momentum: Numbers


@jit
def _row(table: Numbers, k: int) -> Vector:
    return table[k, 0], table[k, 1], table[k, 2]


@jit
def _plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@jit
def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@jit
def _times(factor: float, a: Vector) -> Vector:
    return factor * a[0], factor * a[1], factor * a[2]


@jit
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@jit
def _keep(table: Numbers, k: int, a: Vector) -> None:
    table[k, 0], table[k, 1], table[k, 2] = a


@jit
def push(
    overlap: float, rate: float, fastest: float, stiffness: float, d: float
) -> tuple[float, float]:
    """Force of a touch, N, and its greatest rate so far.

    Parameters
    ----------
    overlap, rate
        δ > 0 in m, and v in m/s.
    fastest
        What the last call gave for this touch; 0 where there was none.
    stiffness, d
        k in N/m, and `sim.resolved.contact_law.damping`.
    """
    fastest = max(fastest, rate, SLOWEST)
    return stiffness * overlap * max(1.0 + d * rate / fastest, 0.0), fastest


@jit
def _rubbing(
    slip: Vector, force: float, friction: float, ease: float, mass: float, step: float
) -> Vector:
    """Coulomb friction against a slip; one step must not do more than end it."""
    strongest = friction * force
    least = max(STICKS_BELOW, ease * strongest * step / mass)
    return _times(-strongest / max(math.sqrt(_dot(slip, slip)), least), slip)


@jit
def _add(bodies: Bodies, k: int, force: Vector, arm: Vector) -> None:
    """Let a force act on a rod, at an arm from its middle."""
    _keep(bodies.force, k, _plus(_row(bodies.force, k), force))
    _keep(bodies.torque, k, _plus(_row(bodies.torque, k), _cross(arm, force)))


@jit
def _moving(bodies: Bodies, k: int, arm: Vector) -> Vector:
    """Velocity of a point of a rod."""
    return _plus(_row(bodies.foreseen, k), _cross(_row(bodies.turning, k), arm))


@jit
def _touches(record: Record, k: int, overlap: float, rate: float) -> None:
    """Note how long ago a touch began, as its rate says."""
    record.since[k] = max(record.since[k], overlap / max(rate, 1e-3))


@jit
def _kicked(bodies: Bodies, k: int, step: float) -> tuple[Vector, Vector]:
    """Velocity and angular momentum of a rod once the last forces have acted for so long."""
    push = _times(step / bodies.mass[k], _row(bodies.force, k))
    twist = _times(step, _row(bodies.torque, k))
    return _plus(_row(bodies.velocity, k), push), _plus(_row(bodies.spin, k), twist)


@inlined
def drift(bodies: Bodies, step: float) -> None:
    """Move on without forces: the axis of a free symmetric rod turns about its spin."""
    for k in range(bodies.mass.size):
        _keep(bodies.place, k, _plus(_row(bodies.place, k), _times(step, _row(bodies.velocity, k))))
        axis = _row(bodies.axis, k)
        axis = _plus(axis, _times(step / bodies.across[k], _cross(_row(bodies.spin, k), axis)))
        # Newton's step towards 1/√(a·a): a turn of 1 mrad a step leaves 4e-13.
        _keep(bodies.axis, k, _times(1.5 - 0.5 * _dot(axis, axis), axis))


@inlined
def _by_themselves(bodies: Bodies, record: Record, step: float) -> None:
    """Foresee velocities at the half step; then gravity and air alone act."""
    for k in range(bodies.mass.size):
        mass, axis = bodies.mass[k], _row(bodies.axis, k)
        velocity, spin = _kicked(bodies, k, step / 2.0)
        rolling = _times(_dot(spin, axis) * bodies.roll[k], axis)
        _keep(bodies.foreseen, k, velocity)
        _keep(bodies.turning, k, _plus(_times(1.0 / bodies.across[k], spin), rolling))
        force = (0.0, 0.0, -bodies.gravity[k] * mass)
        if bodies.drag[k] > 0.0:
            speed = math.sqrt(_dot(velocity, velocity))
            drag = mass * bodies.drag[k] * speed
            record.lost[AIR] += step * drag * speed * speed
            force = _plus(force, _times(-drag, velocity))
        _keep(bodies.force, k, force)
        _keep(bodies.torque, k, (0.0, 0.0, 0.0))


@inlined
def _pull(bodies: Bodies, strings: StringPairs, record: Record, step: float) -> None:
    """Let strings pull."""
    for k in range(bodies.mass.size - 1):
        for side in range(2):
            sign = 2.0 * side - 1.0
            arm = _times(sign * bodies.half[k], _row(bodies.axis, k))
            above = _times(sign * bodies.half[k + 1], _row(bodies.axis, k + 1))
            gap = _minus(_plus(_row(bodies.place, k + 1), above), _plus(_row(bodies.place, k), arm))
            square, rest = _dot(gap, gap), strings.rest[k, side]
            stretch = math.sqrt(square) - rest if square > rest * rest else 0.0
            if stretch <= 0.0:
                strings.fastest[k, side] = 0.0
                continue
            length = rest + stretch
            rate = _dot(gap, _minus(_moving(bodies, k + 1, above), _moving(bodies, k, arm)))
            rate /= length
            stiffness = strings.stiffness[k, side]
            force, strings.fastest[k, side] = push(
                stretch, rate, strings.fastest[k, side], stiffness, strings.damping
            )
            record.lost[STRINGS] += step * (force - stiffness * stretch) * rate
            record.elastic[0] += 0.5 * stiffness * stretch * stretch
            pull = _times(force / length, gap)
            record.pulled[k] += step * pull[2]
            _add(bodies, k, pull, arm)
            _add(bodies, k + 1, _times(-1.0, pull), above)


@jit
def rim(bodies: Bodies, normal: Vector, k: int) -> Vector:
    """From the lower edge of a rod's end to the end's middle, as a board sees it."""
    axis = _row(bodies.axis, k)
    lean = _dot(normal, axis)
    down = math.sqrt(max(1.0 - lean * lean, 1e-12))
    return _times(bodies.radius[k] / down, _minus(normal, _times(lean, axis)))


@inlined
def _strike(bodies: Bodies, ground: Ground, record: Record, step: float) -> None:
    """Let the board push."""
    normal = ground.normal
    record.pushing[:] = 0.0
    for k in range(bodies.mass.size):
        above = _dot(normal, _row(bodies.place, k)) - ground.level
        lean = abs(_dot(normal, _row(bodies.axis, k)))
        if above > bodies.half[k] * lean + bodies.radius[k]:
            ground.fastest[k, 0] = ground.fastest[k, 1] = 0.0
            continue
        up = rim(bodies, normal, k)
        for side in range(2):
            end = _times((2.0 * side - 1.0) * bodies.half[k], _row(bodies.axis, k))
            arm = _minus(end, up)
            overlap = -above - _dot(normal, arm)
            if overlap <= 0.0:
                ground.fastest[k, side] = 0.0
                continue
            moving = _moving(bodies, k, arm)
            rate = -_dot(normal, moving)
            force, ground.fastest[k, side] = push(
                overlap, rate, ground.fastest[k, side], ground.stiffness[k], ground.damping
            )
            slip = _plus(moving, _times(rate, normal))
            rub = _rubbing(slip, force, ground.friction, bodies.ease, bodies.mass[k], step)
            push_and_rub = _plus(_times(force, normal), rub)
            _add(bodies, k, push_and_rub, arm)
            _touches(record, k, overlap, rate)
            record.lost[BOARD] += step * (force - ground.stiffness[k] * overlap) * rate
            record.lost[BOARD_FRICTION] -= step * _dot(rub, slip)
            record.elastic[0] += 0.5 * ground.stiffness[k] * overlap * overlap
            for c in range(3):
                record.pushing[c] += push_and_rub[c]
                record.impulse[c] += step * push_and_rub[c]


@jit
def closest(bodies: Bodies, first: int, second: int) -> tuple[float, Vector, Vector, Vector]:
    """Overlap of two rods, both arms, and the normal from the other to the one."""
    u, w = _row(bodies.axis, first), _row(bodies.axis, second)
    apart = _minus(_row(bodies.place, first), _row(bodies.place, second))
    half, other_half = bodies.half[first], bodies.half[second]
    b, c, f = _dot(u, w), _dot(u, apart), _dot(w, apart)
    across = 1.0 - b * b
    s = (b * f - c) / across if across > _PARALLEL else 0.0
    s = min(max(s, -half), half)
    t = min(max(b * s + f, -other_half), other_half)
    s = min(max(b * t - c, -half), half)
    arm, other_arm = _times(s, u), _times(t, w)
    between = _plus(apart, _minus(arm, other_arm))
    distance = math.sqrt(max(_dot(between, between), 1e-18))
    normal = _times(1.0 / distance, between)
    radius, other_radius = bodies.radius[first], bodies.radius[second]
    return (
        radius + other_radius - distance,
        _minus(arm, _times(radius, normal)),
        _plus(other_arm, _times(other_radius, normal)),
        normal,
    )


@inlined
def _look(bodies: Bodies, neighbours: Neighbours) -> None:
    """List the rods that are near each other: first by height alone, then by their distance."""
    number = 0
    for p in range(neighbours.first.size):
        first, second = neighbours.first[p], neighbours.second[p]
        tall = bodies.half[first] * abs(bodies.axis[first, 2]) + bodies.radius[first] + REACH
        tall += bodies.half[second] * abs(bodies.axis[second, 2]) + bodies.radius[second] + REACH
        high = abs(bodies.place[first, 2] - bodies.place[second, 2])
        if high < tall and closest(bodies, first, second)[0] > -REACH:
            neighbours.near[number] = p
            number += 1
        else:
            neighbours.fastest[p] = 0.0
    neighbours.number[0] = number


@inlined
def _collide(bodies: Bodies, neighbours: Neighbours, record: Record, step: float) -> None:
    """Let rods push each other."""
    for n in range(neighbours.number[0]):
        p = neighbours.near[n]
        first, second = neighbours.first[p], neighbours.second[p]
        overlap, arm, other_arm, normal = closest(bodies, first, second)
        if overlap <= 0.0:
            neighbours.fastest[p] = 0.0
            continue
        moving = _minus(_moving(bodies, first, arm), _moving(bodies, second, other_arm))
        rate = -_dot(normal, moving)
        stiffness = neighbours.stiffness[p]
        force, neighbours.fastest[p] = push(
            overlap, rate, neighbours.fastest[p], stiffness, neighbours.damping
        )
        slip = _plus(moving, _times(rate, normal))
        lighter = min(bodies.mass[first], bodies.mass[second]) / 2.0
        rub = _rubbing(slip, force, neighbours.friction, bodies.ease, lighter, step)
        push_and_rub = _plus(_times(force, normal), rub)
        _add(bodies, first, push_and_rub, arm)
        _add(bodies, second, _times(-1.0, push_and_rub), other_arm)
        # Two that brush each other on the way down have not landed yet.
        if record.touched[second] < math.inf:
            _touches(record, first, overlap, rate)
        if record.touched[first] < math.inf:
            _touches(record, second, overlap, rate)
        record.lost[RODS] += step * ((force - stiffness * overlap) * rate - _dot(rub, slip))
        record.elastic[0] += 0.5 * stiffness * overlap * overlap


@inlined
def _note(bodies: Bodies, record: Record, now: float, step: float) -> None:
    """Keep what is first."""
    last = bodies.mass.size - 1
    for k in range(last + 1):
        if record.since[k] < 0.0 or record.touched[k] < math.inf:
            continue
        ago = min(record.since[k], step)
        record.touched[k] = now - ago
        record.height[k] = bodies.place[k, 2] - bodies.foreseen[k, 2] * ago
        record.pulled_before[k] = record.pulled[k]
        if k > 0:
            record.pulled_after[k - 1] = record.pulled[k - 1]
        if k == last:
            record.top[0] = -bodies.velocity[k, 2]


@inlined
def act(world: World, now: float, step: float) -> None:
    """Find forces and torques at a half step."""
    bodies, record = world.bodies, world.record
    record.elastic[0] = 0.0
    record.since[:] = -1.0
    _by_themselves(bodies, record, step)
    _pull(bodies, world.strings, record, step)
    _strike(bodies, world.ground, record, step)
    _collide(bodies, world.neighbours, record, step)
    _note(bodies, record, now, step)


@jit
def act_here(world: World, now: float, step: float) -> None:
    """As `act`, with velocities as they are: for integrators that foresee none."""
    world.bodies.force[:] = 0.0
    world.bodies.torque[:] = 0.0
    act(world, now, step)


@inlined
def _frame(world: World, step: float, pages: Pages, n: int) -> None:
    """Keep everything as it is at this half step; momentum is less what the board gave."""
    bodies, record = world.bodies, world.record
    energy = record.elastic[0]
    momentum = (0.0, 0.0, 0.0)
    for k in range(bodies.mass.size):
        mass, axis = bodies.mass[k], _row(bodies.axis, k)
        velocity, spin = _kicked(bodies, k, step / 2.0)
        turning = _dot(spin, spin) / bodies.across[k] + _dot(spin, axis) ** 2 * bodies.roll[k]
        energy += 0.5 * (mass * _dot(velocity, velocity) + turning)
        energy += mass * bodies.gravity[k] * bodies.place[k, 2]
        momentum = _plus(momentum, _times(mass, velocity))
        for c in range(3):
            pages.places[n, c, k], pages.axes[n, c, k] = bodies.place[k, c], axis[c]
    pages.energy[n] = energy
    for c in range(3):
        pages.momentum[n, c] = momentum[c] - record.impulse[c] + step / 2.0 * record.pushing[c]


@inlined
def _over(world: World, clock: Clock, now: float) -> bool:
    """Whether a fall has done what is asked for."""
    if now > min(clock.until, LONGEST):
        return True
    if clock.until < math.inf:
        return False
    bodies, last = world.bodies, world.bodies.mass.size - 1
    if world.ground.level == -math.inf:
        return bool(bodies.place[last, 2] < -2.0 * bodies.half[last])
    return bool(now > world.record.touched[last] + clock.after)


@jit
def advance(world: World, clock: Clock, first: int, pages: Pages) -> int:
    """Go on from a step until the fall is over, or the pages are full; how many steps were done."""
    bodies, step = world.bodies, clock.step
    number, room = bodies.mass.size, pages.energy.size * FRAME
    for n in range(room):
        if n % _LOOK == 0:
            if _over(world, clock, clock.begin + (first + n) * step):
                return n
            _look(bodies, world.neighbours)
        act(world, clock.begin + (first + n + 0.5) * step, step)
        if n % SAMPLE == 0:
            for k in range(number):
                pages.heights[n // SAMPLE, k] = bodies.place[k, 2]
                pages.sideways[n // SAMPLE, k] = bodies.place[k, 0]
                pages.slopes[n // SAMPLE, k] = bodies.axis[k, 2] / bodies.axis[k, 0]
        if n % FRAME == 0:
            _frame(world, step, pages, n // FRAME)
        for k in range(number):
            velocity, spin = _kicked(bodies, k, step)
            _keep(bodies.velocity, k, velocity)
            _keep(bodies.spin, k, spin)
        drift(bodies, step)
    return room
