"""The simulated lab: real chains with their faults, hung, released and seen by real beams."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from rig.errors import InputError
from rig.link.messages import TEST_RUN, unpack_label
from rig.model.chain import Chain
from rig.model.fall import air_legs, hits, kicks
from rig.model.impact import impact_on
from rig.model.surface import Surface
from rig.protocol.contact import contact_level, higher_contacts
from rig.protocol.measurable import check_released
from rig.protocol.protocol import GUESSED
from rig.units import Quantity

from .air import air
from .beam import SeenEdge, Shadow, bounces, receive, string_shadows
from .dials import or_stated
from .path import Path
from .truth import Truth

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rig.protocol.protocol import Gate, Protocol, RodChain, Run, Side

    from .dials import Dials


@dataclass(frozen=True, slots=True)
class Body:
    """A chain as it really is: rods off their places, rods wider than stated."""

    spec: RodChain
    offsets: np.ndarray  # height of each rod's middle above the nominal bottom rod's place, m
    widths: np.ndarray


@dataclass(frozen=True, slots=True)
class Hung:
    """What differs from drop to drop, drawn from the drop's own label.

    Attributes
    ----------
    run, label
        Which drop.
    release_s, skew_s
        When the first chain leaves after fire, and how much later the free one does, s.
    bodies
        The chain on each side that has one.
    hang
        How much too high the impact chain and the free one hang, m.
    rng
        For all else.
    """

    run: Run
    label: int
    bodies: dict[Side, Body]
    release_s: float
    skew_s: float
    hang: tuple[float, float]
    rng: np.random.Generator


class Falls(NamedTuple):
    """What became of the chains of one drop.

    Attributes
    ----------
    shadows
        Of rods, by channel, times in s after fire; beams that no chain passes have none.
    truth
        Fields of the truth, but for those of every drop.
    strikes_s
        When rods strike that may bounce back through the lowest beam, s after fire.
    """

    shadows: dict[int, list[Shadow]]
    truth: dict[str, Any]
    strikes_s: Sequence[float] = ()


class ChainLab:
    """Everything behind the gates, reproducible from one seed.

    What belongs to a chain or to the rig is drawn once; what happens in a drop is drawn from the
    drop's own label, so a drop comes out the same whenever and however often it is asked for.

    Parameters
    ----------
    protocol
        The scene and its plan.
    dials
        Sizes of all disturbances.
    seed
        Chooses the rig, the chains and all drops.
    tell
        Called with the hidden truth of each drop.
    setting
        Which setting of a plan this is, but for the first: chains hang wrongly by another error.

    Attributes
    ----------
    series
        Which drops of the same rig: those of another series are others.
    others
        The same rig in the other settings that the plan varies, by setting.
    made
        Falls that were made ahead, by label; of all settings.

    Raises
    ------
    InputError
        If chains that start with a speed are asked for.
    """

    truth_kind: ClassVar[type[Truth]] = Truth

    def __init__(
        self,
        protocol: Protocol,
        dials: Dials,
        seed: int,
        tell: Callable[[Truth], None] = lambda _: None,
        *setting: str,
    ) -> None:
        check_released(protocol)
        self.others = {}
        for at, scene in [*protocol.settings.items()][1:]:
            height = [f"{scene.drop.value} m"] * (scene.drop != protocol.drop)
            self.others[at] = type(self)(scene, dials, seed, tell, *height)
        self.protocol = protocol
        self.seed = seed
        self.dials = dials = dials.on(protocol, self._share)
        self.tell = tell
        self.series = 0
        self.runs = {run.number: run for run in protocol.runs()}
        self.made: dict[int, Falls] = {}
        self.gates = protocol.gates.gates
        for other in self.others.values():
            other.runs, other.made = self.runs, self.made
        drop, error = protocol.drop, float(self._rng("rig", *setting).normal())
        self.hang_height = drop.value + drop.u * dials.drop_error * error
        self.surface = self._surface()
        self.side = dials.side_sd * float(self._rng("side").normal())
        self.air = air(protocol, dials.drag)
        self.bodies = {name: self._body(spec) for name, spec in protocol.chains.items()}
        self.heights = {
            gate.channel: gate.height
            + dials.datum_sd * self._rng("post", gate.side).normal()
            + dials.gate_sd * self._rng("gate", gate.channel).normal()
            for gate in self.gates
        }
        self.beams = {
            gate.channel: dials.beam_sd * self._rng("beam", gate.channel).normal()
            for gate in self.gates
        }
        self.check()

    def check(self) -> None:
        """See that this world has what the scene needs: the model has it."""

    def _surface(self) -> Surface | None:
        """Draw the surface as it really is; what a dial says of it is exact."""
        stated, dials = self.protocol.surface, self.dials
        if stated is None:
            return None

        def draw(subject: str, of: Quantity, dial: float) -> Quantity:
            off = dials.impact_error * of.u * float(self._rng(subject).normal())
            return Quantity(or_stated(dial, of.value + off))

        if (pile := stated.pile) is not None:
            pile = replace(pile, restitution=draw("pile", pile.restitution, dials.restitution))
        friction = draw("friction", stated.friction, dials.friction)
        return Surface(
            draw("restitution", stated.restitution, dials.restitution),
            Quantity(max(0.0, friction.value)),
            pile,
        )

    def _level(self, run: Run) -> float:
        """How far above the zero of all heights the chain strikes, m."""
        if run.impact is None:
            return 0.0
        return contact_level(self.protocol, run.incline_deg, run.impact).value

    def _share(self, name: str) -> float:
        """Draw how large something is of what is guessed: to a quarter of that, see `GUESSED`."""
        return math.sqrt(GUESSED / self._rng("size", name).chisquare(GUESSED))

    def _rng(self, *subject: object) -> np.random.Generator:
        """Give each thing that is drawn a stream of its own."""
        digest = hashlib.sha256(repr((self.seed, *subject)).encode()).digest()
        return np.random.default_rng(int.from_bytes(digest[:16], "little"))

    def _drop_rng(self, subject: str, label: int, *side: Side) -> np.random.Generator:
        """Give what is drawn anew in each drop a stream of its own."""
        series = (self.series,) if self.series else ()
        return self._rng(subject, *side, *unpack_label(label), *series)

    def _body(self, spec: RodChain) -> Body:
        rng = self._rng("chain", spec.name)
        places = np.array(spec.chain.heights)
        return Body(
            spec,
            places + or_stated(self.dials.rod_sd, spec.position_u) * rng.normal(size=places.size),
            np.array(spec.widths) + or_stated(self.dials.width_sd, spec.width_u) * rng.normal(),
        )

    def _run(self, label: int) -> Run:
        number, _ = unpack_label(label)
        if number not in self.runs:
            raise InputError(
                f"the simulated scene's plan has no run {number}",
                "give sim:// the protocol that is being run",
            )
        return self.runs[number]

    def _lab(self, label: int) -> ChainLab:
        """Return the rig in the setting of a drop's run."""
        return self.others.get(self._run(label).setting, self)

    def rest(self, label: int) -> int:
        """Mask of the beams that the hanging chains block."""
        if is_test(label):
            return 0
        lab = self._lab(label)
        mask, hanging = 0, lab.hanging(self._run(label))
        for gate in lab.gates:
            if (body := hanging.get(gate.side)) is not None:
                middles = lab.hang_height + body.offsets + lab._shift(body, gate)
                if np.any(np.abs(middles - lab.heights[gate.channel]) < body.widths / 2):
                    mask |= 1 << gate.channel
        return mask

    def hanging(self, run: Run) -> dict[Side, Body]:
        """Return the chain on each side that has one."""
        names: dict[Side, str | None] = {"impact": run.impact, "free": run.free}
        return {side: self.bodies[name] for side, name in names.items() if name is not None}

    def drop(self, label: int) -> list[tuple[float, int, bool]]:
        """Let go: every edge in order of time, as (seconds after fire, channel, blocked)."""
        if is_test(label):
            return []
        if (lab := self._lab(label)) is not self:
            return lab.drop(label)
        number, attempt = unpack_label(label)
        hung, dials = self._hung(label), self.dials
        falls, rng = self._fall(hung), hung.rng
        lowest = min((gate.height for gate in self.gates if gate.side == "impact"), default=0.0)
        edges: list[SeenEdge] = []
        for gate in self.gates:
            if gate.channel not in falls.shadows:
                continue
            seen = [*falls.shadows[gate.channel]]
            seen += string_shadows(seen, dials.string, rng)
            if gate.side == "impact" and gate.height == lowest:
                seen += bounces(falls.strikes_s, dials.bounce, rng)
            edges += receive(seen, gate.channel, dials, rng)
        edges.sort(key=lambda edge: edge.time_s)
        self.tell(
            self.truth_kind(
                run=number,
                attempt=attempt,
                incline_deg=hung.run.incline_deg,
                impact_chain=hung.run.impact,
                gravity_m_s2=self.protocol.gravity.value,
                edges=edges,
                **falls.truth,
            )
        )
        return [edge[:-1] for edge in edges]

    def _hung(self, label: int) -> Hung:
        run, dials, rng = self._run(label), self.dials, self._drop_rng("drop", label)
        release = dials.delay + dials.delay_sd * float(rng.normal())
        skew = dials.skew_sd * float(rng.normal())
        # A chain that falls alone has nothing to be late against.
        late = skew if run.impact is not None else 0.0
        impact, free = (dials.hang_sd * rng.normal(size=2)).tolist()
        hang = impact, free + self.side
        return Hung(run, label, self.hanging(run), release, late, hang, rng)

    def make_ahead(self, labels: Sequence[int]) -> None:
        """Make drops before they are asked for: these need no time worth saving."""

    def _fall(self, hung: Hung) -> Falls:
        """Let the chains of a drop fall, by the model."""
        level = self._level(hung.run)
        start = self.hang_height - level
        paths: dict[Side, Path] = {}
        for side, body in hung.bodies.items():
            if side == "impact":
                paths[side] = self._impact_path(body, start + hung.hang[0], hung)
            else:
                kappas = self.air[body.spec.name].on_legs()[:1]
                let_go_s, gravity = hung.release_s + hung.skew_s, self.protocol.gravity.value
                paths[side] = Path(let_go_s, start + hung.hang[1], gravity, kappas=kappas)
        shadows = {
            gate.channel: self._shadows(gate, level, hung.bodies[gate.side], paths[gate.side])
            for gate in self.gates
            if gate.side in paths
        }
        if "impact" not in paths:
            return Falls(shadows, {})
        strikes = [hung.release_s + hit.time_s for hit in paths["impact"].hits]
        return Falls(shadows, self._truth(hung, paths), strikes)

    def _impact_path(self, body: Body, start: float, hung: Hung) -> Path:
        """Compute the fall of the impact chain by the model, with its own rods and impulses."""
        assert self.surface is not None
        dials, chain, incline = self.dials, body.spec.chain, hung.run.incline_deg
        impact = impact_on(self.surface, chain, incline)
        alpha = impact.alpha
        if chain.alpha is not None:
            alpha += dials.impact_error * chain.alpha.u * self._rng("alpha").normal()
        alphas = alpha * (1.0 + dials.impulse_sd * hung.rng.normal(size=chain.rods))
        # What touches the board higher hangs as much lower, as far as its strike goes.
        strikes = body.offsets - np.array(higher_contacts(self.protocol, incline, body.spec))
        strikes[:-1] -= self._contact(hung.run)  # the last one is judged at the level
        bottom = float(strikes[0])
        actual = Chain(chain.masses, tuple((strikes - bottom).tolist()), chain.inertia)
        gains = kicks(actual, alphas.tolist(), impact.gamma)
        gravity = self.protocol.gravity.value
        air = self.air[body.spec.name].on_legs()
        events = hits(actual, gains, start + bottom, gravity, leg=air_legs(air))
        return Path(hung.release_s, start, gravity, events, tuple((-strikes).tolist()), air)

    def _contact(self, run: Run) -> float:
        """How far above the contact level rods touch, m."""
        draw = self._rng("contact", *self.protocol.condition(run)[:2]).normal()
        return self.dials.contact_sd * float(draw)

    def _shift(self, body: Body, gate: Gate) -> np.ndarray:
        """How far each rod's crossing is shifted because the beam is off its middle, m."""
        slope = self.beams[gate.channel] * math.tan(math.radians(body.spec.tilt_deg))
        return slope * (-1.0) ** np.arange(body.widths.size)

    def _shadows(self, gate: Gate, level: float, body: Body, path: Path) -> list[Shadow]:
        """Every rod that darkens one beam."""
        height = self.heights[gate.channel] - level
        middles = body.offsets + self._shift(body, gate)
        return [
            Shadow(
                path.time_at(height - middle + width / 2),
                path.time_at(height - middle - width / 2),
                rod,
            )
            for rod, (middle, width) in enumerate(zip(middles, body.widths, strict=True))
            if path.start + middle >= height  # else it hangs below the beam
        ]

    def _truth(self, hung: Hung, paths: dict[Side, Path]) -> dict[str, Any]:
        """Return what really happened, for the judge of the analysis alone."""
        path = paths["impact"]
        hit = path.hits[-1]
        # The top rod falls on, from where it passes the level or not so far.
        above = self.protocol.contact.strike.value + self._contact(hung.run)
        above += self.dials.strike_sd * float(self._drop_rng("strike", hung.label).normal())
        late, speed_strike = path.last_at(above)
        truth = {
            "speed_m_s": hit.speed_before,
            "fall_time_s": hit.time_s,
            "speed_strike_m_s": speed_strike,
        }
        if "free" not in paths:
            return truth
        free, top = paths["free"], float(hung.bodies["free"].offsets[-1])
        skew, hit_s = free.release_s - path.release_s, path.release_s + hit.time_s
        return truth | {
            "release_skew_s": skew,
            "separation_raw_m": free.height_at(hit_s) + top,
            "separation_m": free.height_at(hit_s + skew) + top,
            "separation_strike_m": free.height_at(hit_s + late + skew) + top - above,
        }


def is_test(label: int) -> bool:
    """Whether the board is only tried out, and nothing hangs."""
    return unpack_label(label)[0] == TEST_RUN
