"""Does U hold the true value? Rigs drawn by a Latin hypercube, each in one of several worlds.

A rig is gates, chains, an incline, drops and dials of its world, and is off by as much as its
protocol states. Rigs are independent of each other; drops on one rig share its errors.
"""

from __future__ import annotations

import json
import math
from collections import defaultdict
from dataclasses import dataclass, field
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from statistics import fmean
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import yaml

from bench.studies.columns import Column, aligned
from bench.studies.falls import Asked, SimulatedDrop, falls, simulation
from bench.studies.scores import Score, shares_held, total
from bench.studies.sessions import SimulatedSession, without_device
from bench.workers import results
from rig.analysis.comparison import compare
from rig.analysis.gravity import check_gravity
from rig.analysis.result import Measured, good_runs
from rig.bench.findings import Findings
from rig.commands.output import progress, say
from rig.errors import InputError
from rig.estimate.session import estimate
from rig.measurands import MEASURANDS
from rig.protocol import reader
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
"""At each incline."""
RODS = (16, 36)
LAYOUTS = (
    *(f"{impact} + {free}" for impact, free in GATES),
    *(Path(name).stem for name in SHIPPED),
)
DIALS = {
    "drag": (0.0, 0.03, ""),
    "string_restitution": (0.1, 0.7, ""),
    "string_strain": (2.0, 8.0, " %"),
    "swing_sd": (0.0, 5.0, " cm/s"),
    "off_centre_sd": (0.0, 3.0, " mm"),
}
"""Ranges of the simulation's dials."""


class World(NamedTuple):
    """Where rigs are drawn, and how many there are by default.

    Attributes
    ----------
    inclines
        Range of the one incline of each rig, °; where there is none, each rig has nine.
    dials
        Those of `DIALS` that are drawn: what the protocol does not know.
    settings
        Others of the simulation.
    repeats
        Drops at each incline, one of these.
    layouts
        Places in `LAYOUTS`.
    module
        Of the simulation.
    """

    rigs: int
    inclines: tuple[float, float] | None
    dials: tuple[str, ...] = ()
    settings: Mapping[str, str] = MappingProxyType({})
    repeats: tuple[int, ...] = DROPS
    layouts: range = range(len(LAYOUTS))
    module: str = "sim.edges"


COEFFICIENTS = "coefficients"
"""The model's world, one drop at each of nine inclines: are β and μ within their U?"""
_STATED = {"stated": "1"}
_RESOLVED = {"dynamics": "resolved", **_STATED}
# Below some 30° real rods land on a pile, which the model describes by a coefficient.
WORLDS = {
    "model": World(200, (0.0, 80.0), ("drag",), _STATED),
    "resolved": World(200, (35.0, 80.0), (*DIALS,), _RESOLVED),
    "piles": World(60, (0.0, 35.0), (*DIALS,), _RESOLVED),
    "mujoco": World(40, (35.0, 80.0), (*DIALS,), _RESOLVED, module="bench.studies.mujoco_world"),
    COEFFICIENTS: World(20, None, ("drag",), _STATED | {"impact_error": "0"}, repeats=(1,)),
    "stated": World(100, None, settings=_STATED, layouts=range(len(GATES), len(GATES) + 1)),
    "usual": World(10, None, layouts=range(len(GATES), len(GATES) + 1)),
}
"""In all but the last each rig is wrong by as much as its protocol states; in the last two all is
as the model has it, so that it should be refuted as rarely as p says."""
_NINE = [f"{degrees} deg" for degrees in range(0, 90, 10)]
_GAP_MM = 1165.0 / 24  # between rods of the paper's chain
_DROP_MM = 180.0
_CLEAR_MM = 15.0  # from the lowest rod
_HIGHEST_MM = 1078.0  # of the shipped gates
_SEEDS = 10_000  # rigs of one cube at most
_AVERAGED = ("separation_m", "speed_m_s")
_STEADY = {"impulse_sd": "0", "hang_sd": "0 mm", "skew_sd": "0 ms"}
"""What differs from drop to drop: a mean over drops estimates the drop without it."""
_CHUNK = 4  # rigs for one process of the simulation
_HEAD = """\
# Does U hold the true value?

`./run bench coverage`: rigs drawn by a Latin hypercube over layout, rods, incline, drops a session
and what the protocol does not know: air, and in the resolved world strings, swing and place along
the beams. Each rig is wrong by as much as its protocol states, but in the world *usual*, where it
is as good as rigs usually are. 95 % of the intervals should hold the true value. ± of a share is
from rig to rig. *rms / u*: rms error over the stated standard uncertainty. Void shares leave out
drops beyond the protocol's limits. The worst tenth of rigs stands below each world: the same
`--rigs` and `--seed` with `--only NUMBER` draw a rig again. Where the model is true, its p should
be uniform (*KS*: Kolmogorov and Smirnov), and |Eₙ| above 1 in at most 5 %."""
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
        dials |= {**WORLDS[self.world].settings, **(settings or {})}
        url = simulation(path, dials)
        runs = [run.number for run in reader.parse(self.text).runs()]
        return Asked(url, [self.seed], [runs])

    def row(self) -> dict[str, Any]:
        """Return what a table says of it."""
        names = ("world", "number", "layout", "heights", "incline_deg", "rods", "drops")
        return {name: getattr(self, name) for name in names} | dict(self.dials)


