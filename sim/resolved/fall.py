"""Let a batch of chains fall together: a leapfrog with fixed steps, and what it records."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sim.resolved.bodies import Bodies, cross
from sim.resolved.scene import Fall
from sim.resolved.strings import StringForces
from sim.resolved.touches import BoardTouches, Flat, Loads, RodTouches

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sim.resolved.scene import Chain, Numbers

STEP = 1e-5
"""s; ``rig bench resolved --work`` shows the error that this leaves and what smaller ones cost."""
SAMPLE = 5
"""Steps between two samples."""
FRAME = 100
"""Steps between two frames."""
AFTER = 15e-3
"""How long a fall goes on after the top rod struck, s."""
LONGEST = 5.0
"""A chain whose top rod touches nothing falls at most so long, s."""
_LOOK = 20  # steps between two lists of what is near
_SOUND = 0.5  # of 2, where the leapfrog of the stiffest string would break
_SLIGHT = 2e-6  # m
_EARLY = 1e-3  # m before the first touch at which steps begin


def stable_step(chains: Sequence[Chain]) -> float:
    """The longest step, s, that the stiffest string between the lightest rods bears well."""
    least = math.inf
    for chain in chains:
        bodies = Bodies([chain])
        strings = StringForces([chain], bodies)
        heavy = strings.stiffness[:, 0]
        both = np.zeros((2, chain.rods.masses.size))
        both[:, :-1] += heavy
        both[:, 1:] += heavy
        # A rod's end weighs a quarter of the rod; its two strings pull one against the other.
        fastest = np.sqrt(2.0 * both * 4.0 / chain.rods.masses)
        least = min(least, _SOUND / float(fastest.max()))
    return least


def fall(
    chains: Sequence[Chain],
    *,
    until: float | None = None,
    step: float | None = None,
    after: float = AFTER,
) -> list[Fall]:
    """Let go of chains, all with the same number of rods; they do not see each other.

    Parameters
    ----------
    chains
        As they hang.
    until
        When to end, s; by default `after` the last top rod has touched something, and for chains
        that strike nothing once the top rod is a rod's length below the contact level.
    step
        s; by default `STEP`, or `stable_step` where that is less.

    Returns
    -------
    list of Fall
        One a chain; each the same to the last bit whatever falls beside it at the same step.
    """
    step = min(STEP, stable_step(chains)) if step is None else step
    # By itself, so that no fall takes another way because of what falls beside it.
    formula = [_Falling([chain], step).skippable() for chain in chains]
    found: dict[int, Fall] = {}
    for way in (True, False):
        mine = [b for b, skips in enumerate(formula) if skips is way]
        if mine:
            some = _Falling([chains[b] for b in mine], step).run(until, after, skip=way)
            found |= zip(mine, some, strict=True)
    return [found[b] for b in range(len(chains))]


class _Frame(NamedTuple):
    """One moment of all chains; the momentum is less what the boards gave."""

    at: float
    place: Numbers
    axis: Numbers
    energy: Numbers
    momentum: Numbers


class _Falling:
    def __init__(self, chains: Sequence[Chain], step: float) -> None:
        self.chains, self.step = chains, step
        self.bodies = bodies = Bodies(chains)
        self.strings = StringForces(chains, bodies)
        self.board = BoardTouches(chains, bodies)
        self.rods = RodTouches(chains, bodies)
        batch, rods = bodies.mass.shape
        self.drag = np.array(
            [np.zeros(rods) if chain.drag is None else chain.drag for chain in chains]
        )
        self.begin: Numbers = np.zeros(batch)  # each chain's time at the first step
        self.skipped: Numbers = np.zeros(batch, np.intp)  # samples before that
        self.steps = 0
        self.touched = np.full((batch, rods), math.inf)
        self.height = np.full((batch, rods), math.nan)
        self.top_speed = np.full(batch, math.nan)
        self.turning = np.full(batch, math.nan)
        self.pulled = np.zeros((batch, rods))  # so far, through the strings above each rod
        self.pulled_before = np.zeros((batch, rods))
        self.pulled_after = np.full((batch, rods), math.nan)
        self.air = np.zeros(batch)
        self.slack = np.zeros((2, batch))
        self.force = np.zeros_like(bodies.velocity)
        self.torque = np.zeros_like(bodies.velocity)
        self.samples: list[tuple[Numbers, Numbers, Numbers]] = []
        self.frames: list[_Frame] = []

    def run(self, until: float | None, after: float, *, skip: bool) -> list[Fall]:
        skipped = self._skip() if skip else np.zeros((0, len(self.chains)))
        bodies, half = self.bodies, self.step / 2.0
        bodies.drift(half)
        last = math.inf if until is None else until
        while True:
            if self.steps % _LOOK == 0:
                self.board.look(bodies)
                self.rods.look(bodies)
                now = self.begin + self.steps * self.step
                if now.min() > min(last, LONGEST):
                    break
                if until is None and (now > self._ends(after)).all():
                    break
            self._act()
            if self.steps % SAMPLE == 0:
                slopes = bodies.axis[2] / bodies.axis[0]
                few = bodies.place[0].astype(np.float32), slopes.astype(np.float32)
                self.samples.append((bodies.place[2].copy(), *few))
            if self.steps % FRAME == 0:
                self._frame()
            bodies.velocity += self.step * self.force / bodies.mass
            bodies.spin += self.step * self.torque
            bodies.drift(self.step)
            self.steps += 1
        return [self._fall(b, skipped) for b in range(len(self.chains))]

    def _ends(self, after: float) -> Numbers:
        """When each chain has done what is asked for, s; infinite where not yet."""
        free = np.array([chain.board is None for chain in self.chains])
        top = self.bodies.place[2, :, -1] < -2.0 * self.bodies.half[:, -1]
        return np.where(free, np.where(top, 0.0, math.inf), self.touched[:, -1] + after)

    def skippable(self) -> bool:
        """Whether all rods of a chain fall alike, by a formula, until something touches.

        That is so in the same air, without spin, and with so little swing that it stretches no
        string more than the weight does that it just held.
        """
        if np.any(self.drag != self.drag[:, :1]) or self.bodies.spin.any():
            return False
        _, begin = self._way()
        moved = self.bodies.place + begin[:, None] * self.bodies.velocity
        return bool(self.strings.stretched(moved, self.bodies).max(initial=0.0) <= _SLIGHT)

    def _way(self) -> tuple[Numbers, Numbers]:
        """Moments of samples, shape (T, B), and when each chain is just above what it touches."""
        bodies = self.bodies
        way = np.zeros(len(self.chains))
        gaps = self.board.gaps(bodies).min(axis=1)
        for b, chain in enumerate(self.chains):
            if chain.board is None:
                top = chain.start + float(chain.rods.heights[-1])
                way[b] = top + 2.0 * float(bodies.half[b, -1])
            else:
                down = math.sin(math.pi / 2 - chain.board.incline)
                way[b] = max(0.0, gaps[b] / down - _EARLY) if down > 0.0 else 0.0
        # Samples are SAMPLE steps apart, from half a step after the release.
        grid = SAMPLE * self.step
        longest = 1.5 * math.sqrt(2.0 * float((way / bodies.gravity[:, 0]).max()))
        moments = np.arange(2 + int(longest / grid))[:, None] * grid + np.zeros(way.size)
        skipped = (bodies.fallen(moments, self.drag[:, :1])[0] < way).sum(axis=0)
        return moments, skipped * grid

    def _skip(self) -> Numbers:
        """Fall by formula as far as nothing touches; distances for samples on the way."""
        bodies, kappa = self.bodies, self.drag[:, :1]
        moments, self.begin = self._way()
        self.skipped = np.rint(self.begin / (SAMPLE * self.step)).astype(np.intp)
        bodies.place = bodies.place + self.begin[:, None] * bodies.velocity
        fallen, speed = (one[0][:, None] for one in bodies.fallen(self.begin[None], kappa))
        bodies.place[2] -= fallen
        bodies.velocity[2] -= speed
        self.air += (bodies.mass * (bodies.gravity * fallen - 0.5 * speed**2)).sum(axis=1)
        return bodies.fallen(moments[: self.skipped.max()] + self.step / 2.0, kappa)[0]

    def _act(self) -> None:
        """Forces and torques now, at a half step, with velocities as the last ones foretell."""
        bodies, step = self.bodies, self.step
        velocity = bodies.velocity + (step / 2.0) * self.force / bodies.mass
        spin = bodies.spin + (step / 2.0) * self.torque
        force = np.zeros_like(velocity)
        force[2] = -bodies.gravity * bodies.mass
        torque = np.zeros_like(spin)
        arm = bodies.half * bodies.axis
        sweep = bodies.half * cross(spin / bodies.across, bodies.axis)
        ends = np.stack([bodies.place - arm, bodies.place + arm])
        moving = np.stack([velocity - sweep, velocity + sweep])
        pulls = self.strings.forces(ends, moving, step)
        if pulls is not None:
            force += pulls[0] + pulls[1]
            torque += cross(arm, pulls[1] - pulls[0])
            # What the strings above a rod pull at it is all that those below do not.
            above = np.cumsum((pulls[0] + pulls[1])[2], axis=1)
            self.pulled += step * above
        if self.drag.any():
            speed = np.sqrt(
                velocity[0] * velocity[0] + velocity[1] * velocity[1] + velocity[2] * velocity[2]
            )
            drag = bodies.mass * self.drag * speed
            force -= drag * velocity
            self.air += step * (drag * speed * speed).sum(axis=1)
        flat = Flat(bodies, velocity, spin)
        loads = Loads(bodies.mass.size)
        since = np.full(bodies.mass.size, -1.0)
        self.board.act(flat, loads, since, step)
        self.rods.act(flat, loads, since, step)
        force += loads.force.reshape(force.shape)
        torque += loads.torque.reshape(torque.shape)
        self._note(since.reshape(bodies.mass.shape), velocity)
        self.force, self.torque = force, torque

    def _note(self, since: Numbers, velocity: Numbers) -> None:
        """Keep what is first."""
        falling = np.isfinite(self.touched[:, 0]) & ~np.isfinite(self.touched[:, -1])
        self.slack[0] += falling * (~self.strings.tight).mean(axis=(0, 2))
        self.slack[1] += falling
        new = (since >= 0.0) & ~np.isfinite(self.touched)
        if not new.any():
            return
        bodies = self.bodies
        now = (self.begin + (self.steps + 0.5) * self.step)[:, None]
        ago = np.minimum(since, self.step)
        self.touched = np.where(new, now - ago, self.touched)
        self.height = np.where(new, bodies.place[2] - velocity[2] * ago, self.height)
        self.pulled_before = np.where(new, self.pulled, self.pulled_before)
        after = self.pulled_after[:, :-1]
        after[new[:, 1:]] = self.pulled[:, :-1][new[:, 1:]]
        top = new[:, -1]
        rate = np.sqrt((bodies.spin**2).sum(axis=0)) / bodies.across
        untouched = ~np.isfinite(self.touched) | new
        turning = np.sqrt((rate**2 * untouched).sum(axis=1) / np.maximum(untouched.sum(axis=1), 1))
        self.top_speed = np.where(top, -bodies.velocity[2, :, -1], self.top_speed)
        self.turning = np.where(top, turning, self.turning)

    def _frame(self) -> None:
        """Keep everything as it is at this half step."""
        bodies, half = self.bodies, self.step / 2.0
        velocity = bodies.velocity + half * self.force / bodies.mass
        kinetic = bodies.kinetic(velocity, bodies.spin + half * self.torque).sum(axis=1)
        potential = (bodies.mass * bodies.gravity * bodies.place[2]).sum(axis=1)
        elastic = self.strings.energy() + self.board.energy + self.rods.energy
        self.frames.append(
            _Frame(
                self.steps * self.step,
                bodies.place.astype(np.float32),
                bodies.axis.astype(np.float32),
                kinetic + potential + elastic,
                (bodies.mass * velocity).sum(axis=2) - self.board.impulse + half * self.board.now,
            )
        )

    def _fall(self, b: int, skipped: Numbers) -> Fall:
        """Gather one chain's record."""
        rods = self.chains[b].rods
        count, number = int(self.skipped[b]), rods.masses.size
        before = self.chains[b].start + rods.heights - skipped[:count, b : b + 1]
        still = np.zeros_like(before), before * 0.0 + np.tan(rods.tilts) / np.cos(rods.yaws)
        heights, sideways, slopes = (
            np.concatenate(
                [first, np.reshape([one[part][b] for one in self.samples], (-1, number))]
            )
            for part, first in enumerate((before, *still))
        )
        after = np.where(np.isnan(self.pulled_after[b]), self.pulled[b], self.pulled_after[b])
        pulled = np.where(np.isfinite(self.touched[b]), after - self.pulled_before[b], math.nan)
        lost = {
            "board": float(self.board.lost[b]),
            "board friction": float(self.board.rubbed[b]),
            "rods": float(self.rods.lost[b] + self.rods.rubbed[b]),
            "strings": float(self.strings.lost[b]),
            "air": float(self.air[b]),
        }
        return Fall(
            times=(np.arange(len(heights)) * SAMPLE + 0.5) * self.step,
            heights=heights,
            sideways=sideways,
            slopes=slopes,
            frames_s=np.array([self.begin[b] + one.at + self.step / 2.0 for one in self.frames]),
            places=np.reshape([one.place[:, b] for one in self.frames], (-1, 3, number)),
            axes=np.reshape([one.axis[:, b] for one in self.frames], (-1, 3, number)),
            touched_s=self.touched[b].copy(),
            touched_height=self.height[b].copy(),
            top_speed=float(self.top_speed[b]),
            pulled=pulled,
            board_impulse=self.board.impulse[:, b].copy(),
            lost=lost,
            energy=np.array([one.energy[b] for one in self.frames]),
            momentum=np.reshape([one.momentum[:, b] for one in self.frames], (-1, 3)),
            slack=float(self.slack[0, b] / self.slack[1, b]) if self.slack[1, b] else math.nan,
            turning=float(self.turning[b]),
        )
