"""Does U hold the true value? Rigs drawn by a Latin hypercube, each in one of three worlds.

A rig is gates, chains, an incline, drops and dials of its world, and is off by as much as its
protocol states. Rigs are independent of each other; drops on one rig share its errors.
"""

from __future__ import annotations

import json
import math
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from statistics import fmean
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import yaml

from bench.studies.errors import Errors, shares_held
from bench.studies.sessions import SimulatedSession, without_device
from bench.workers import results
from rig.analysis.gravity import check_gravity
from rig.analysis.result import GOOD, Measured
from rig.bench.falls import Asked, SimulatedDrop, falls, simulation
from rig.bench.findings import Findings
from rig.commands.output import progress, say
from rig.errors import InputError
from rig.estimate.session import estimate
from rig.measurands import MEASURANDS
from rig.protocol import reader
from rig.protocol.plan import runs as planned
from rig.text_table import text_table
from rig.threads import one_thread

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    Record = Mapping[str, Any]

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
LAYOUTS = (
    *(f"{impact} + {free}" for impact, free in GATES),
    *(Path(name).stem for name in SHIPPED),
)
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
RIGS = {"model": 200, "resolved": 200, "mujoco": 40, COEFFICIENTS: 20}
_CHUNK = 4  # rigs for one process of the simulation
_HEAD = """\
# Does U hold the true value?

`./run bench coverage`: rigs drawn by a Latin hypercube over layout, rods, incline, drops a session
and what the protocol does not know: air, and in the resolved world strings, swing and place along
the beams. Each rig is wrong by as much as its protocol states. 95 % of the intervals should hold
the true value. ± of a share is from rig to rig. *rms / u*: rms error over the stated standard
uncertainty. Void shares leave out drops beyond the limit of release skew. The worst tenth of rigs
stands below each world: the same `--rigs` and `--seed` with `--only NUMBER` draw a rig again."""
_TABULATED = (
    "separation_m", "separation_raw_m", "separation_strike_m", "speed_m_s", "speed_strike_m_s",
    "release_skew_s", "fall_time_s",
)  # fmt: skip
_OTHER = {"drag_per_m": ("κ (1/km)", 1e3), "restitution": ("β", 1.0), "friction": ("μ", 1.0)}


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
        dials = {name: f"{value:g}{DIALS[name][2]}" for name, value in self.dials.items()}
        extra = {"dynamics": "resolved"} if "string_strain" in self.dials else {}
        extra |= {"impact_error": "0"} if self.world == COEFFICIENTS else {}  # true as stated
        url = simulation(path, dials | extra | dict(settings or {}), "sim://?stated=1")
        runs = [run.number for run in planned(reader.parse(self.text))]
        return Asked(url, [self.seed], [runs])

    def row(self) -> dict[str, Any]:
        """Return what a table says of it."""
        names = ("world", "number", "layout", "heights", "incline_deg", "rods", "drops")
        return {name: getattr(self, name) for name in names} | dict(self.dials)


class Interval(NamedTuple):
    """A result beside the true value."""

    quantity: str
    measured: Measured
    true: float

    @property
    def ratio(self) -> float:
        """|error| over U."""
        return abs(self.measured.value - self.true) / self.measured.expanded


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
        return fmean(each.ratio <= 1.0 for each in self.intervals) if self.intervals else 1.0

    @property
    def worst(self) -> Interval | None:
        """The interval with the largest |error| over U."""
        return max(self.intervals, key=lambda interval: interval.ratio, default=None)

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
    module = MODULES.get(rigs[0].world, "sim.edges")
    protocols = [reader.parse(rig.text) for rig in rigs]
    with TemporaryDirectory() as folder:
        asked = [rig.ask(Path(folder)) for rig in rigs]
        sessions = [*without_device([*zip(protocols, asked, strict=True)], module)]
        outcomes = [_judge(*pair) for pair in zip(rigs, sessions, strict=True)]
        if rigs[0].world == "model":
            steady = falls([rig.ask(Path(folder), _STEADY) for rig in rigs], module)
            for outcome, session in zip(outcomes, sessions, strict=True):
                outcome.session += _means(session, [*islice(steady, len(session.drops))])
    return outcomes


