"""Accuracy of whole sessions against the simulation's hidden truth."""

from __future__ import annotations

import json
import math
import re
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from statistics import fmean, median, stdev
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.studies.baselines import plain_fit, two_gate_timer
from rig.analysis.result import GOOD
from rig.errors import InputError
from rig.ports import is_simulated, truth_file
from rig.results import detailed, protocol_of
from rig.runner import Operator, run_protocol
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from rig.analysis.result import DropResult
    from rig.protocol.protocol import Protocol
    from rig.records import Drop

_STRAY = -1  # the truth's rod number of what was no rod
_HELD = 0.95  # share of the truths that intervals are made to hold


@dataclass(slots=True)
class Errors:
    """Errors of one quantity: measured less true, with the expanded uncertainties."""

    errors: list[float] = field(default_factory=list)
    expanded: list[float] = field(default_factory=list)
    rigs: list[int] = field(default_factory=list)
    stated: list[float] = field(default_factory=list)

    def add(
        self, error: float, expanded: float = math.inf, rig: int = 0, u: float | None = None
    ) -> None:
        """Count one measurement on a rig, with its stated expanded and standard uncertainty."""
        self.errors.append(error)
        self.expanded.append(expanded)
        self.rigs.append(rig)
        if u is not None:
            self.stated.append(u)

    def join(self, other: Errors) -> None:
        """Count the measurements of others as well."""
        self.errors += other.errors
        self.expanded += other.expanded
        self.rigs += other.rigs
        self.stated += other.stated

    def json(self) -> dict[str, float | int]:
        """Rms, bias, largest error, mean and median U95, and share of intervals with the truth.

        Drops on one rig share errors: ``bias_se`` and ``coverage_se``, from rig to rig, say how
        well bias and coverage are known. ``bias_over_U`` is the bias in units of the mean U95, and
        ``times_u`` the rms over that of the stated standard uncertainties.
        """
        n = len(self.errors)
        held = [abs(error) <= u for error, u in zip(self.errors, self.expanded, strict=True)]
        bias, mean_u = sum(self.errors) / n, sum(self.expanded) / n
        found = {
            "n": n,
            "rms": math.sqrt(sum(error**2 for error in self.errors) / n),
            "bias": bias,
            "worst": max(map(abs, self.errors)),
            "mean_U95": mean_u,
            "median_U95": median(self.expanded),
            "bias_over_U": bias / mean_u,
            "coverage": sum(held) / n,
        }
        if self.stated:
            found["times_u"] = found["rms"] / math.sqrt(fmean(u**2 for u in self.stated))
        if len(set(self.rigs)) > 1:
            found["bias_se"] = self._between(self.errors)
            # Few misses tell little of how they scatter: so many independent errors there are.
            independent = (found["rms"] / found["bias_se"]) ** 2
            chance = math.sqrt(_HELD * (1.0 - _HELD) / independent)
            found["coverage_se"] = max(self._between(held), chance)
        return found

    def _between(self, values: Sequence[float]) -> float:
        """Standard error of a mean over rigs."""
        by_rig: dict[int, list[float]] = {}
        for rig, value in zip(self.rigs, values, strict=True):
            by_rig.setdefault(rig, []).append(value)
        means = [fmean(found) for found in by_rig.values()]
        return stdev(means) / math.sqrt(len(means))