@dataclass(slots=True)
class RigResult:
    """What became of a rig's drops, and of what they say together.

    Attributes
    ----------
    agreement
        Of each quantity with a model that is true: p of χ², and |Eₙ| of each incline.
    """

    rig: Rig
    drops: Score = field(default_factory=Score)
    session: Score = field(default_factory=Score)
    agreement: dict[str, tuple[float, list[float]]] = field(default_factory=dict)

    @property
    def ratios(self) -> list[tuple[float, str]]:
        """|error| over U of every interval, with its quantity."""
        errors = self.drops.errors
        return [(ratio, name) for name in errors for ratio in errors[name].ratios]

    @property
    def held(self) -> float:
        """Share of the drops' intervals that hold the true value; 1 where there is none."""
        return fmean(ratio <= 1.0 for ratio, _ in self.ratios) if self.ratios else 1.0

    def row(self) -> dict[str, Any]:
        """Return a line of the table of rigs."""
        ratio, quantity = max(self.ratios, default=(None, None))
        return self.rig.row() | {
            "void": self.drops.void,
            "wrong": self.drops.wrong_edges,
            "intervals": len(self.ratios),
            "held": self.held,
            "worst_ratio": ratio,
            "worst_quantity": quantity,
            "ms_per_drop": 1e3 * self.drops.seconds / self.drops.verdicts.total(),
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
    kind = WORLDS[world]
    axes = kind.layouts, range(RODS[0], RODS[1] + 1), kind.repeats
    layout, rods, repeats = (
        axis[int(share * len(axis))] for share, axis in zip(shares, axes, strict=False)
    )
    scene = yaml.safe_load(shipped[max(0, layout - len(GATES))])
    incline = round(_scale(shares[3], *(kind.inclines or (0.0, 0.0))), 1)
    inclines = f"{incline:g} deg" if kind.inclines else _NINE
    scene["plan"] = {"order": "ABBA", "incline": inclines, "repeats": repeats}
    _hang(scene, rods)
    if layout < len(GATES):
        _place_gates(scene, GATES[layout], np.random.default_rng(seed))
    dials = {
        name: round(_scale(share, *DIALS[name][:2]), 5)
        for name, share in zip(DIALS, shares[4:], strict=True)
        if name in kind.dials
    }
    text = json.dumps(scene)
    protocol = reader.parse(text)
    count, drops = protocol.chains["A"].chain.rods, len(protocol.runs())
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
    return " + ".join(
        ", ".join(gate["height"].split()[0] for gate in scene["gates"][side])
        for side in ("impact", "free")
    )


@one_thread
def measure(rigs: Sequence[Rig]) -> list[RigResult]:
    """Let chains fall on rigs of one world, and set every result beside what is true.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    module = WORLDS[rigs[0].world].module
    protocols = [reader.parse(rig.text) for rig in rigs]
    with TemporaryDirectory() as folder:
        asked = [rig.ask(Path(folder)) for rig in rigs]
        sessions = [*without_device([*zip(protocols, asked, strict=True)], module)]
        outcomes = [_compare(*pair) for pair in zip(rigs, sessions, strict=True)]
        if rigs[0].world == "model":
            steady = falls([rig.ask(Path(folder), _STEADY) for rig in rigs], module)
            for outcome, session in zip(outcomes, sessions, strict=True):
                _add_means(outcome, session, [*islice(steady, len(session.drops))])
    return outcomes


def _compare(rig: Rig, session: SimulatedSession) -> RigResult:
    """Set what the drops of a rig say, and all together, beside what is true."""
    protocol, analysis, number = session.protocol, session.analysis, rig.number
    outcome = RigResult(rig)
    outcome.drops.seconds = session.analysis_s
    for result, fall, _ in session.results():
        outcome.drops.add_drop(protocol, result, fall, number)
    together = outcome.session
    check = check_gravity(protocol, analysis.runs)
    if check is not None:
        true = next(fall.truth for fall, _ in session.drops.values())["gravity_m_s2"]
        together.add_error("gravity_m_s2", check.measured, true, number)
    if analysis.joint is not None:
        joint, at = analysis.joint, analysis.joint.shared.blocks["drag"].start
        u = math.sqrt(joint.covariance[at, at]) * float(joint.sd[at])
        air = Measured(float(joint.x[at]), u)
        together.add_error("drag_per_m", air, rig.dials.get("drag"), number)
    if rig.world == COEFFICIENTS:
        coefficients = estimate(protocol, analysis).coefficients
        for each in coefficients.parameters if coefficients is not None else ():
            if each.identified:
                together.add_error(each.name, each.least_squares, each.stated.value, number)
    if not rig.dials:
        for comparison in compare(protocol, good_runs(analysis.runs)):
            errors = [abs(line.normalized_error or 0.0) for line in comparison.differences]
            outcome.agreement[comparison.quantity] = comparison.p, errors
    return outcome


def _add_means(
    outcome: RigResult, session: SimulatedSession, steady: Sequence[SimulatedDrop]
) -> None:
    """Set means over drops beside those of drops that do not scatter."""
    for line in session.analysis.summary:
        for name in _AVERAGED:
            true = fmean(fall.truth[name] for fall in steady)
            outcome.session.add_error(f"mean {name}", line.means[name], true, outcome.rig.number)


def summarize(outcomes: Iterable[RigResult]) -> dict[str, Any]:
    """Sum up rigs; shares have standard errors from rig to rig."""
    rigs = [*outcomes]
    return {"rigs": len(rigs)} | total(rig.drops for rig in rigs).json()


def agreement(outcomes: Sequence[RigResult]) -> Iterator[dict[str, Any]]:
    """Yield how often sessions refute the model that made them, by quantity and drops."""
    from scipy.stats import kstest  # noqa: PLC0415 - takes a second

    rigs: dict[tuple[str, int], list[tuple[float, list[float]]]] = defaultdict(list)
    for outcome in outcomes:
        for quantity, comparison in outcome.agreement.items():
            rigs[quantity, outcome.rig.drops].append(comparison)
    for (quantity, drops), comparisons in sorted(rigs.items()):
        p = np.array([each for each, _ in comparisons])
        beyond = [np.mean(np.array(errors) > 1.0) for _, errors in comparisons]
        yield {
            "quantity": MEASURANDS[quantity].symbol, "drops": drops, "sessions": p.size,
            "ks_p": float(kstest(p, "uniform").pvalue),
            **{f"p_below_{level}": float(np.mean(p < level)) for level in (0.01, 0.05, 0.5, 0.95)},
            "beyond": float(np.mean(beyond)), "beyond_se": float(np.std(beyond) / p.size**0.5),
        }  # fmt: skip


_AGREEMENT = (
    Column("model", "quantity"), Column("drops", "drops", "d"), Column("sessions", "sessions", "d"),
    Column("KS", "ks_p", ".2f"), Column("p < 0.01", "p_below_0.01", ".0%"),
    Column("p < 0.05", "p_below_0.05", ".0%"), Column("p < 0.5", "p_below_0.5", ".0%"),
    Column("p < 0.95", "p_below_0.95", ".0%"), Column("|Eₙ| > 1", "beyond", ".1%"),
    Column("±", "beyond_se", ".1%"),
)  # fmt: skip


def groups(results: Sequence[RigResult]) -> dict[str, list[RigResult]]:
    """Sort rigs by layout, drops a session, and thirds of incline and string restitution."""
    members: dict[tuple[int, float, str], list[RigResult]] = defaultdict(list)
    for result in results:
        rig = result.rig
        keys = [
            (0, LAYOUTS.index(rig.layout), rig.layout),
            (1, rig.drops, f"drops a session: {rig.drops}"),
        ]
        if inclines := WORLDS[rig.world].inclines:
            label = _third(rig.incline_deg, *inclines)
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
    rigs = [rig for rig in results if rig.ratios]
    fewest = sorted(rigs, key=lambda rig: (rig.held, -max(rig.ratios)[0]))[:count]
    largest = sorted(rigs, key=lambda rig: max(rig.ratios), reverse=True)[:count]
    tenths = {"worst tenth, fewest held": fewest, "worst tenth, |error| / U": largest}
    return {name: tenth for name, tenth in tenths.items() if tenth}


def run(arguments: Namespace) -> Iterator[Findings]:
    """Let chains fall on the rigs of each world."""
    worlds = arguments.world or [world for world in WORLDS if world != "mujoco"]
    if "mujoco" in worlds and find_spec("mujoco") is None:
        raise InputError("the world mujoco needs MuJoCo", ".venv/bin/pip install mujoco")
    record: dict[str, Any] = {}
    lines: list[str] = []
    for world in worlds:
        rigs = draw_rigs(
            arguments.protocols, world, arguments.rigs or WORLDS[world].rigs, arguments.seed
        )
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
        "sessions": total(rig.session for rig in outcomes).json()["quantities"],
        "agreement": [*agreement(outcomes)],
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
            str(figures["wrong_edges"]), f"{figures['ms_per_drop']:.0f}",
            *(" ".join(shares_held(share, 0)).rstrip() if share else "" for share in shares),
        ])  # fmt: skip
    yield from text_table(rows, left={0}, rule=True)
    if record["agreement"]:
        yield from ("", *aligned(_AGREEMENT, record["agreement"]))
    silent = [str(outcome.rig.number) for outcome in outcomes if not outcome.ratios]
    if silent:
        yield f"all drops void: rigs {', '.join(silent)}"
    for name, rigs in worst_tenth(outcomes).items():
        tenth = [each.row() for each in rigs]
        columns = [column for column in _RIG if column.key in tenth[0]]
        yield from ("", f"{name}:", *aligned(columns, tenth))


_RIG = (
    Column("rig", "number", "d"), Column("layout", "layout"),
    Column("incline (°)", "incline_deg", "g"), Column("rods", "rods", "d"),
    Column("drops", "drops", "d"), Column("κ (1/m)", "drag", ".3g"),
    Column("strings", "string_restitution", ".3g"), Column("strain (%)", "string_strain", ".3g"),
    Column("swing (cm/s)", "swing_sd", ".3g"), Column("off centre (mm)", "off_centre_sd", ".3g"),
    Column("void", "void", "d"), Column("intervals", "intervals", "d"),
    Column("held", "held", ".3g"), Column("|error| / U", "worst_ratio", ".3g"),
    Column("of", "worst_quantity"),
)  # fmt: skip
"""What describes a rig, so that it can be drawn again; its dials where they are drawn."""


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