def _judge(rig: Rig, session: SimulatedSession) -> RigResult:
    """Judge what the drops of a rig and all together say."""
    limit = session.protocol.accept.release_skew
    outcome = RigResult(rig, seconds=session.analysis_s)
    for result, fall, _ in session.results():
        outcome.verdicts[result.verdict] += 1
        void = result.verdict not in GOOD
        beyond = void and abs(fall.truth["release_skew_s"]) > limit
        outcome.beyond += beyond
        if result.verdict != "accepted" and not beyond:
            outcome.reasons.update(f"{result.verdict}: {reason}" for reason in result.reasons[:1])
        if not void:
            outcome.wrong += fall.rods(result.matches)[0]
            outcome.intervals += [
                Interval(name, measured, fall.truth[name])
                for name, measured in result.quantities.items()
                if fall.truth.get(name) is not None
            ]
    outcome.session += _shared(rig, session)
    return outcome


def _means(session: SimulatedSession, steady: Sequence[SimulatedDrop]) -> Iterator[Interval]:
    """Yield means over drops beside those of drops that do not scatter."""
    for line in session.analysis.summary:
        for name in _AVERAGED:
            true = fmean(fall.truth[name] for fall in steady)
            yield Interval(f"mean {name}", line.means[name], true)


def _shared(rig: Rig, session: SimulatedSession) -> Iterator[Interval]:
    """Yield what drops of one rig say together, and what is true: g, κ, and coefficients."""
    protocol, analysis = session.protocol, session.analysis
    check = check_gravity(protocol, analysis.runs)
    if check is not None:
        true = next(fall.truth for fall, _ in session.drops.values())["gravity_m_s2"]
        yield Interval("gravity_m_s2", check.measured, true)
    if analysis.joint is not None:
        joint, at = analysis.joint, analysis.joint.shared.blocks["drag"].start
        u = math.sqrt(joint.covariance[at, at]) * float(joint.sd[at])
        yield Interval("drag_per_m", Measured(float(joint.x[at]), u), rig.dials["drag"])
    if rig.world == COEFFICIENTS:
        coefficients = estimate(protocol, analysis).coefficients
        for each in coefficients.parameters if coefficients is not None else ():
            if each.identified:
                yield Interval(each.name, each.least_squares, each.stated.value)


def summarize(results: Iterable[RigResult], *, session: bool = False) -> dict[str, Any]:
    """Sum up rigs; shares have standard errors from rig to rig."""
    rigs = [*results]
    drops = sum(rig.verdicts.total() for rig in rigs)
    fair = max(1, drops - sum(rig.beyond for rig in rigs))
    errors: dict[str, Errors] = defaultdict(Errors)
    for rig in rigs:
        for name, measured, true in rig.session if session else rig.intervals:
            errors[name].add(measured, true, rig.rig.number)
    return {
        "rigs": len(rigs),
        "drops": drops,
        "beyond": drops - fair,
        "void_share": sum(rig.void for rig in rigs) / fair,
        "marginal_share": sum(rig.verdicts["marginal"] for rig in rigs) / fair,
        "wrong": sum(rig.wrong for rig in rigs),
        "ms_per_drop": 1e3 * sum(rig.seconds for rig in rigs) / max(1, drops),
        "quantities": {name: errors[name].json() for name in errors},
        "reasons": dict(sum((rig.reasons for rig in rigs), Counter[str]()).most_common()),
    }


def groups(results: Sequence[RigResult]) -> dict[str, list[RigResult]]:
    """Sort rigs by layout, drops a session, and thirds of incline and string restitution."""
    members: dict[tuple[int, float, str], list[RigResult]] = defaultdict(list)
    for result in results:
        rig = result.rig
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
            members[key].append(result)
    return {key[-1]: members[key] for key in sorted(members)}


def _third(value: float, low: float, high: float) -> str:
    """Name the third of a range."""
    part = (high - low) / 3.0
    first = low + part * min(2, int((value - low) / part))
    return f"{first:.2g} to {first + part:.2g}"


def worst_tenth(results: Sequence[RigResult]) -> dict[str, list[RigResult]]:
    """Return the tenth of rigs that hold fewest intervals, and that with the largest |error|/U."""
    count = math.ceil(len(results) / 10)
    rigs = [rig for rig in results if rig.intervals]

    def ratio(rig: RigResult) -> float:
        return rig.worst.ratio if rig.worst else 0.0

    fewest = sorted(rigs, key=lambda rig: (rig.held, -ratio(rig)))[:count]
    largest = sorted(rigs, key=ratio, reverse=True)[:count]
    tenths = {"worst tenth, fewest held": fewest, "worst tenth, |error| / U": largest}
    return {name: tenth for name, tenth in tenths.items() if tenth}


