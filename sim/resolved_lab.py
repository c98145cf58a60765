"""The simulated lab of the resolved world: the same beams and faults, other falls behind them."""

from __future__ import annotations

import logging
import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.errors import InputError
from rig.link.messages import pack_label, unpack_label
from rig.model.chain import XI

from . import fall_cache
from .ahead import Ahead
from .air import stated_air
from .beam import SeenEdge, Shadow, receive, string_shadows
from .camera import camera_reading
from .film import film
from .lab import ChainLab, is_test
from .resolved.compiled import is_compiled
from .resolved.contact_law import DEADEST
from .resolved.fall import fall, usual_step
from .resolved.foresight import MOST_ROD_STEPS, impossible, processor_time, rod_steps
from .resolved.motion import LONGEST
from .resolved.scene import Board, Bounce, Chain, Rods, Strings
from .resolved_beam import shadows
from .truth import Truth

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rig.model.surface import Surface
    from rig.protocol.protocol import Protocol, RodChain, Run, Side

    from .dials import Dials
    from .resolved.scene import Fall
    from .resolved_dials import ResolvedDials

log = logging.getLogger(__name__)

NEXT = 4
"""Runs that are made in the background, from the one on that is being armed."""
MOST_S, TOLD_S = 120.0, 5.0
"""Processor time of a fall that is refused, and of a drop that is told of before it is made, s."""
TRACK_S = 1 / 960
"""Between two moments of the track: half a frame of the paper's camera."""
ROD_LENGTH = 0.102
"""Of the paper's chains, m, where a protocol does not say it."""


@dataclass(slots=True)
class ResolvedTruth(Truth):
    """The truth of a resolved drop.

    Where the top rod strikes before the level, on rods that lie there, at level is when it would
    have passed had it fallen on. Lists are by rod, bottom up: impulses in N s, times in s; energy
    lost in J.
    ``track`` are heights of both top rods until the strike, each counted from its own release;
    ``film`` is told where a session is kept.
    """

    separation_strike_raw_m: float | None = None
    strike_time_s: float | None = None
    contact_height_m: float | None = None
    impulses: list[float] | None = None
    touched_s: list[float] | None = None
    lost: dict[str, float] | None = None
    slack: float | None = None
    turning_rad_s: float | None = None
    track: dict[str, list[float]] | None = None
    film: dict[str, Any] | None = None


_HANGING = "look at length, tilt, drop and incline, and at dials of how chains hang, and drag"
_LONG = (
    "fewer rods, a lower drop, heavier rods (mass, density), softer strings (string_strain) or "
    "longer touches (board_time, rod_time)"
)
_INSTALL = 'pip install "chainrig[resolved]", which is numba'
_SLOW = "sim: each drop takes about %.2g s to make"
_NOT_COMPILED = (
    f"sim: numba is not installed: each drop takes about %.2g s to make, hundreds of times as long "
    f"as with {_INSTALL}"
)


