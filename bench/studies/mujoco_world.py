"""Chains in MuJoCo, a third engine behind the same beams, for ``./run bench coverage``.

Rods are free bodies with mass and moments of inertia. Strings are tendons that only pull. Hanging,
beams, rig errors and truths are those of `sim.resolved_lab`; the command line is `sim.edges`'s.
"""

from __future__ import annotations

import cmath
import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from sim import edges, resolved_lab
from sim.resolved import motion
from sim.resolved.fall import AFTER, skip
from sim.resolved.fall import fall as resolved_fall
from sim.resolved.hanging import hang
from sim.resolved.motion import LONGEST, SAMPLE
from sim.resolved.scene import Fall

if TYPE_CHECKING:
    from sim.resolved.motion import World
    from sim.resolved.scene import Bounce, Chain, Numbers

mujoco: Any = import_module("mujoco")  # no dependency of the package

STEP = 2e-5
"""s. Half of it and a quarter change the mean Δz of 8 falls at 40° and 60° by 0.6 to 1.6 mm, where
single falls scatter by 1.2 to 4 mm; twice of it takes 4 mm from the mean at 40°. Two rods that do
not touch each other: the top rod's lead of 2.38 mm becomes 2.44 and 2.41 mm."""
_SOUND = 0.5
"""Longest step in units of 1/ω of the stiffest string."""
_HARD = 'solimp="0.999 0.999 0.001"'
"""A contact's acceleration is its spring's and damper's, but for a thousandth."""
_ROD = """\
<body pos="{}" zaxis="{}"><freejoint/>
 <inertial pos="0 0 0" mass="{:.12g}" diaginertia="{:.12g} {:.12g} {:.12g}"/>
 <geom type="cylinder" size="{:.12g} {:.12g}" contype="0" conaffinity="1"/>
 <geom type="capsule" size="{:.12g} {:.12g}" contype="2" conaffinity="{}" {}/>
 <site name="{}-0" pos="0 0 {:.12g}"/><site name="{}-1" pos="0 0 {:.12g}"/></body>"""


def damping_ratio(restitution: float) -> float:
    """Return the damping ratio of a linear contact without adhesion.

    T. Schwager and T. Pöschel, Granular Matter 9 (2007) 465: the contact ends when its force does.
    """
    low, high = 0.0, 10.0
    for _ in range(60):
        ratio = 0.5 * (low + high)
        root = cmath.sqrt(1.0 - ratio**2)
        left = cmath.exp(-2.0 * ratio / root * cmath.atan(root / ratio)).real
        low, high = (ratio, high) if left > restitution else (low, ratio)
    return low


def _law(stiffness: Any, restitution: float) -> str:
    """Stiffness and damping per effective mass, 1/s² and 1/s, as MuJoCo takes them."""
    damping = 2.0 * damping_ratio(restitution) * math.sqrt(stiffness)
    return f"-{stiffness:.12g} -{damping:.12g}"


def _contact(bounce: Bounce) -> str:
    law = _law((math.pi / bounce.time_s) ** 2, bounce.restitution)
    return f'priority="1" friction="{bounce.friction:g} 0 0" solref="{law}" {_HARD}'


def _words(values: Numbers) -> str:
    return " ".join(f"{value:.15g}" for value in values)


def _string_stiffness(chain: Chain, world: World) -> Numbers:
    """Stiffness of each string over the effective mass of the two ends that it joins, 1/s²."""
    mass = world.bodies.mass
    ease = (1.0 / mass[:-1] + 1.0 / mass[1:]) / chain.rods.end_mass
    return world.strings.stiffness * ease[:, None]


