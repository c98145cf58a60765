"""Does U hold the true value? Rigs drawn by a Latin hypercube, each in one of three worlds.

A rig is gates, chains, an incline, drops and dials of its world, and is off by as much as its
protocol states. Rigs are independent of each other; drops on one rig share its errors.
"""

from __future__ import annotations

import json
import math
import time
from collections import Counter
from dataclasses import dataclass, field
from itertools import islice
from operator import attrgetter
from pathlib import Path
from statistics import fmean
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import yaml

from bench.studies.accuracy import Errors
from rig.analysis.gravity import check_gravity
from rig.analysis.result import GOOD, Measured
from rig.analysis.session import analyze
from rig.bench.falls import Asked, falls, time_scale, with_setting
from rig.errors import InputError
from rig.estimate.session import estimate
from rig.protocol import reader
from rig.protocol.plan import runs as planned
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rig.analysis.session import Analysis
    from rig.bench.falls import SimulatedDrop

SHIPPED = (
    "inclined-uniform.yaml",
    "inclined-uniform-uno.yaml",
    "graded-chain.yaml",
    "graded-chain-uno.yaml",
)
"""Protocols of two chains with gates; the first is the scene of drawn heights."""
GATES = ((1, 1), (1, 3), (2, 2), (3, 5), (4, 4), (5, 5), (8, 8))
"""Gates of the impact side and of the free side, at drawn heights."""
DROPS = (1, 4, 12)
RODS = (16, 36)
LAYOUTS = (*(f"{one} + {other}" for one, other in GATES), *(Path(one).stem for one in SHIPPED))
INCLINES = {"model": (0.0, 80.0), "resolved": (35.0, 80.0), "mujoco": (35.0, 80.0)}
"""°; below some 30° real rods land on a pile, which the model describes by a coefficient."""
COEFFICIENTS = "coefficients"
"""The model's world, one drop at each of nine inclines: are β and μ within their U?"""
WORLDS = (*INCLINES, COEFFICIENTS)
DIALS = {
    "drag": (0.0, 0.03, ""),
    "string_restitution": (0.1, 0.7, ""),
    "string_strain": (2.0, 8.0, " %"),
    "swing_sd": (0.0, 5.0, " cm/s"),
    "off_centre_sd": (0.0, 3.0, " mm"),
}
"""Ranges of the simulation's dials; the model's world has the first alone."""
_GAP_MM = 1165.0 / 24  # between rods of the paper's chain
_DROP_MM = 180.0
_CLEAR_MM = 15.0  # from the lowest rod
_HIGHEST_MM = 1078.0  # of the shipped gates
_SEEDS = 10_000  # rigs of one cube at most
_AVERAGED = ("separation_m", "speed_m_s")
_STEADY = {"impulse_sd": "0", "hang_sd": "0 mm", "skew_sd": "0 ms"}
"""What differs from drop to drop: a mean over drops estimates the drop without it."""
MODULES = {"mujoco": "bench.studies.mujoco_world"}


@dataclass(frozen=True, slots=True)
class Rig:
    """One rig of a cube.

    Attributes
    ----------
    number
        In its cube, from 1.
    seed
        Of the simulation.
    layout, heights
        Its name, and heights of the gates, mm.
    dials
        Of the simulation.
    text
        The protocol.
    """

    world: str
    number: int
    seed: int
    layout: str
    heights: str
    incline_deg: float
    rods: int
    drops: int
    dials: Mapping[str, float]
    text: str

    def ask(self, folder: Path, settings: Mapping[str, str] | None = None) -> Asked:
        """Write the protocol, and name the simulation of all its drops."""
        path = folder / f"{self.number}.yaml"
        path.write_text(self.text, encoding="utf-8")
        url = with_setting("sim://?stated=1", "protocol", str(path))
        for name, value in self.dials.items():
            url = with_setting(url, name, f"{value:g}{DIALS[name][2]}")
        extra = {"dynamics": "resolved"} if "string_strain" in self.dials else {}
        extra |= {"impact_error": "0"} if self.world == COEFFICIENTS else {}  # true as stated
        for name, text in (extra | dict(settings or {})).items():
            url = with_setting(url, name, text)
        runs = [run.number for run in planned(reader.parse(self.text))]
        return Asked(url, [self.seed], [runs])

    def row(self) -> dict[str, Any]:
        """Return what a table says of it."""
        names = ("world", "number", "layout", "heights", "incline_deg", "rods", "drops")
        return {name: getattr(self, name) for name in names} | dict(self.dials)