class ResolvedLab(ChainLab):
    """Everything behind the gates, with rods, strings and board resolved in time.

    Parameters are those of `ChainLab`, and

    Parameters
    ----------
    world
        Its materials, and how chains hang.

    Raises
    ------
    InputError
        Chains of beads, rods whose diameter is unknown, or a drop that cannot be or takes too long.
    """

    def __init__(
        self,
        protocol: Protocol,
        dials: Dials,
        seed: int,
        tell: Callable[[Truth], None] = lambda _: None,
        *,
        world: ResolvedDials,
    ) -> None:
        super().__init__(protocol, dials, seed, tell)
        self.world = world
        for spec in protocol.chains.values():
            _check(spec)
        if self.surface is not None:
            _bounce(self.surface, world)
        self._key = fall_cache.key(
            protocol.chains, self.surface, protocol.drop, protocol.gravity, self.gates,
            protocol.plan, protocol.contact, protocol.drag, asdict(dials), world, seed,
        )  # fmt: skip
        self._ahead = Ahead(self._make)
        kinds = {
            (run.incline_deg, run.impact, run.free): number for number, run in self.runs.items()
        }
        chains_by_run = [self._hang_safely(pack_label(number, 1)) for number in kinds.values()]
        longest = max(sum(map(processor_time, chains.values())) for chains in chains_by_run)
        if longest > TOLD_S:
            log.warning(_SLOW if is_compiled() else _NOT_COMPILED, longest)

    def rest(self, label: int) -> int:
        """As of `ChainLab`; the drop that is being armed and the next ones begin to be made."""
        if not is_test(label):
            number, _ = unpack_label(label)
            following = (n for n in range(number + 1, number + NEXT) if n in self.runs)
            self._ahead.begin([label, *(pack_label(n, 1) for n in following)])
        return super().rest(label)

    def make_ahead(self, labels: Sequence[int]) -> None:
        """Make drops on all processors, and wait for them."""
        self._ahead.begin(labels)
        for label in labels:
            self._ahead.get(label)

    def drop(self, label: int) -> list[tuple[float, int, bool]]:
        """Let go: every edge in order of time, as (seconds after fire, channel, blocked)."""
        if is_test(label):
            return []
        parts = self._ahead.get(label)
        run, attempt = self._run(label)
        hung = self._hung(run, attempt)
        rng = hung.rng
        edges: list[SeenEdge] = []
        for gate in self.gates:
            if str(gate.channel) not in parts["shadows"]:
                continue
            let_go = hung.release_s + (hung.skew_s if gate.side == "free" else 0.0)
            seen = [
                Shadow(let_go + start, let_go + end, rod)
                for start, end, rod in parts["shadows"][str(gate.channel)]
            ]
            seen += string_shadows(seen, self.dials.string, rng)
            edges += receive(seen, gate.channel, self.dials, rng)
        edges.sort(key=lambda edge: edge.time_s)
        truth = replace(self._began(ResolvedTruth, run, attempt, edges), **parts["truth"])
        self.tell(truth)
        return [(edge.time_s, edge.channel, edge.blocked) for edge in edges]

    def _make(self, label: int) -> dict[str, Any]:
        """Find a drop on the disk, or let its chains fall."""
        name = fall_cache.key(self._key, self.filmed, self.series, label)
        parts: dict[str, Any] | None = fall_cache.load(name)
        if parts is None:
            chains = self._hang_safely(label)
            falls = {side: fall(chain) for side, chain in chains.items()}
            parts = self._seen(label, falls)
            if self.filmed and "impact" in chains:
                parts["truth"]["film"] = film(chains["impact"], falls["impact"])
            fall_cache.save(name, parts)
        return parts

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
                    _LONG if is_compiled() else f"{_LONG}, or {_INSTALL}",
                )
        return chains

    def chains(self, label: int) -> dict[Side, Chain]:
        """Hang the chains of a drop as they really are."""
        run, attempt = self._run(label)
        hang, level = self._hung(run, attempt).hang, self._level(run)
        chains: dict[Side, Chain] = {}
        sides: tuple[tuple[Side, str | None, float, float | None], ...] = (
            ("impact", run.impact, hang[0], run.incline_deg),
            ("free", run.free, hang[1], None),
        )
        for side, name, too_high, incline_deg in sides:
            if name is not None:
                rods, swing, spin = self._hang(side, name, run, attempt)
                if self.protocol.surface is None:
                    # Where nothing is struck a fence may hang: it is stiff, strings do not turn it.
                    swing = np.zeros_like(swing)
                spec = self.protocol.chains[name]
                chains[side] = self._chain(rods, spec, too_high - level, swing, spin, incline_deg)
        return chains

    def _nominal(self, spec: RodChain) -> Rods:
        diameters = np.array(spec.diameters)
        length = spec.rod_length or ROD_LENGTH
        masses = np.array(spec.chain.masses)
        if not spec.weighed:
            masses = self.world.density * math.pi / 4.0 * diameters**2 * length
        zero = np.zeros(diameters.size)
        signs = (-1.0) ** np.arange(diameters.size)
        return Rods(
            masses, np.array(spec.chain.heights), diameters,
            signs * math.radians(spec.tilt_deg), zero, zero, length, self.world.roll > 0.0,
            spec.chain.inertia / XI,
        )  # fmt: skip

    def _hang(
        self, side: Side, name: str, run: Run, attempt: int
    ) -> tuple[Rods, np.ndarray, float]:
        """Rods as they are and as they hang this time; speed and turning of the chain."""
        world, body = self.world, self.bodies[name]
        nominal = self._nominal(body.spec)
        own = self._rng("tilts", name)
        draws = self._drop_rng("hung", run, attempt, side)
        count = nominal.masses.size
        tilts = nominal.tilts + math.radians(world.tilt_sd) * own.normal(size=count)
        yaws = math.radians(world.yaw_sd) * draws.normal(size=count)
        aside = world.aside_sd * draws.normal(size=count)
        above = nominal.heights[-1] - nominal.heights
        swing = world.swing_sd * float(draws.normal()) * above / max(float(above[0]), 1e-9)
        spin = world.spin_sd * float(draws.normal())
        hung = replace(nominal, heights=body.offsets, tilts=tilts, yaws=yaws, aside=aside)
        return hung, swing, spin

    def _chain(
        self,
        rods: Rods,
        spec: RodChain,
        hang: float,
        swing: np.ndarray,
        spin: float,
        incline_deg: float | None,
    ) -> Chain:
        world, dials, surface = self.world, self.dials, self.surface
        board = touching = None
        if incline_deg is not None and surface is not None:
            board = Board(math.radians(incline_deg), _bounce(surface, world))
            if world.rods_touch > 0.0:
                touching = Bounce(world.rod_restitution, world.rod_time, world.rod_friction)
        # What air takes from a rod goes with its width over its mass; `drag` is the first chain's.
        first = self._nominal(next(iter(self.protocol.chains.values())))
        across, first_across = (of.diameters * of.length for of in (rods, first))
        drag = dials.drag * across / rods.masses * first.masses.sum() / float(first_across.sum())
        drag += stated_air(self.protocol, spec)
        return Chain(
            rods, Strings(world.string_restitution, world.string_strain), self.hang_height + hang,
            self.protocol.gravity.value, board, touching, drag, swing, spin,
        )  # fmt: skip

    def _seen(self, label: int, falls: dict[Side, Fall]) -> dict[str, Any]:
        """Keep of a drop's falls what beams and truth need."""
        run, attempt = self._run(label)
        aside = self._drop_rng("centre", run, attempt).normal(size=2) * self.world.off_centre_sd
        seen: dict[str, list[tuple[float, float, int]]] = {}
        for gate in self.gates:
            if gate.side not in falls:
                continue
            name = run.impact if gate.side == "impact" else run.free
            assert name is not None
            body = self.bodies[name]
            nominal = np.array(body.spec.widths)
            seen_by = shadows(
                falls[gate.side],
                self.heights[gate.channel] - self._level(run),
                self.beams[gate.channel] + float(aside[int(gate.side == "free")]),
                np.array(body.spec.diameters) * body.widths / nominal,
                0.5 * self._nominal(body.spec).length,
            )
            seen[str(gate.channel)] = [(shadow.start, shadow.end, shadow.rod) for shadow in seen_by]
        return {"shadows": seen, "truth": self._resolved_truth(run, attempt, falls)}

    def _resolved_truth(self, run: Run, attempt: int, falls: dict[Side, Fall]) -> dict[str, Any]:
        if "impact" not in falls:
            return {}
        struck = falls["impact"]
        skew = self._hung(run, attempt).skew_s
        level_s, level_speed = at_level(struck, self.protocol.gravity.value)
        contact = float(struck.touched_height[-1])
        truth: dict[str, Any] = {
            "speed_m_s": level_speed,
            "fall_time_s": level_s,
            "speed_strike_m_s": struck.top_speed,
            "strike_time_s": struck.strike_s,
            "contact_height_m": contact,
            "impulses": struck.pulled.tolist(),
            "touched_s": struck.touched_s.tolist(),
            "lost": struck.lost,
            "slack": struck.slack,
            "turning_rad_s": struck.turning,
        }
        moments = np.arange(struck.strike_s, 0.0, -TRACK_S)[::-1]
        truth["track"] = {
            "times_s": moments.tolist(),
            "impact_top_m": top_at(struck, moments).tolist(),
        }
        if "free" not in falls:
            return truth
        free = falls["free"]
        truth["track"]["free_top_m"] = top_at(free, moments).tolist()

        def free_top(time_s: float) -> float:
            return float(top_at(free, time_s))

        truth |= {
            "release_skew_s": skew,
            "separation_m": free_top(level_s),
            "separation_raw_m": free_top(level_s - skew),
            "separation_strike_m": free_top(struck.strike_s) - contact,
            "separation_strike_raw_m": free_top(struck.strike_s - skew) - contact,
        }
        truth["camera_separation_m"], truth["camera_speed_m_s"] = camera_reading(
            lambda t: float(top_at(struck, t)),
            lambda t: free_top(t - skew),
            struck.strike_s,
            self._drop_rng("camera", run, attempt),
        )
        return truth


def top_at(fall: Fall, times_s: Any) -> Any:
    """Heights of the top rod's middle at times since its release, m."""
    return np.interp(times_s, fall.times, fall.heights[:, -1])


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
    after = int(np.argmax(struck.heights[:, -1] < 0.0))
    near = slice(after - 1, after + 1)
    (t0, t1), (z0, z1) = struck.times[near], struck.heights[near, -1]
    return float(t0 + (t1 - t0) * z0 / (z0 - z1)), float((z0 - z1) / (t1 - t0))


def _bounce(surface: Surface, world: ResolvedDials) -> Bounce:
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
    return Bounce(beta, world.board_time, surface.friction.value)


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
