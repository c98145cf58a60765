"""The simulated lab of the resolved world: the same beams and faults, other falls behind them."""

from __future__ import annotations

import logging
import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.errors import InputError
from rig.link.messages import pack_label, unpack_label
from rig.model.chain import XI

from .beam import Shadow
from .camera import camera_reading
from .lab import ChainLab, Falls
from .resolved.compiled import is_compiled
from .resolved.contact_law import DEADEST
from .resolved.fall import fall, usual_step
from .resolved.foresight import MOST_ROD_STEPS, impossible, processor_time, rod_steps
from .resolved.motion import LONGEST
from .resolved.scene import Board, Bounce, Chain, Rods, Strings
from .resolved_beam import shadows
from .truth import ResolvedTruth

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rig.model.surface import Surface
    from rig.protocol.protocol import RodChain, Side

    from .dials import ResolvedDials
    from .lab import Hung
    from .resolved.scene import Fall

log = logging.getLogger(__name__)

MOST_S, TOLD_S = 120.0, 5.0
"""Processor time of a fall that is refused, and of a drop that is told of before it is made, s."""
TRACK_S = 1 / 960
"""Between two moments of the track: half a frame of the paper's camera."""
_LAST = 100  # samples that show how a fall goes on, 5 ms
ROD_LENGTH = 0.102
"""Of the paper's chains, m, where a protocol does not say it."""


_HANGING = "look at length, tilt, drop and incline, and at dials of how chains hang, and drag"
_LONG = (
    "fewer rods, a lower drop, heavier rods (mass, density), softer strings (string_strain) or "
    "longer touches (board_time, rod_time)"
)
_INSTALL = 'with numba it is hundreds of times as fast: pip install "chainrig[resolved]"'