class Interval(NamedTuple):
    """A result: measured less true, with the expanded and the standard uncertainty."""

    quantity: str
    error: float
    expanded: float
    u: float

    @property
    def ratio(self) -> float:
        """|error| over U."""
        return abs(self.error) / self.expanded


@dataclass(slots=True)
class RigResult:
    """What became of a rig's drops.

    Attributes
    ----------
    intervals, session
        Of the drops; of what the whole session says.
    verdicts, beyond
        How many of each; void drops that truly are beyond the protocol's limit of skew.
    reasons
        First ones of the other void and marginal drops.
    wrong
        Edges given to another rod than they came from.
    seconds
        Processor time of the analysis.
    """

    rig: Rig
    intervals: list[Interval] = field(default_factory=list)
    session: list[Interval] = field(default_factory=list)
    verdicts: Counter[str] = field(default_factory=Counter)
    beyond: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    wrong: int = 0
    seconds: float = 0.0

    @property
    def void(self) -> int:
        """Drops that are void without need."""
        return self.verdicts.total() - sum(self.verdicts[good] for good in GOOD) - self.beyond

    @property
    def held(self) -> float:
        """Share of the drops' intervals that hold the true value; 1 where there is none."""
        return fmean(one.ratio <= 1.0 for one in self.intervals) if self.intervals else 1.0

    @property
    def worst(self) -> Interval | None:
        """The interval with the largest |error| over U."""
        return max(self.intervals, key=attrgetter("ratio"), default=None)

    def add(self, name: str, measured: Measured, true: float, *, session: bool = False) -> None:
        """Count one result."""
        of = self.session if session else self.intervals
        of.append(Interval(name, measured.value - true, measured.expanded, measured.u))

    def row(self) -> dict[str, Any]:
        """Return a line of the table of rigs."""
        worst = self.worst
        return self.rig.row() | {
            "void": self.void,
            "wrong": self.wrong,
            "intervals": len(self.intervals),
            "held": self.held,
            "worst_ratio": worst.ratio if worst else None,
            "worst_quantity": worst.quantity if worst else None,
            "ms_per_drop": 1e3 * self.seconds / self.verdicts.total(),
        }


def draw_rigs(folder: str, world: str, count: int, seed: int) -> list[Rig]:
    """Draw rigs of a world by a Latin hypercube.

    Parameters
    ----------
    folder
        Where the shipped protocols are.
    count, seed
        Of the cube; both choose what each rig is.
    """
    from scipy.stats.qmc import LatinHypercube  # noqa: PLC0415 - takes a second

    if count >= _SEEDS:
        raise InputError(f"{count} rigs are too many", f"draw fewer than {_SEEDS}")
    shipped = [Path(folder, name).read_text(encoding="utf-8") for name in SHIPPED]
    cube = LatinHypercube(4 + len(DIALS), seed=seed).random(count).tolist()
    return [_draw(world, n, _SEEDS * seed + n, row, shipped) for n, row in enumerate(cube, 1)]


def _draw(
    world: str, number: int, seed: int, shares: Sequence[float], shipped: Sequence[str]
) -> Rig:
    """Make a rig from its place on each axis of the cube."""
    sizes = (len(LAYOUTS), RODS[1] - RODS[0] + 1, len(DROPS))
    layout, rods, drops = (int(share * size) for share, size in zip(shares, sizes, strict=False))
    scene = yaml.safe_load(shipped[max(0, layout - len(GATES))])
    incline = round(_scale(shares[3], *INCLINES.get(world, (0.0, 0.0))), 1)
    scene["plan"] = {"order": "ABBA", "incline": f"{incline:g} deg", "repeats": DROPS[drops]}
    if world == COEFFICIENTS:
        scene["plan"] |= {"incline": [f"{deg} deg" for deg in range(0, 90, 10)], "repeats": 1}
    _hang(scene, RODS[0] + rods)
    if layout < len(GATES):
        _place_gates(scene, GATES[layout], np.random.default_rng(seed))
    dials = {
        name: round(_scale(share, *DIALS[name][:2]), 5)
        for name, share in zip(DIALS, shares[4:], strict=True)
        if name == "drag" or world in {"resolved", "mujoco"}
    }
    text = json.dumps(scene)
    protocol = reader.parse(text)
    count = protocol.chains["A"].chain.rods
    drops = len(planned(protocol))
    heights = _heights(scene)
    return Rig(world, number, seed, LAYOUTS[layout], heights, incline, count, drops, dials, text)


