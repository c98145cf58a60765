"""Let a chain fall: by a formula until it touches something, then by a leapfrog in fixed steps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from . import motion
from .hanging import gaps, hang, lengths, stable_step
from .motion import FRAME, SAMPLE, Clock, Pages
from .scene import Fall

if TYPE_CHECKING:
    from .motion import World
    from .scene import Chain, Numbers

STEP = 1e-5
"""s; ``./run bench resolved --work`` shows the error that this leaves and what smaller steps
cost."""
AFTER = 15e-3
"""How long a fall goes on after the top rod struck, s."""
_ROOM = 100  # frames on a set of pages
_SLIGHT = 2e-6  # m
_EARLY = 1e-3  # m before the first touch at which steps begin


def fall(
    chain: Chain, *, until: float | None = None, step: float | None = None, after: float = AFTER
) -> Fall:
    """Let go of a chain.

    Parameters
    ----------
    chain
        As it hangs.
    until
        When to end, s; by default `after` the top rod has touched something, and for a chain that
        strikes nothing once the top rod is a rod's length below the contact level.
    step
        s; by default `usual_step`.
    """
    step = usual_step(chain) if step is None else step
    world = hang(chain)
    skipped = skip(chain, world, step)
    begin = skipped.size * SAMPLE * step
    first = chain.start + chain.rods.heights - skipped[:, None]
    slopes = np.tan(chain.rods.tilts) / np.cos(chain.rods.yaws)
    pages = _turn(world, Clock(begin, step, math.inf if until is None else until, after))
    record = world.record
    heights = np.concatenate([first, pages.heights])
    after_it = np.where(np.isnan(record.pulled_after), record.pulled, record.pulled_after)
    return Fall(
        times=(np.arange(len(heights)) * SAMPLE + 0.5) * step,
        heights=heights,
        sideways=np.concatenate([np.zeros_like(first), pages.sideways]),
        slopes=np.concatenate([np.zeros_like(first) + slopes, pages.slopes]),
        frames_s=begin + (np.arange(len(pages.energy)) * FRAME + 0.5) * step,
        places=pages.places,
        axes=pages.axes,
        touched_s=record.touched,
        touched_height=record.height,
        top_speed=float(record.top[0]),
        pulled=np.where(np.isfinite(record.touched), after_it - record.pulled_before, math.nan),
        board_impulse=record.impulse,
        lost=dict(zip(motion.LOSSES, record.lost.tolist(), strict=True)),
        energy=pages.energy,
        momentum=pages.momentum,
    )


def usual_step(chain: Chain) -> float:
    """`STEP`, or `stable_step` where that is less, s."""
    return min(STEP, stable_step(chain))


def _turn(world: World, clock: Clock) -> Pages:
    """Go on to the end; everything that was kept."""
    motion.drift(world.bodies, clock.step / 2.0)
    number = world.bodies.mass.size
    sets: list[Pages] = []
    steps, done = 0, _ROOM * FRAME
    while done == _ROOM * FRAME:
        pages = _pages(number)
        done = motion.advance(world, clock, steps, pages)
        steps += done
        samples, frames = -(-done // SAMPLE), -(-done // FRAME)
        sets.append(
            Pages(*(part[:samples] for part in pages[:3]), *(part[:frames] for part in pages[3:]))
        )
    return Pages(*(np.concatenate(parts) for parts in zip(*sets, strict=True)))


def _pages(number: int) -> Pages:
    samples, frames = (_ROOM * FRAME // SAMPLE, number), (_ROOM, 3, number)
    sideways, slopes = np.zeros((2, *samples), np.float32)
    places, axes = np.zeros((2, *frames), np.float32)
    return Pages(
        np.zeros(samples), sideways, slopes, places, axes, np.zeros(_ROOM), np.zeros((_ROOM, 3))
    )


def skip(chain: Chain, world: World, step: float) -> Numbers:
    """Fall by formula as far as nothing touches.

    All rods fall alike in the same air, without spin, and with so little swing that it stretches
    no string more than the weight does that it just held.

    Returns
    -------
    ndarray
        How far the chain fell at each sample on the way, m; empty where no formula holds.
    """
    bodies, kappa = world.bodies, float(world.bodies.drag[0])
    if chain.held or np.any(bodies.drag != kappa) or bodies.spin.any():
        return np.zeros(0)
    if chain.board is None:
        reach = chain.start + float(chain.rods.heights[-1]) + 2.0 * float(bodies.half[-1])
    else:
        down = world.ground.normal[2]
        reach = float(gaps(world).min()) / down - _EARLY if down > 0.0 else 0.0
    # Samples are SAMPLE steps apart, from half a step after the release.
    grid = SAMPLE * step
    longest = 1.5 * math.sqrt(2.0 * max(reach, 0.0) / chain.gravity)
    moments = np.arange(2 + int(longest / grid)) * grid
    count = int((fallen(moments, chain.gravity, kappa)[0] < reach).sum())
    begin = count * grid
    moved = bodies.place + begin * bodies.velocity
    if (lengths(moved, bodies) - world.strings.rest).max(initial=0.0) > _SLIGHT:
        return np.zeros(0)
    distance, speed = (float(part) for part in fallen(np.array(begin), chain.gravity, kappa))
    bodies.place[:] = moved
    bodies.place[:, 2] -= distance
    bodies.velocity[:, 2] -= speed
    world.record.lost[motion.AIR] += bodies.mass.sum() * (chain.gravity * distance - speed**2 / 2)
    return fallen(moments[:count] + step / 2.0, chain.gravity, kappa)[0]


def fallen(time: Numbers, gravity: float, kappa: float) -> tuple[Numbers, Numbers]:
    """Distance in m and speed in m/s of what falls from rest in air: v' = g − κv²."""
    if kappa == 0.0:
        return 0.5 * gravity * time * time, gravity * time
    rate = math.sqrt(gravity * kappa)
    # ln cosh x = ln(1 + 2 sinh²(x/2)): all digits of a short fall.
    distance = np.log1p(2.0 * np.sinh(rate * time / 2.0) ** 2) / kappa
    return distance, gravity / rate * np.tanh(rate * time)
