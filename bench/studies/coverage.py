"""Do intervals hold? Many rigs, each off by as much as its protocol says, in both worlds.

An interval is a promise about rigs of which nothing more is known than what their protocol states.
So each rig here has errors of its own, drawn from what is stated: each post's zero, each beam, each
rod, how the chains hang. Drops on one rig share them: many rigs with few drops each tell most.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field, replace
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Any

from bench.studies.accuracy import Errors
from bench.studies.fast_accuracy import blocks
from bench.studies.layout_catalogue import STANDARD, GateLayout
from bench.studies.wrong_rigs import NAMELESS, WRONG_RIGS, WrongRig
from rig.analysis.gravity import check_gravity
from rig.analysis.result import GOOD, Measured
from rig.analysis.session import analyze
from rig.bench.falls import Asked, falls, time_scale, with_setting
from rig.clock.calibration import TimeScale
from rig.estimate.session import estimate
from rig.protocol import reader
from rig.protocol.plan import runs as planned
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rig.analysis.session import Analysis
    from rig.bench.falls import SimulatedDrop
    from rig.protocol.protocol import Protocol

UNIFORM, GRADED = "inclined-uniform.yaml", "graded-chain.yaml"
STEEP = (40.0, 50.0, 60.0, 70.0, 80.0)
"""Where no rods come to rest in the lowest beams, ° of incline."""
EVERY = (0.0, 10.0, 20.0, 30.0, *STEEP)
_AVERAGED = ("separation_m", "speed_m_s")
_WEIGHED = ("separation_m", "speed_m_s", "release_skew_s")
FULL = GateLayout(
    STANDARD, (28, 40, 70, 130, 204, 350, 690, 1078), (28, 60, 100, 140, 204, 350, 690, 1078)
)
"""What the rigs that are wrong in something are said to be."""
_FORGOTTEN_MM = 18.8  # where a rod of the uniform chain touches above a board at 40°


@dataclass(frozen=True, slots=True)
class CoverageCase:
    """A world, and what differs in it.

    Attributes
    ----------
    name
        In words.
    protocol
        Which of the ready ones.
    settings
        Of the simulation's URL.
    rigs
        How many, by default.
    inclines
        Each rig's session is one drop at each; a block of A, B, B, A at one if not given.
    coefficients
        Whether those of the impacts are estimated too.
    """

    name: str
    protocol: str = UNIFORM
    settings: Mapping[str, str] = field(default_factory=dict)
    rigs: int = 20
    inclines: tuple[float, ...] | None = None
    coefficients: bool = False


def _resolved(name: str, **settings: str) -> CoverageCase:
    return CoverageCase(name, settings={"dynamics": "resolved"} | settings, inclines=STEEP)


CASES = (
    CoverageCase("model", rigs=260),
    _resolved("resolved, damped strings"),
    _resolved("resolved, dead strings", string_restitution="0.1"),
    _resolved("resolved, lively strings", string_restitution="0.7"),
    _resolved("resolved, no rods on rods", rods_touch="0"),
    _resolved("resolved, swinging", swing_sd="0.1 m/s"),
    _resolved("resolved, air", drag="0.03"),
    _resolved("resolved, dead board", restitution="0.3"),
    _resolved("resolved, slippery board", friction="0.05"),
    _resolved("resolved, stiff strings", string_strain="2 %"),
    _resolved("resolved, off centre", off_centre_sd="3 mm"),
    CoverageCase("model, air", settings={"drag": "0.03"}),
    CoverageCase("model, graded", GRADED),
    # The coefficients' truth is what is stated.
    CoverageCase("model, all inclines", settings={"impact_error": "0"}, inclines=EVERY,
                 coefficients=True),
)  # fmt: skip
"""A thousand drops of the model's world, and as many of the resolved one."""


def _rod(scene: dict[str, Any], mm: float) -> bool:
    """Move the middle rod of one chain."""
    chain = dict(scene["chains"]["A"])
    scene["chains"]["B"] = dict(chain)
    gaps = [float(chain.pop("length").removesuffix(" mm")) / (chain["rods"] - 1)] * 24
    gaps[11] += mm
    gaps[12] -= mm
    chain["spacing"] = [f"{gap:.9g} mm" for gap in gaps]
    scene["chains"]["A"] = chain
    return True


def _wide(scene: dict[str, Any], mm: float) -> bool:
    """A beam that is as wide sees every rod so much wider."""
    for name in scene["chains"]:
        scene["chains"][name] = dict(STANDARD.chain) | {"diameter": f"{12.7 + mm:g} mm"}
    return True