class ResolvedLab(ChainLab):
    """Everything behind the gates, with rods, strings and board resolved in time.

    Drops are made as they are asked for, or many at once by `make_ahead`. Parameters are those of
    `ChainLab`.

    Raises
    ------
    InputError
        Chains of beads, rods whose diameter is unknown, or a drop that cannot be or takes too long.
    """

    dials: ResolvedDials
    truth_kind = ResolvedTruth
    let_fall: Callable[[Chain], Fall] = staticmethod(fall)

    def check(self) -> None:
        """See that this world has what the scene needs; tell of drops that will take long."""
        for spec in self.protocol.chains.values():
            _check(spec)
        if self.surface is not None:
            _bounce(self.surface, self.dials)
        kinds = {run.kind: number for number, run in self.runs.items()}
        chains_by_run = [self._hang_safely(pack_label(number, 1)) for number in kinds.values()]
        longest = max(sum(map(processor_time, chains.values())) for chains in chains_by_run)
        if longest > TOLD_S:
            slow = "" if is_compiled() else f"; numba is not installed, {_INSTALL}"
            log.warning("sim: each drop takes about %.2g s to make%s", longest, slow)

    def make_ahead(self, labels: Sequence[int]) -> None:
        """Make drops on all processors, and wait for them."""

        def make(label: int) -> Falls:
            lab = self._lab(label)
            return lab._fall(lab._hung(label))

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            self.made |= zip(labels, pool.map(make, labels), strict=True)

    def _fall(self, hung: Hung) -> Falls:
        """Let the chains of a drop fall, unless they already have."""
        if hung.label in self.made:
            return self.made[hung.label]
        chains = self._hang_safely(hung.label)
        falls = {side: self.let_fall(chain) for side, chain in chains.items()}
        return Falls(self._resolved_shadows(hung, falls), self._resolved_truth(hung, falls))

    def _hang_safely(self, label: int) -> dict[Side, Chain]:
        """Hang the chains of a drop, and see that they can fall.

        Raises
        ------
        InputError
            Rods that are where others or the board are, a fall that does not end, or a long one.
        """
        chains = self.chains(label)
        number, _ = unpack_label(label)
        for side, chain in chains.items():
            if (why := impossible(chain)) is not None:
                raise InputError(f"dynamics=resolved: run {number}, {side} side: {why}", _HANGING)
            if rod_steps(chain) > MOST_ROD_STEPS or processor_time(chain) > MOST_S:
                raise InputError(
                    f"dynamics=resolved: run {number}, {side} side: a fall of "
                    f"{chain.rods.masses.size} rods would take {processor_time(chain):.2g} s of "
                    f"processor time, in steps of {1e6 * usual_step(chain):.2g} µs",
                    _LONG if is_compiled() else f"{_LONG}; {_INSTALL}",
                )
        return chains

    def chains(self, label: int) -> dict[Side, Chain]:
        """Hang the chains of a drop as they really are."""
        hung = self._hung(label)
        return {side: self._hang(side, hung) for side in hung.bodies}

    def _nominal(self, spec: RodChain) -> Rods:
        diameters, masses = np.array(spec.diameters), np.array(spec.chain.masses)
        length = spec.rod_length or ROD_LENGTH
        if not spec.weighed:
            masses = self.dials.density * math.pi / 4.0 * diameters**2 * length
        zero = np.zeros(diameters.size)
        tilts = (-1.0) ** np.arange(diameters.size) * math.radians(spec.tilt_deg)
        places = np.array(spec.chain.heights), diameters, tilts, zero, zero
        return Rods(masses, *places, length, self.dials.roll > 0.0, spec.chain.inertia / XI)

    def _hang(self, side: Side, hung: Hung) -> Chain:
        """Hang a chain with its rods as they are, and as they hang this time."""
        dials, surface, body = self.dials, self.surface, hung.bodies[side]
        nominal, own = self._nominal(body.spec), self._rng("tilts", body.spec.name)
        draws = self._drop_rng("hung", hung.label, side)
        count = nominal.masses.size
        rods = replace(
            nominal,
            heights=body.offsets,
            tilts=nominal.tilts + math.radians(dials.tilt_sd) * own.normal(size=count),
            yaws=math.radians(dials.yaw_sd) * draws.normal(size=count),
            aside=dials.aside_sd * draws.normal(size=count),
        )
        above = nominal.heights[-1] - nominal.heights
        swing = dials.swing_sd * float(draws.normal()) * above / max(float(above[0]), 1e-9)
        board = touching = None
        if surface is None:
            # Where nothing is struck a fence may hang: it is stiff, strings do not turn it.
            swing = np.zeros_like(swing)
        elif side == "impact":
            board = Board(math.radians(hung.run.incline_deg), _bounce(surface, dials))
            if dials.rods_touch > 0.0:
                touching = Bounce(dials.rod_restitution, dials.rod_time, dials.rod_friction)
        strings = Strings(dials.string_restitution, dials.string_strain)
        too_high = hung.hang[side == "free"] - self._level(hung.run)
        start, gravity = self.hang_height + too_high, self.protocol.gravity.value
        drag = np.array(self.air[body.spec.name].on_rods())
        spin = dials.spin_sd * float(draws.normal())
        return Chain(rods, strings, start, gravity, board, touching, drag, swing, spin)

    def _resolved_shadows(self, hung: Hung, falls: dict[Side, Fall]) -> dict[int, list[Shadow]]:
        """Return what darkens each beam."""
        aside = self._drop_rng("centre", hung.label).normal(size=2) * self.dials.off_centre_sd
        seen: dict[int, list[Shadow]] = {}
        for gate in (gate for gate in self.gates if gate.side in falls):
            is_free, body = gate.side == "free", hung.bodies[gate.side]
            let_go = hung.release_s + (hung.skew_s if is_free else 0.0)
            seen_by = shadows(
                falls[gate.side],
                self.heights[gate.channel] - self._level(hung.run),
                self.beams[gate.channel] + float(aside[int(is_free)]),
                np.array(body.spec.diameters) * body.widths / np.array(body.spec.widths),
                0.5 * self._nominal(body.spec).length,
            )
            seen[gate.channel] = [
                Shadow(let_go + start, let_go + end, rod) for start, end, rod in seen_by
            ]
        return seen

    def _resolved_truth(self, hung: Hung, falls: dict[Side, Fall]) -> dict[str, Any]:
        if "impact" not in falls:
            return {}
        struck, skew = falls["impact"], hung.skew_s
        level_s, level_speed = at_level(struck, self.protocol.gravity.value)
        contact = float(struck.touched_height[-1])
        truth: dict[str, Any] = {
            "speed_m_s": level_speed,
            "fall_time_s": level_s,
            "speed_strike_m_s": struck.top_speed,
            "strike_time_s": struck.strike_s,
            "contact_height_m": contact,
        }
        moments = np.arange(struck.strike_s, 0.0, -TRACK_S)[::-1]
        track = {"times_s": moments, "impact_top_m": top_at(struck, moments)}
        if "free" in falls:
            free = falls["free"]
            track["free_top_m"] = top_at(free, moments)
            level, raw, strike = top_at(free, (level_s, level_s - skew, struck.strike_s)).tolist()
            truth |= {
                "release_skew_s": skew,
                "separation_m": level,
                "separation_raw_m": raw,
                "separation_strike_m": strike - contact,
            }
            truth["camera_separation_m"], truth["camera_speed_m_s"] = camera_reading(
                lambda t: top_at(struck, t),
                lambda t: top_at(free, t - skew),
                struck.strike_s,
                self._drop_rng("camera", hung.label),
            )
        return truth | {"track": {name: values.tolist() for name, values in track.items()}}