def _scale(share: float, low: float, high: float) -> float:
    return low + float(share) * (high - low)


def _hang(scene: dict[str, Any], rods: int) -> None:
    """Give a uniform chain another number of rods as far apart; keep gates below its top."""
    chain = scene["chains"]["A"]
    if not isinstance(chain["rods"], int):
        return
    length = _GAP_MM * (rods - 1)
    chain |= {"rods": rods, "length": f"{length:.6g} mm"}
    for side in ("impact", "free"):
        scene["gates"][side] = [
            gate for gate in scene["gates"][side]
            if float(gate["height"].split()[0]) < _DROP_MM + length
        ]  # fmt: skip


def _place_gates(scene: dict[str, Any], counts: tuple[int, int], rng: np.random.Generator) -> None:
    """Draw heights between the hanging rods: the lowest, then one in each of like ratios."""
    length = float(scene["chains"]["A"]["length"].split()[0])
    for side, count, channel in zip(("impact", "free"), counts, (0, 8), strict=True):
        top = min(350.0 if count < max(GATES[-1]) else _HIGHEST_MM, _DROP_MM + length)
        edges = np.geomspace(40.0, top, count)
        ratios = (edges[1:] / edges[:-1]) ** rng.uniform(0.1, 0.9, count - 1)
        heights = [rng.uniform(20.0, 35.0), *map(_beside_rods, edges[:-1] * ratios)]
        scene["gates"][side] = [
            {"channel": channel + n, "height": f"{mm:.1f} mm"} for n, mm in enumerate(heights)
        ]


def _beside_rods(height_mm: float) -> float:
    """Move a gate among the hanging rods into the middle of its gap."""
    gap, share = divmod((height_mm - _DROP_MM) / _GAP_MM, 1.0)
    hanging = height_mm > _DROP_MM - _CLEAR_MM
    return _DROP_MM + _GAP_MM * (gap + 0.3 + 0.4 * share) if hanging else height_mm


def _heights(scene: Mapping[str, Any]) -> str:
    sides = (scene["gates"][side] for side in ("impact", "free"))
    return " + ".join(", ".join(one["height"].split()[0] for one in side) for side in sides)


@one_thread
def measure(rigs: Sequence[Rig]) -> list[RigResult]:
    """Let chains fall on rigs of one world, and set every result beside what is true.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    steady = rigs[0].world == "model"
    with TemporaryDirectory() as folder:
        asked = [rig.ask(Path(folder)) for rig in rigs]
        more = [rig.ask(Path(folder), _STEADY) for rig in rigs if steady]
        drops = falls([*asked, *more], MODULES.get(rigs[0].world, "sim.edges"))
        sessions = [[*islice(drops, len(one.runs[0]))] for one in [*asked, *more]]
    pairs = zip(rigs, sessions, sessions[len(rigs) :] or [[]] * len(rigs), strict=False)
    return [_judge(rig, session, without) for rig, session, without in pairs]


def _judge(
    rig: Rig, session: Sequence[SimulatedDrop], steady: Sequence[SimulatedDrop]
) -> RigResult:
    """Analyse a rig's drops, and judge what each and all together say."""
    protocol, scale = reader.parse(rig.text), time_scale(rig.seed)
    drops = {fall.drop.run: fall for fall in session}
    found = RigResult(rig)
    begin = time.process_time()
    analysis = analyze(protocol, [fall.drop for fall in session], lambda _: scale)
    found.seconds = time.process_time() - begin
    for result in analysis.runs:
        fall = drops[result.run.number]
        found.verdicts[result.verdict] += 1
        void = result.verdict not in GOOD
        beyond = void and abs(fall.truth["release_skew_s"]) > protocol.accept.release_skew
        found.beyond += beyond
        if result.verdict != "accepted" and not beyond:
            found.reasons.update(f"{result.verdict}: {reason}" for reason in result.reasons[:1])
        if void:
            continue
        found.wrong += fall.rods(result.matches)[0]
        for name, measured in result.quantities.items():
            if fall.truth.get(name) is not None:
                found.add(name, measured, fall.truth[name])
    for name, measured, true in _shared(rig, analysis, drops):
        found.add(name, measured, true, session=True)
    for line in analysis.summary if steady else ():
        for name in _AVERAGED:
            true = fmean(fall.truth[name] for fall in steady)
            found.add(f"mean {name}", line.means[name], true, session=True)
    return found


