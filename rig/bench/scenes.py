"""What each scene costs, from the simplest to the richest, and how little the simpler ones.

Counts are the same on every run of one Python version. Times are not: every scene is timed in
every round, ratios are taken within a round, and medians are given with their quartiles.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from rig.errors import RigError
from rig.predictions import predictions
from rig.protocol.reader import parse

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from rig.protocol.protocol import Protocol

PACKAGES = ("numpy", "yaml", "scipy", "matplotlib")
"""Large packages that a scene may or may not load."""
_PROBE = "from rig.bench.scene_probe import main; main()"
_PROBES = 3
_ROOT = Path(__file__).parents[2]
_TURN_S = 0.002  # long for the clock, short between two interruptions

_LEVEL = "surface: {restitution: 0.50}\n"
_INCLINED = "surface: {restitution: 0.50, friction: 0.20}\n"
_UNSURE = "surface: {restitution: 0.50 ± 0.05, friction: 0.20 ± 0.02}\n"
_DROP, _UNSURE_DROP = "drop: 180 mm\n", "drop: 180 mm ± 2 mm\n"
_PLAN = "plan: {incline: 40 deg}\n"
_PLANS = "plan: {incline: [30 deg, 40 deg, 50 deg, 60 deg, 70 deg, 80 deg], randomize: incline}\n"
_GATES = """\
gates:
  impact: [{channel: 0, height: 22 mm}, {channel: 1, height: 34 mm}]
  free: [{channel: 8, height: 20 mm}, {channel: 9, height: 60 mm}]
release: {channel: 0, pulse: 80 ms}
accept: {release_skew: 5 ms, missed_edges: 5 %}
"""


@dataclass(frozen=True, slots=True)
class LadderScene:
    """A protocol to be measured.

    Attributes
    ----------
    name
        Short, for tables.
    text
        The protocol.
    """

    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Quartiles:
    """Median and quartiles of all rounds."""

    median: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Account:
    """What does not depend on the machine's mood.

    Attributes
    ----------
    modules
        Names of all modules that ``rig predict`` has loaded, Python's own included.
    peak_bytes
        Most memory resident.
    operations
        Bytecodes to ``read``, ``describe`` and ``predict``.
    evaluations
        How often the prediction evaluates what `rig.bench.scene_probe.COUNTED` names.
    """

    modules: tuple[str, ...]
    peak_bytes: float
    operations: dict[str, int]
    evaluations: dict[str, int]

    @property
    def packages(self) -> tuple[str, ...]:
        """Those of `PACKAGES` that are loaded."""
        return tuple(name for name in PACKAGES if name in self.modules)

    @property
    def rooms(self) -> tuple[str, ...]:
        """Our own modules."""
        return tuple(name for name in self.modules if name.partition(".")[0] == "rig")


@dataclass(frozen=True, slots=True)
class Cost:
    """One line of the table.

    Attributes
    ----------
    seconds
        Of the whole commands ``check`` and ``predict``, Python's start included, and of the
        prediction alone (``compute``).
    ratios
        The same over those of the simplest scene.
    """

    scene: str
    account: Account
    seconds: dict[str, Quartiles]
    ratios: dict[str, Quartiles]


def ladder() -> list[LadderScene]:
    """The paper's chain, from free fall to the whole experiment."""
    two = "  B: {like: A}\n"
    air = "drag: {terminal_speed: 25 m/s}\n"
    return [
        LadderScene("free fall", _scene()),
        LadderScene(
            "α given, level", _scene("surface: {}\n", _DROP, keys=", alpha: 0.25, gamma: 1")
        ),
        LadderScene("level surface", _scene(_LEVEL, _DROP)),
        LadderScene("inclined", _scene(_INCLINED, _DROP, _PLAN)),
        LadderScene("± on β, μ, drop", _scene(_UNSURE, _UNSURE_DROP, _PLAN)),
        LadderScene("second chain", _scene(two, _UNSURE, _UNSURE_DROP, _PLAN)),
        LadderScene("six inclines", _scene(two, _UNSURE, _UNSURE_DROP, _PLANS)),
        LadderScene("gates", _scene(two, _UNSURE, _UNSURE_DROP, _PLANS, _GATES)),
        LadderScene("drag, no gates", _scene(two, _UNSURE, _UNSURE_DROP, _PLANS, air)),
    ]


def _scene(*parts: str, keys: str = "") -> str:
    return f"""\
protocol: 1
title: measured
gravity: 9.81 m/s^2
chains:
  A: {{rods: 25, length: 1165 mm, diameter: 12.7 mm, tilt: 12 deg{keys}}}
{"".join(parts)}"""