def _from_board(scene: dict[str, Any], mm: float) -> bool:
    """Everything was measured from the board, and is so much nearer to where rods touch."""
    for one in [scene, *scene["gates"]["impact"], *scene["gates"]["free"]]:
        key = "drop" if one is scene else "height"
        value, rest = one[key].split(" ", 1)
        one[key] = f"{float(value) - mm:.9g} {rest}"
    return True


_KNOWN = {one.name: one for one in WRONG_RIGS}
MISFITS = (
    WrongRig("rod off its place", NAMELESS, (2.0,), "mm", _rod),
    replace(_KNOWN["post's datum"], sizes=(0.5, 1.0, 2.0)),
    WrongRig("wide beam", NAMELESS, (2.0,), "mm", _wide),
    replace(_KNOWN["gravity"], sizes=(0.2,)),
    replace(_KNOWN["clock"], sizes=(-0.3,)),
    replace(_KNOWN["chain stretched"], sizes=(1.0,)),
    WrongRig("heights from the board", NAMELESS, (_FORGOTTEN_MM,), "mm", _from_board),
)
"""What a rig may be wrong in without its protocol allowing for it."""


@dataclass(slots=True)
class Held:
    """What became of the drops of one case.

    Attributes
    ----------
    errors
        Measured less true, by quantity.
    verdicts
        How many of each.
    beyond
        Void ones that truly are beyond the protocol's limit of skew.
    reasons
        Of the other void ones, and of the marginal ones.
    wrong
        Edges given to another rod than they came from.
    quiet, held
        Drops accepted without a word, and those of them whose Δz, V and skew all hold.
    """

    errors: dict[str, Errors] = field(default_factory=dict)
    verdicts: Counter[str] = field(default_factory=Counter)
    beyond: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    wrong: int = 0
    quiet: int = 0
    held: int = 0

    def add(self, name: str, measured: Measured, true: float, rig: int, incline: float) -> None:
        """Count one result, of all and of its incline."""
        for key in (name, f"{name}, {incline:g}°"):
            found = self.errors.setdefault(key, Errors())
            found.add(measured.value - true, measured.expanded, rig, measured.u)

    def json(self) -> dict[str, Any]:
        """Return the figures to report."""
        drops = self.verdicts.total()
        fair = drops - self.beyond
        void = sum(n for verdict, n in self.verdicts.items() if verdict not in GOOD) - self.beyond
        return {
            "drops": drops,
            "beyond": self.beyond,
            "void_share": void / max(1, fair),
            "marginal_share": self.verdicts["marginal"] / max(1, fair),
            "wrong": self.wrong,
            "quiet": self.quiet,
            "quiet_and_held": self.held,
            "quantities": {name: one.json() for name, one in self.errors.items()},
            "reasons": dict(self.reasons.most_common()),
        }


def merged(parts: Iterable[Held]) -> Held:
    """Join the drops of several parts of a case."""
    found = Held()
    for part in parts:
        for name, errors in part.errors.items():
            found.errors.setdefault(name, Errors()).join(errors)
        found.verdicts.update(part.verdicts)
        found.reasons.update(part.reasons)
        found.beyond += part.beyond
        found.wrong += part.wrong
        found.quiet += part.quiet
        found.held += part.held
    return found


def source(folder: str, case: CoverageCase) -> str:
    """Name the simulation of a case: every rig is off as its protocol says."""
    path = Path(folder) / case.protocol
    url = with_setting("sim://?stated=1", "protocol", str(path.resolve()))
    for name, value in case.settings.items():
        url = with_setting(url, name, value)
    return url


def sessions(protocol: Protocol, inclines: Sequence[float] | None, rigs: int) -> list[list[int]]:
    """Choose the runs of each rig."""
    if inclines is None:
        return blocks(protocol, rigs)
    by_incline: dict[float, list[int]] = {}
    for run in planned(protocol):
        by_incline.setdefault(run.incline_deg, []).append(run.number)
    return [
        sorted(by_incline[incline][rig % len(by_incline[incline])] for incline in inclines)
        for rig in range(rigs)
    ]