def _shared(
    rig: Rig, analysis: Analysis, drops: Mapping[int, SimulatedDrop]
) -> Iterator[tuple[str, Measured, float]]:
    """Yield what drops of one rig say together, and what is true: g, κ, and coefficients."""
    protocol = reader.parse(rig.text)
    check = check_gravity(protocol, analysis.runs)
    if check is not None:
        true = next(iter(drops.values())).truth["gravity_m_s2"]
        yield "gravity_m_s2", check.measured, true
    if analysis.joint is not None:
        joint, at = analysis.joint, analysis.joint.shared.blocks["drag"].start
        u = math.sqrt(joint.covariance[at, at]) * float(joint.sd[at])
        yield "drag_per_m", Measured(float(joint.x[at]), u), rig.dials["drag"]
    if rig.world == COEFFICIENTS:
        estimated = estimate(protocol, analysis).coefficients
        for one in estimated.parameters if estimated is not None else ():
            if one.identified:
                yield one.name, one.least_squares, one.stated.value


def summarize(found: Iterable[RigResult], *, session: bool = False) -> dict[str, Any]:
    """Sum up rigs; shares have standard errors from rig to rig."""
    rigs = [*found]
    drops = sum(one.verdicts.total() for one in rigs)
    fair = max(1, drops - sum(one.beyond for one in rigs))
    errors: dict[str, Errors] = {}
    for one in rigs:
        for name, error, expanded, u in one.session if session else one.intervals:
            errors.setdefault(name, Errors()).add(error, expanded, one.rig.number, u)
    return {
        "rigs": len(rigs),
        "drops": drops,
        "beyond": drops - fair,
        "void_share": sum(one.void for one in rigs) / fair,
        "marginal_share": sum(one.verdicts["marginal"] for one in rigs) / fair,
        "wrong": sum(one.wrong for one in rigs),
        "ms_per_drop": 1e3 * sum(one.seconds for one in rigs) / max(1, drops),
        "quantities": {name: one.json() for name, one in errors.items()},
        "reasons": dict(sum((one.reasons for one in rigs), Counter[str]()).most_common()),
    }


def groups(found: Sequence[RigResult]) -> dict[str, list[RigResult]]:
    """Sort rigs by layout, drops a session, and thirds of incline and string restitution."""
    by: dict[tuple[int, float, str], list[RigResult]] = {}
    for one in found:
        rig = one.rig
        keys = [
            (0, LAYOUTS.index(rig.layout), rig.layout),
            (1, rig.drops, f"drops a session: {rig.drops}"),
        ]
        if rig.world in INCLINES:
            label = _third(rig.incline_deg, *INCLINES[rig.world])
            keys.append((2, 0, f"incline {label}°"))
        if "string_restitution" in rig.dials:
            label = _third(rig.dials["string_restitution"], *DIALS["string_restitution"][:2])
            keys.append((3, 0, f"string restitution {label}"))
        for key in keys:
            by.setdefault(key, []).append(one)
    return {name: by[kind, order, name] for kind, order, name in sorted(by)}


def _third(value: float, low: float, high: float) -> str:
    """Name the third of a range."""
    part = (high - low) / 3.0
    first = low + part * min(2, int((value - low) / part))
    return f"{first:.2g} to {first + part:.2g}"


def worst_tenth(found: Sequence[RigResult]) -> dict[str, list[RigResult]]:
    """Return the tenth of rigs that hold fewest intervals, and that with the largest |error|/U."""
    count = math.ceil(len(found) / 10)
    with_results = [one for one in found if one.intervals]

    def ratio(one: RigResult) -> float:
        return one.worst.ratio if one.worst else 0.0

    fewest = sorted(with_results, key=lambda one: (one.held, -ratio(one)))[:count]
    largest = sorted(with_results, key=ratio, reverse=True)[:count]
    tenths = {"worst tenth, fewest held": fewest, "worst tenth, |error| / U": largest}
    return {name: rigs for name, rigs in tenths.items() if rigs}