def build(chain: Chain, world: World, step: float) -> Any:
    """Return MuJoCo's model of a chain as its rods are placed now."""
    bodies, ground, touching = world.bodies, world.ground, chain.touching
    rods, strings = [], []
    for k, mass in enumerate(bodies.mass):
        half, radius, across = bodies.half[k], bodies.radius[k], bodies.across[k]
        rods.append(
            _ROD.format(
                _words(bodies.place[k]), _words(bodies.axis[k]), mass, across, across,
                0.5 * mass * radius**2, radius, half, radius, half,
                2 if touching else 0, _contact(touching) if touching else "", k, -half, k, half,
            )
        )  # fmt: skip
    for (k, side), stiffness in np.ndenumerate(_string_stiffness(chain, world)):
        law = _law(stiffness, chain.strings.restitution)
        strings.append(
            f'<spatial limited="true" range="0 {world.strings.rest[k, side]:.15g}" '
            f'solreflimit="{law}" {_HARD.replace("solimp", "solimplimit")}>'
            f'<site site="{k}-{side}"/><site site="{k + 1}-{side}"/></spatial>'
        )
    board = ""
    if chain.board is not None:
        place = np.array(ground.normal) * ground.level
        board = (
            f'<geom type="plane" size="0 0 1" pos="{_words(place)}" '
            f'zaxis="{_words(np.array(ground.normal))}" contype="1" conaffinity="0" '
            f"{_contact(chain.board.bounce)}/>"
        )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step:g}" gravity="0 0 -{chain.gravity:.15g}" cone="elliptic"/>'
        f"<worldbody>{board}{''.join(rods)}</worldbody><tendon>{''.join(strings)}</tendon></mujoco>"
    )


def fall(chain: Chain, longest_step: float = STEP) -> Fall:
    """Let go of a chain in MuJoCo; one that strikes nothing falls in the resolved world."""
    if chain.board is None:
        return resolved_fall(chain)
    world = hang(chain)
    bodies, count = world.bodies, chain.rods.masses.size
    step = min(longest_step, _SOUND / math.sqrt(_string_stiffness(chain, world).max()))
    skipped = skip(chain, world, step)
    motion.drift(bodies, step / 2.0)  # a leapfrog's places are half a step ahead
    model = build(chain, world, step)
    data = mujoco.MjData(model)
    turning = bodies.spin / bodies.across[:, None]
    mujoco.mj_kinematics(model, data)
    frames = data.xmat[1:].reshape(count, 3, 3)
    speeds = data.qvel.reshape(count, 6)
    speeds[:, :3] = bodies.velocity
    speeds[:, 3:] = np.einsum("kij,ki->kj", frames, turning)
    air = data.qfrc_applied.reshape(count, 6)[:, :3]
    touched, height = np.full(count, math.inf), np.full(count, math.nan)
    samples: list[Numbers] = []
    top_speed, begin, n = math.nan, skipped.size * SAMPLE * step, 0
    now = begin
    while now < min(LONGEST, touched[-1] + AFTER):
        if bodies.drag.any():
            speed = np.linalg.norm(speeds[:, :3], axis=1)
            air[:] = -(bodies.mass * bodies.drag * speed)[:, None] * speeds[:, :3]
        before = -float(speeds[-1, 2])
        mujoco.mj_step(model, data)
        now = begin + (n + 0.5) * step  # of places and contacts, which the step began with
        if data.ncon:
            # Geom 0 is the board, then each rod has two.
            for first, second in (data.contact.geom[data.contact.dist < 0.0] + 1) // 2 - 1:
                for rod, other in ((first, second), (second, first)):
                    landed = other < 0 or touched[other] < now
                    if rod >= 0 and landed and touched[rod] == math.inf:
                        touched[rod], height[rod] = now, data.xpos[1 + rod, 2]
                        top_speed = before if rod == count - 1 else top_speed
        if n % SAMPLE == 0:
            axes = data.xmat[1:].reshape(count, 3, 3)[:, :, 2]
            samples.append(np.stack([data.xpos[1:, 2], data.xpos[1:, 0], axes[:, 2] / axes[:, 0]]))
        n += 1
    heights, sideways, slopes = np.stack(samples, axis=1)
    first = chain.start + chain.rods.heights - skipped[:, None]
    nothing, unknown = np.zeros(0), np.full(count, math.nan)
    still = np.zeros_like(first)
    return Fall(
        times=(np.arange(len(first) + len(heights)) * SAMPLE + 0.5) * step,
        heights=np.concatenate([first, heights]),
        sideways=np.concatenate([still, sideways]),
        slopes=np.concatenate([still + np.tan(chain.rods.tilts) / np.cos(chain.rods.yaws), slopes]),
        frames_s=nothing, places=nothing, axes=nothing, touched_s=touched, touched_height=height,
        top_speed=top_speed, pulled=unknown, board_impulse=np.full(3, math.nan), lost={},
        energy=nothing, momentum=nothing,
    )  # fmt: skip


class MujocoLab(resolved_lab.ResolvedLab):
    """The resolved lab with MuJoCo's falls."""

    let_fall = staticmethod(fall)


if __name__ == "__main__":
    edges.main(MujocoLab)