@dataclass(slots=True)
class AccuracyTally:
    """Everything counted over all sessions."""

    quantities: dict[str, Errors] = field(default_factory=dict)
    camera: dict[str, Errors] = field(default_factory=dict)
    timer: dict[str, Errors] = field(default_factory=dict)
    verdicts: Counter[str] = field(default_factory=Counter)
    edges: int = 0
    wrong_rods: int = 0
    strays: int = 0
    speed_shares: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    analysis_s: float = 0.0
    plain_s: float = 0.0

    def add(
        self,
        protocol: Protocol,
        result: DropResult,
        drop: Drop,
        hz: float,
        truth: Mapping[str, Any],
    ) -> None:
        """Compare one drop with its truth; only accepted ones count as results."""
        self.verdicts[result.verdict] += 1
        if result.verdict not in GOOD:
            return
        self._matches(result, drop, hz, truth["edges"])
        rig = len(self.seconds)
        for name, measured in result.quantities.items():
            if truth.get(name) is not None:
                found = self.quantities.setdefault(name, Errors())
                found.add(measured.value - truth[name], measured.expanded, rig, measured.u)
        true = {"separation_m": truth.get("separation_raw_m"), "speed_m_s": truth.get("speed_m_s")}
        if "speed_m_s" in result.quantities:
            found_speed = result.quantities["speed_m_s"].value
            self.speed_shares.append(found_speed / truth["speed_m_s"] - 1.0)
        timer = two_gate_timer(protocol, drop, hz)
        for name, value in true.items():
            reading = truth.get(f"camera_{name}")
            if value is not None and reading is not None:
                self.camera.setdefault(name, Errors()).add(reading - value)
            if value is not None and timer is not None:
                self.timer.setdefault(name, Errors()).add(getattr(timer, name) - value)
        begin = time.process_time()
        plain_fit(protocol, drop, result, hz)
        self.plain_s += time.process_time() - begin

    def _matches(
        self, result: DropResult, drop: Drop, hz: float, edges: Iterable[list[Any]]
    ) -> None:
        """Count edges taken for another rod than they came from."""
        origins: dict[tuple[int, bool], list[tuple[float, int]]] = {}
        for when, channel, blocked, rod in edges:
            origins.setdefault((channel, blocked), []).append((when, rod))
        seen: dict[tuple[int, bool], list[tuple[float, int]]] = {}
        for number, rod in result.matches.items():
            edge = drop.edges[number]
            seen.setdefault((edge.channel, edge.blocked), []).append((edge.tick / hz, rod))
        for key, pairs in seen.items():
            times, rods = np.array(pairs).T
            moments, true = np.array(origins[key]).T
            nearest = true[np.abs(times[:, None] - moments).argmin(axis=1)]
            self.edges += times.size
            self.strays += int((nearest == _STRAY).sum())
            self.wrong_rods += int(((nearest != _STRAY) & (nearest != rods)).sum())

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
        if self.speed_shares:
            found["speed_rms_relative"] = math.sqrt(fmean(one**2 for one in self.speed_shares))
        for baseline, errors in (("camera_480_fps", self.camera), ("two_gate_timer", self.timer)):
            if errors:
                found[baseline] = {name: _plain(one) for name, one in errors.items()}
        found["analysis_ms_per_run"] = 1e3 * self.analysis_s / self.verdicts.total()
        if self.plain_s:
            results = sum(self.verdicts[verdict] for verdict in GOOD)
            found["plain_fit_ms_per_run"] = 1e3 * self.plain_s / results
        found["wall_time_s"] = self.seconds
        return found


def _plain(errors: Errors) -> dict[str, float]:
    """Figures of an instrument that states no uncertainty."""
    return {
        "rms": math.sqrt(fmean(error**2 for error in errors.errors)),
        "median": median(map(abs, errors.errors)),
        "bias": fmean(errors.errors),
        "worst": max(map(abs, errors.errors)),
    }


def accuracy(
    protocol: str,
    url: str,
    seeds: int,
    say: Callable[[str], None],
    repeats: int | None = None,
) -> dict[str, Any]:
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
    repeats
        Drops at each incline, where not those of the protocol. Drops on one rig share errors, so
        that many short sessions tell more about intervals than few long ones.

    Raises
    ------
    InputError
        A port that is no simulation has no truth to compare with.
    """
    if not is_simulated(url):
        raise InputError(f"{url} is no simulation", "only a simulation knows the truth: sim://")
    tally = AccuracyTally()
    with TemporaryDirectory() as folder:
        source = repeated(protocol, repeats, Path(folder)) if repeats else protocol
        for seed in range(1, seeds + 1):
            path = Path(folder) / f"{seed}.session"
            begin = time.perf_counter()
            run_protocol(source, url, str(path), Operator(lambda _: None), seed)
            tally.seconds.append(time.perf_counter() - begin)
            lines = truth_file(path).read_text(encoding="utf-8").splitlines()
            truths = {(t["run"], t["attempt"]): t for t in map(json.loads, lines)}
            with Session.open(path, readonly=True) as session:
                begin = time.process_time()
                found, clock = detailed(session)
                tally.analysis_s += time.process_time() - begin
                scene = protocol_of(session)
                drops = {(drop.run, drop.attempt): drop for drop in session.drops()}
            for result in (*found.runs, *found.superseded):
                key = result.run.number, result.attempt
                tally.add(scene, result, drops[key], clock.scale(drops[key]).hz, truths[key])
            say(f"session {seed} of {seeds}: {tally.seconds[-1]:.1f} s")
    return tally.json()


def repeated(protocol: str, repeats: int, folder: Path) -> str:
    """Write the protocol again with another number of drops at each incline."""
    text = Path(protocol).read_text(encoding="utf-8")
    changed, n = re.subn(r"(\brepeats:\s*)\d+", rf"\g<1>{repeats}", text)
    if n != 1:
        raise InputError(f"{protocol}: the plan says {n} times how many repeats", "write it once")
    copy = folder / "repeated.yaml"
    copy.write_text(changed, encoding="utf-8")
    return str(copy)
