"""How well sessions are read whose chains fall by no model: the resolved world, case by case."""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from subprocess import PIPE, run
from typing import TYPE_CHECKING, Any

from bench.studies.accuracy import Errors
from rig.analysis.result import GOOD
from rig.analysis.session import analyze
from rig.bench.falls import Asked, falls, time_scale, with_setting
from rig.errors import RigError
from rig.films import Film
from rig.protocol import reader
from rig.protocol.plan import runs as planned
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from rig.analysis.result import DropResult
    from rig.bench.falls import SimulatedDrop
    from rig.protocol.protocol import Protocol

UNIFORM, GRADED = "inclined-uniform.yaml", "graded-chain.yaml"
DROPS = 4
"""At each incline of a session, a block A, B, B, A; three times as many where there is but one. All
cases take some three minutes of a processor."""


@dataclass(frozen=True, slots=True)
class WorldCase:
    """A session: which chains, and how the resolved world differs from its default."""

    name: str
    protocol: str
    settings: Mapping[str, str] = field(default_factory=dict)


CASES = (
    WorldCase("damped strings", UNIFORM),
    WorldCase("dead strings", UNIFORM, {"string_restitution": "0.1"}),
    WorldCase("lively strings", UNIFORM, {"string_restitution": "0.7"}),
    WorldCase("no rods on rods", UNIFORM, {"rods_touch": "0"}),
    WorldCase("swinging", UNIFORM, {"swing_sd": "0.1 m/s"}),
    WorldCase("air", UNIFORM, {"drag": "0.03"}),
    WorldCase("graded", GRADED),
    WorldCase("graded, lively", GRADED, {"string_restitution": "0.7"}),
    WorldCase("graded, air", GRADED, {"drag": "0.03"}),
)
"""One difference at a time; the first and the seventh are the world's defaults."""
_NUMBER = re.compile(r"[-+−]?\d[\d.,]*(?:e[-+]?\d+)?")


@dataclass(frozen=True, slots=True)
class JudgedDrop:
    """One drop beside its truth.

    Attributes
    ----------
    beyond
        Whether it truly is beyond the protocol's limit of skew, so that it has to be void.
    errors
        Measured less true by measurand, with the expanded and the standard uncertainty; of good
        drops only.
    wrong
        Edges given to another rod than they came from.
    """

    case: str
    incline_deg: float
    run: int
    verdict: str
    reasons: tuple[str, ...]
    beyond: bool
    errors: Mapping[str, tuple[float, ...]]
    wrong: int
    truth: Mapping[str, Any]


def study(
    folder: str, drops: int, cases: Sequence[WorldCase], say: Callable[[str], None]
) -> list[JudgedDrop]:
    """Let chains fall in every case, and read them.

    Parameters
    ----------
    folder
        Where the ready protocols are.
    drops
        At each incline.
    cases
        Sessions; one rig each.
    say
        Told how far it is.
    """
    scenes = {one.protocol: reader.read(Path(folder) / one.protocol) for one in cases}
    asked = [_asked(Path(folder), one, scenes[one.protocol], drops) for one in cases]
    made = falls(asked)
    found: list[JudgedDrop] = []
    for one, request in zip(cases, asked, strict=True):
        session = list(islice(made, len(request.runs[0])))
        found += judge(one.name, scenes[one.protocol], session)
        say(f"{one.name}: {len(session)} drops")
    return found


def _asked(folder: Path, case: WorldCase, protocol: Protocol, drops: int) -> Asked:
    url = with_setting(
        "sim://?dynamics=resolved", "protocol", str((folder / case.protocol).resolve())
    )
    for name, value in case.settings.items():
        url = with_setting(url, name, value)
    by_incline: dict[float, list[int]] = {}
    for one in planned(protocol):
        by_incline.setdefault(one.incline_deg, []).append(one.number)
    each = drops if len(by_incline) > 1 else 3 * drops
    return Asked(url, [1], [sorted(n for some in by_incline.values() for n in some[:each])])