def scenes(
    ready: Iterable[Path], rounds: int, say: Callable[[str], None] = lambda _: None
) -> list[Cost]:
    """Measure every scene of `ladder`, then ready protocols.

    Parameters
    ----------
    ready
        Protocol files; they come in order of what a prediction takes.
    rounds
        Of timing.
    say
        Told what goes on.

    Raises
    ------
    InputError
        If a protocol file is bad.
    RigError
        If a scene's process fails.
    """
    extra = [LadderScene(path.stem, path.read_text("utf-8")) for path in ready]
    with TemporaryDirectory() as folder:
        measured = [*ladder(), *extra]
        files = [Path(folder) / f"{number}.yaml" for number in range(len(measured))]
        read = [parse(scene.text, scene.name) for scene in measured]
        for scene, file in zip(measured, files, strict=True):
            file.write_text(scene.text, "utf-8")
        say("counting …")
        accounts = [account(file) for file in files]
        say("timing …")
        times = _time_in_turns(files, read, rounds)
    costs = [
        Cost(scene.name, counted, _spreads(seconds), _ratios(seconds, times[0]))
        for scene, counted, seconds in zip(measured, accounts, times, strict=True)
    ]
    steps = len(costs) - len(extra)
    by_work = sorted(costs[steps:], key=lambda cost: cost.account.operations["predict"])
    return [*costs[:steps], *by_work]


def account(file: Path) -> Account:
    """Have a fresh process predict a protocol and tell what that took.

    Raises
    ------
    RigError
        If the process fails, or counts differently when asked again.
    """
    reports = [json.loads(_child("-c", _PROBE, str(file))) for _ in range(_PROBES)]
    peak = statistics.median(report.pop("peak_bytes") for report in reports)
    first, *repeats = reports
    if any(repeat != first for repeat in repeats):
        raise RigError(f"{file.name}: two equal runs do not count the same")
    return Account(tuple(first["modules"]), peak, first["operations"], first["evaluations"])


def _child(*arguments: str) -> str:
    """Run Python and return what it prints."""
    search = os.pathsep.join([str(_ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        encoding="utf-8",
        check=False,
        env={**os.environ, "PYTHONPATH": search, "PYTHONHASHSEED": "0", "PYTHONUTF8": "1"},
    )
    if done.returncode:
        raise RigError("a scene could not be measured", done.stderr.strip())
    return done.stdout


def _time_in_turns(
    files: Sequence[Path], protocols: Sequence[Protocol], rounds: int
) -> list[dict[str, list[float]]]:
    """Seconds by scene and kind, one a round."""
    times: list[dict[str, list[float]]] = [
        {"check": [], "predict": [], "compute": []} for _ in files
    ]
    turns = []
    for protocol in protocols:
        _seconds(protocol, 3)  # a first call is slow
        turns.append(max(1, round(_TURN_S / _seconds(protocol, 3))))
    for _ in range(rounds):
        for file, protocol, often, seconds in zip(files, protocols, turns, times, strict=True):
            for command in ("check", "predict"):
                begin = time.perf_counter()
                _child("-m", "rig", command, str(file))
                seconds[command].append(time.perf_counter() - begin)
            seconds["compute"].append(_seconds(protocol, often))
    return times


def _seconds(protocol: Protocol, turns: int) -> float:
    begin = time.perf_counter()
    for _ in range(turns):
        predictions(protocol)
    return (time.perf_counter() - begin) / turns


def _spreads(times: Mapping[str, Sequence[float]]) -> dict[str, Quartiles]:
    return {kind: _spread(values) for kind, values in times.items()}


def _ratios(
    times: Mapping[str, Sequence[float]], simplest: Mapping[str, Sequence[float]]
) -> dict[str, Quartiles]:
    return {
        kind: _spread([a / b for a, b in zip(values, simplest[kind], strict=True)])
        for kind, values in times.items()
    }


def _spread(values: Sequence[float]) -> Quartiles:
    if len(values) == 1:
        return Quartiles(values[0], values[0], values[0])
    low, median, high = statistics.quantiles(values, n=4, method="inclusive")
    return Quartiles(median, low, high)


def as_json(costs: Sequence[Cost]) -> dict[str, Any]:
    """Everything as plain objects; ``added`` lists what a scene loads beyond the simplest."""
    simplest = set(costs[0].account.modules)
    return {
        "python": sys.version.split()[0],
        "scenes": [
            {
                **asdict(cost),
                "packages": cost.account.packages,
                "added": [name for name in cost.account.modules if name not in simplest],
            }
            for cost in costs
        ],
    }
