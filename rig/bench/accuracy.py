"""Accuracy of whole sessions against the simulation's hidden truth."""

from __future__ import annotations

import json
import math
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from rig.errors import InputError
from rig.ports import is_simulated, truth_file
from rig.results import detailed
from rig.runner import Operator, run_protocol
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from rig.analysis.result import DropResult
    from rig.records import Drop

_STRAY = -1  # the truth's rod number of what was no rod


@dataclass(slots=True)
class Errors:
    """Errors of one quantity: measured less true, with the expanded uncertainties."""

    errors: list[float] = field(default_factory=list)
    expanded: list[float] = field(default_factory=list)

    def json(self) -> dict[str, float | int]:
        """Rms, bias, largest error, mean U95, and the share of intervals that hold the truth."""
        n = len(self.errors)
        held = sum(abs(error) <= u for error, u in zip(self.errors, self.expanded, strict=True))
        return {
            "n": n,
            "rms": math.sqrt(sum(error**2 for error in self.errors) / n),
            "bias": sum(self.errors) / n,
            "worst": max(map(abs, self.errors)),
            "mean_U95": sum(self.expanded) / n,
            "coverage": held / n,
        }


@dataclass(slots=True)
class Tally:
    """Everything counted over all sessions."""

    quantities: dict[str, Errors] = field(default_factory=dict)
    camera: dict[str, Errors] = field(default_factory=dict)
    verdicts: Counter[str] = field(default_factory=Counter)
    edges: int = 0
    wrong_rods: int = 0
    strays: int = 0
    seconds: list[float] = field(default_factory=list)

    def add(self, result: DropResult, drop: Drop, hz: float, truth: Mapping[str, Any]) -> None:
        """Compare one drop with its truth; only accepted ones count as results."""
        self.verdicts[result.verdict] += 1
        if result.verdict not in {"accepted", "marginal"}:
            return
        self._matches(result, drop, hz, truth["edges"])
        for name, measured in result.quantities.items():
            if truth.get(name) is not None:
                found = self.quantities.setdefault(name, Errors())
                found.errors.append(measured.value - truth[name])
                found.expanded.append(measured.expanded)
        for name, true in (("separation_m", "separation_raw_m"), ("speed_m_s", "speed_m_s")):
            reading = truth.get(f"camera_{name}")
            if reading is not None:
                found = self.camera.setdefault(name, Errors())
                found.errors.append(reading - truth[true])
                found.expanded.append(math.inf)

    def _matches(
        self, result: DropResult, drop: Drop, hz: float, edges: Iterable[list[Any]]
    ) -> None:
        """Count edges taken for another rod than they came from."""
        origins: dict[tuple[int, bool], list[tuple[float, int]]] = {}
        for when, channel, blocked, rod in edges:
            origins.setdefault((channel, blocked), []).append((when, rod))
        for number, rod in result.matches.items():
            self.edges += 1
            edge = drop.edges[number]
            _, true = min(
                origins[edge.channel, edge.blocked],
                key=lambda origin: abs(origin[0] - edge.tick / hz),
            )
            if true == _STRAY:
                self.strays += 1
            elif true != rod:
                self.wrong_rods += 1

    def json(self) -> dict[str, Any]:
        """Return the figures to report."""
        found: dict[str, Any] = {
            "sessions": len(self.seconds),
            "verdicts": dict(sorted(self.verdicts.items())),
            "edges_matched": self.edges,
            "edges_given_to_a_wrong_rod": self.wrong_rods,
            "strays_taken_for_a_rod": self.strays,
            "quantities": {name: errors.json() for name, errors in self.quantities.items()},
        }
        if self.camera:
            found["camera_480_fps"] = {
                name: {key: errors.json()[key] for key in ("rms", "bias", "worst")}
                for name, errors in self.camera.items()
            }
        found["wall_time_s"] = self.seconds
        return found


def accuracy(protocol: str, url: str, seeds: int, say: Callable[[str], None]) -> dict[str, Any]:
    """Run whole simulated sessions and compare every drop with its truth.

    Parameters
    ----------
    protocol
        The protocol file.
    url
        The simulation, with dials if wanted.
    seeds
        Sessions 1, 2, … to simulate.
    say
        Told how far it is.

    Raises
    ------
    InputError
        A port that is no simulation has no truth to compare with.
    """
    if not is_simulated(url):
        raise InputError(f"{url} is no simulation", "only a simulation knows the truth: sim://")
    tally = Tally()
    with TemporaryDirectory() as folder:
        for seed in range(1, seeds + 1):
            path = Path(folder) / f"{seed}.session"
            begin = time.perf_counter()
            run_protocol(protocol, url, str(path), Operator(lambda _: None), seed)
            tally.seconds.append(time.perf_counter() - begin)
            lines = truth_file(path).read_text(encoding="utf-8").splitlines()
            truths = {(t["run"], t["attempt"]): t for t in map(json.loads, lines)}
            with Session.open(path, readonly=True) as session:
                found, clock = detailed(session)
                drops = {(drop.run, drop.attempt): drop for drop in session.drops()}
            for result in (*found.runs, *found.superseded):
                key = result.run.number, result.attempt
                tally.add(result, drops[key], clock.scale(drops[key]).hz, truths[key])
            say(f"session {seed} of {seeds}: {tally.seconds[-1]:.1f} s")
    return tally.json()