@one_thread
def judge(case: str, protocol: Protocol, session: Sequence[SimulatedDrop]) -> list[JudgedDrop]:
    """Analyse a session and set every drop beside its truth."""
    scale = time_scale(session[0].seed)
    by_run = {fall.drop.run: fall for fall in session}
    found = analyze(protocol, [fall.drop for fall in session], lambda _: scale)
    return [_judged(case, protocol, result, by_run[result.run.number]) for result in found.runs]


def _judged(case: str, protocol: Protocol, result: DropResult, fall: SimulatedDrop) -> JudgedDrop:
    truth = fall.truth
    errors = {
        name: (measured.value - truth[name], measured.expanded, measured.u)
        for name, measured in result.quantities.items()
        if result.verdict in GOOD and truth.get(name) is not None
    }
    return JudgedDrop(
        case,
        result.run.incline_deg,
        result.run.number,
        result.verdict,
        tuple(reason.code for reason in result.reasons),
        abs(truth["release_skew_s"]) > protocol.accept.release_skew,
        errors,
        fall.rods(result.matches)[0] if result.verdict in GOOD else 0,
        truth,
    )


def summary(drops: Sequence[JudgedDrop]) -> dict[str, Any]:
    """Sum up some drops.

    Returns
    -------
    dict
        ``drops``, ``beyond``, ``void_share`` of those that are not, ``wrong`` drops, ``quantities``
        (as `bench.studies.accuracy.Errors.json` gives them), and the ``reasons`` of false voids.
    """
    fair = [one for one in drops if not one.beyond]
    void = [one for one in fair if one.verdict not in GOOD]
    errors: dict[str, Errors] = {}
    for one in drops:
        for name, (error, expanded, u) in one.errors.items():
            errors.setdefault(name, Errors()).add(error, expanded, u=u)
    reasons = Counter(reason for one in void for reason in one.reasons)
    return {
        "drops": len(drops),
        "beyond": len(drops) - len(fair),
        "void_share": len(void) / max(1, len(fair)),
        "wrong": sum(one.wrong > 0 for one in drops),
        "quantities": {name: one.json() for name, one in errors.items()},
        "reasons": dict(reasons.most_common()),
    }


def as_json(drops: Sequence[JudgedDrop]) -> dict[str, Any]:
    """All summaries: by case, and by incline within each."""
    return {
        "cases": [{"case": name} | summary(some) for name, some in _by_case(drops)],
        "inclines": [
            {"case": name, "incline_deg": incline} | _inclined(some, incline)
            for name, some in _by_case(drops)
            for incline in sorted({one.incline_deg for one in some})
        ],
    }


def _inclined(drops: Sequence[JudgedDrop], incline: float) -> dict[str, Any]:
    some = [one for one in drops if one.incline_deg == incline]
    return summary(some) | {
        "true": {
            name: sum(one.truth[name] for one in some) / len(some)
            for name in ("separation_m", "separation_strike_m", "speed_m_s", "contact_height_m")
        }
    }


def _by_case(drops: Sequence[JudgedDrop]) -> Iterator[tuple[str, list[JudgedDrop]]]:
    for name in dict.fromkeys(one.case for one in drops):
        yield name, [one for one in drops if one.case == name]


def work() -> list[dict[str, Any]]:
    """Measure error against run time of the resolved world's step and touches.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    return _lines("sim.work_precision")


def published() -> list[dict[str, Any]]:
    """Let the chains of other experiments fall, see `sim.published`.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    return _lines("sim.published")


def _lines(module: str) -> list[dict[str, Any]]:
    done = run([sys.executable, "-m", module], stdout=PIPE, text=True, check=False)  # noqa: S603 - our own
    if done.returncode:
        raise RigError(f"the simulation ended with exit code {done.returncode}")
    return [json.loads(line) for line in done.stdout.splitlines()]


def film(folder: str, incline_deg: float) -> Film:
    """Let the uniform chain fall onto a board once, to be drawn.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    path = Path(folder) / UNIFORM
    number = next(
        one.number for one in planned(reader.read(path)) if one.incline_deg == incline_deg
    )
    url = with_setting("sim://?dynamics=resolved&film=1", "protocol", str(path.resolve()))
    (made,) = falls([Asked(url, [1], [[number]])])
    return Film(**made.truth["film"])