def run(arguments: Namespace) -> Iterator[Findings]:
    """Let chains fall on the rigs of each world."""
    worlds = arguments.world or [world for world in WORLDS if world not in MODULES]
    if "mujoco" in worlds and find_spec("mujoco") is None:
        raise InputError("the world mujoco needs MuJoCo", ".venv/bin/pip install mujoco")
    record: dict[str, Any] = {}
    lines: list[str] = []
    for world in worlds:
        rigs = draw_rigs(arguments.protocols, world, arguments.rigs or RIGS[world], arguments.seed)
        rigs = [rig for rig in rigs if rig.number in (arguments.only or [rig.number])]
        if not rigs:
            raise InputError("no rig of the cube has such a number", "give --only up to --rigs")
        chunks = [(measure, rigs[n : n + _CHUNK]) for n in range(0, len(rigs), _CHUNK)]
        outcomes: list[RigResult] = []
        for chunk in results(chunks, arguments.jobs):
            outcomes += chunk
            progress(len(outcomes), len(rigs), world)
        record[world] = _record(outcomes)
        lines += [*([""] if lines else []), *_lines(world, outcomes, record[world])]
        say(f"{world}: {record[world]['all']['drops']} drops of {len(rigs)} rigs")
        rows = [row for figures in record.values() for row in figures["rigs"]]
        yield Findings(record, lines, _HEAD, rows, simulated=True)


def _record(outcomes: Sequence[RigResult]) -> dict[str, Any]:
    """Return all figures of a world."""
    worst = worst_tenth(outcomes)
    return {
        "all": summarize(outcomes),
        "sessions": summarize(outcomes, session=True)["quantities"],
        "groups": {name: summarize(rigs) for name, rigs in (groups(outcomes) | worst).items()},
        "worst": {name: [each.rig.number for each in rigs] for name, rigs in worst.items()},
        "rigs": [outcome.row() for outcome in outcomes],
    }


def _lines(world: str, outcomes: Sequence[RigResult], record: Record) -> Iterator[str]:
    """Write the tables of a world."""
    quantities = record["all"]["quantities"] | record["sessions"]
    rows = [[world, "n", "rms", "bias", "median U95", "in U95", "", "rms / u"]]
    rows += [_row(name, errors) for name, errors in quantities.items()]
    yield from text_table(rows, left={0, 6}, rule=True)
    yield ""
    names = [name for name in _TABULATED if name in quantities]
    symbols = [MEASURANDS[name].label for name in names]
    rows = [["in U95", "rigs", "drops", "void", "wrong edges", "ms a drop", *symbols]]
    for group, figures in ({"all": record["all"]} | record["groups"]).items():
        shares = [figures["quantities"].get(name) for name in names]
        rows.append([
            group, str(figures["rigs"]), str(figures["drops"]), f"{figures['void_share']:.1%}",
            str(figures["wrong"]), f"{figures['ms_per_drop']:.0f}",
            *(" ".join(shares_held(share, 0)).rstrip() if share else "" for share in shares),
        ])  # fmt: skip
    yield from text_table(rows, left={0}, rule=True)
    silent = [str(outcome.rig.number) for outcome in outcomes if not outcome.intervals]
    if silent:
        yield f"all drops void: rigs {', '.join(silent)}"
    for name, rigs in worst_tenth(outcomes).items():
        yield from ("", f"{name}:", *_worst([each.row() for each in rigs]))


def _worst(rows: Sequence[Record]) -> list[str]:
    """Describe rigs, so that each can be drawn again."""
    names = [name for name in rows[0] if name not in _HIDDEN]
    heads = [_HEADINGS.get(name, name) for name in names]
    return text_table([heads, *([_text(row[name]) for name in names] for row in rows)], rule=True)


_HIDDEN = {"world", "heights", "wrong", "ms_per_drop"}
_HEADINGS = {
    "number": "rig", "incline_deg": "incline (°)", "drag": "κ (1/m)",
    "string_restitution": "strings", "string_strain": "strain (%)", "swing_sd": "swing (cm/s)",
    "off_centre_sd": "off centre (mm)", "worst_ratio": "|error| / U", "worst_quantity": "of",
}  # fmt: skip


def _text(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _row(key: str, errors: Record) -> list[str]:
    name = key.removeprefix("mean ")
    label, scale = _OTHER.get(name, (name, 1.0))
    if name in MEASURANDS:
        row = MEASURANDS[name]
        label, scale = f"{row.label} ({row.fine})" if row.fine else row.label, row.fine_scale
    sizes = [f"{errors[size] * scale:.3f}" for size in ("rms", "bias", "median_U95")]
    mean = "mean " if key != name else ""
    shares = shares_held(errors, 1)
    return [f"{mean}{label}", str(errors["n"]), *sizes, *shares, f"{errors['times_u']:.2f}"]