@one_thread
def held(folder: str, case: CoverageCase, rigs: Sequence[int]) -> Held:
    """Let chains fall on some rigs, and set every result beside what is true.

    Parameters
    ----------
    folder
        Where the ready protocols are.
    rigs
        Their seeds, from 1 on.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    protocol = reader.read(Path(folder) / case.protocol)
    chosen = sessions(protocol, case.inclines, max(rigs))
    asked = Asked(source(folder, case), rigs, [chosen[rig - 1] for rig in rigs])
    found = Held()
    usual = _usual(asked) if case.inclines is None else {}
    for seed, told in groupby(falls([asked]), key=attrgetter("seed")):
        session = list(told)
        analysis = _judged(protocol, session, time_scale(seed), found)
        _session(protocol, case, analysis, session, found)
        for line in analysis.summary if usual else ():
            for name, true in usual[seed].items():
                measured = line.means[name]
                one = found.errors.setdefault(f"mean {name}", Errors())
                one.add(measured.value - true, measured.expanded, seed, measured.u)
    return found


def _usual(asked: Asked) -> dict[int, dict[str, float]]:
    """Let the same rigs drop their chains with nothing that differs from drop to drop.

    It is what a mean over drops is an estimate of.
    """
    url = asked.url
    for name, nothing in {"impulse_sd": "0", "hang_sd": "0 mm", "skew_sd": "0 ms"}.items():
        url = with_setting(url, name, nothing)
    return {
        seed: {name: fmean(truth[name] for truth in truths) for name in _AVERAGED}
        for seed, told in groupby(falls([asked._replace(url=url)]), key=attrgetter("seed"))
        if (truths := [fall.truth for fall in told])
    }


def _judged(
    protocol: Protocol, session: Sequence[SimulatedDrop], scale: TimeScale, found: Held
) -> Analysis:
    """Analyse a rig's drops, and judge each."""
    by_run = {fall.drop.run: fall for fall in session}
    analysis = analyze(protocol, [fall.drop for fall in session], lambda _: scale)
    for result in analysis.runs:
        fall = by_run[result.run.number]
        found.verdicts[result.verdict] += 1
        skew = fall.truth["release_skew_s"]
        beyond = result.verdict not in GOOD and abs(skew) > protocol.accept.release_skew
        found.beyond += beyond
        if result.verdict != "accepted" and not beyond:
            found.reasons.update(f"{result.verdict}: {reason}" for reason in result.reasons[:1])
        if result.verdict not in GOOD:
            continue
        found.wrong += fall.rods(result.matches)[0]
        within = True
        for name, measured in result.quantities.items():
            true = fall.truth.get(name)
            if true is not None:
                found.add(name, measured, true, fall.seed, result.run.incline_deg)
                within &= name not in _WEIGHED or abs(measured.value - true) <= measured.expanded
        if not result.reasons:
            found.quiet += 1
            found.held += within
    return analysis


def _session(
    protocol: Protocol,
    case: CoverageCase,
    analysis: Analysis,
    session: Sequence[SimulatedDrop],
    found: Held,
) -> None:
    """Judge what drops of one rig say together: g, κ, and the coefficients."""
    seed = session[0].seed
    errors = found.errors

    def add(name: str, measured: Measured, true: float) -> None:
        one = errors.setdefault(name, Errors())
        one.add(measured.value - true, measured.expanded, seed, measured.u)

    scale = time_scale(seed)
    drops = {fall.drop.run: fall.drop for fall in session}
    check = check_gravity(protocol, ((one, drops[one.run.number], scale) for one in analysis.runs))
    if check is not None:
        add("gravity_m_s2", check.measured, session[0].truth["gravity_m_s2"])
    if analysis.joint is not None:
        joint, at = analysis.joint, analysis.joint.shared.blocks["drag"].start
        u = math.sqrt(joint.covariance[at, at]) * float(joint.sd[at])
        kappa = float(case.settings.get("drag", "0"))
        add("drag_per_m", Measured(float(joint.x[at]), u), kappa)
    if case.coefficients:
        said = estimate(protocol, analysis).coefficients
        for one in said.parameters if said is not None else ():
            if one.identified:
                add(one.name, one.least_squares, one.stated.value)


def misfits(folder: str, rigs: int) -> Iterator[tuple[str, Held]]:
    """Let chains fall on rigs that are wrong in one thing, a block at 40° on each.

    Parameters
    ----------
    folder
        Where their protocols are written.
    rigs
        Of each size of each fault, and of none.

    Yields
    ------
    str, Held
        What is wrong, and what became of the drops.
    """
    stated = FULL.protocol()
    protocol = reader.parse(stated)
    none = WrongRig("nothing", NAMELESS)
    for fault in (none, *MISFITS):
        for size, text in fault.rigs(stated):
            path = Path(folder) / "wrong.yaml"
            path.write_text(text, encoding="utf-8")
            runs = [run.number for run in planned(protocol) if run.incline_deg == 40.0]
            url = with_setting("sim://?stated=1", "protocol", str(path))
            found = Held()
            asked = Asked(url, range(1, rigs + 1), [runs] * rigs)
            for seed, told in groupby(falls([asked]), key=attrgetter("seed")):
                scale = time_scale(seed)
                slow = TimeScale(scale.hz / (1.0 - fault.slow(size)), scale.u)
                _judged(protocol, list(told), slow, found)
            yield f"{fault.name} {size:+g} {fault.unit}" if fault.unit else fault.name, found