def top_at(fall: Fall, times_s: Any) -> Any:
    """Heights of the top rod's middle at times since its release, m.

    A short free chain may be let fall beside a long one that strikes after the short one's end:
    it falls on as it fell last.
    """
    last = np.polyfit(fall.times[-_LAST:], fall.heights[-_LAST:, -1], 2)
    seen = np.interp(times_s, fall.times, fall.heights[:, -1])
    return np.where(fall.times[-1] < times_s, np.polyval(last, times_s), seen)


def at_level(struck: Fall, gravity: float) -> tuple[float, float]:
    """When the top rod's middle passes the contact level, s after release, and how fast, m/s.

    Where the rod strikes before, it falls on as if nothing had been there.

    Raises
    ------
    InputError
        It struck nothing as long as falls go on.
    """
    if not math.isfinite(struck.strike_s):
        raise InputError(
            f"dynamics=resolved: the top rod strikes nothing within {LONGEST:g} s", _HANGING
        )
    contact, speed = float(struck.touched_height[-1]), struck.top_speed
    if contact >= 0.0:
        passing = math.sqrt(speed**2 + 2.0 * gravity * contact)
        return struck.strike_s + 2.0 * contact / (speed + passing), passing
    near = np.argmax(struck.heights[:, -1] < 0.0) + np.array([0, -1])
    times, heights = struck.times[near], struck.heights[near, -1]
    return float(np.interp(0.0, heights, times)), float(np.ptp(heights) / np.ptp(times))


def _bounce(surface: Surface, dials: ResolvedDials) -> Bounce:
    """How the board throws rods back.

    Raises
    ------
    InputError
        A restitution that no contact here has.
    """
    beta = surface.restitution.value
    if not DEADEST <= beta <= 1.0:
        raise InputError(
            f"dynamics=resolved: the board's restitution {beta:g} is not between {DEADEST} and 1",
            "a pile needs none of its own here: rods land on rods",
        )
    return Bounce(beta, dials.board_time, surface.friction.value)


def _check(spec: RodChain) -> None:
    for key in ("alpha", "gamma"):
        if getattr(spec.chain, key) is not None:
            raise InputError(
                f"dynamics=resolved: chains.{spec.name}.{key} is stated, which follows from rods, "
                "strings and board there",
                f"leave {key} out, and describe the rods: diameter, rod_length, tilt, inertia",
            )
    if not spec.diameters or min(spec.diameters) <= 0.0:
        raise InputError(
            f"dynamics=resolved: the diameter of chain {spec.name}'s rods is unknown",
            "add diameter",
        )
