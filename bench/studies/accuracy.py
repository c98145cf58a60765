"""Errors in the model's world: sessions compared with the simulation's hidden truth.

Drops on one rig share errors, so many rigs with few drops each tell most about intervals: those
fall straight from the simulation into the analysis. What is true goes to the tally alone.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from statistics import fmean, median
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.studies.disturbances import DOUBLED, STACK
from bench.studies.errors import Errors, shares_held
from bench.studies.sessions import SimulatedSession, with_device, without_device
from bench.workers import results
from rig.analysis.result import GOOD
from rig.bench.falls import STRAY, Asked, simulation, with_settings
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.measurands import MEASURANDS
from rig.protocol import reader
from rig.protocol.plan import runs
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping

    from rig.analysis.result import DropResult
    from rig.bench.falls import SimulatedDrop
    from rig.protocol.protocol import Protocol

    Figures = Mapping[str, Any]

SESSIONS = 5
"""Of the whole protocol, through the whole stack."""
RIGS = 260
"""Short sessions for each dial: with 4 drops each, more than a thousand."""
BLOCK = 4
"""Drops in a block: A, B, B, A."""
_HEAD = """\
# Errors in the model's world

`./run bench accuracy`: simulated sessions through board, line and file, compared with the true
values. *In U95*: how often ± U holds the true value (95 % is intended). *rms / u*: rms error over
the stated standard uncertainty."""


@dataclass(slots=True)
class AccuracyTally:
    """Everything counted over all sessions."""

    quantities: dict[str, Errors] = field(default_factory=lambda: defaultdict(Errors))
    verdicts: Counter[str] = field(default_factory=Counter)
    edges: int = 0
    wrong_rods: int = 0
    strays: int = 0
    speed_shares: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    analysis_s: float = 0.0

    def add(self, session: SimulatedSession) -> None:
        """Compare the drops of a session with their truths; only accepted ones have results."""
        for result, fall, scale in session.results():
            self.verdicts[result.verdict] += 1
            if result.verdict in GOOD:
                self._matches(result, fall, scale.hz)
                self._quantities(result, fall.truth)
        self.seconds.append(session.wall_s)
        self.analysis_s += session.analysis_s

    def _quantities(self, result: DropResult, truth: Figures) -> None:
        for name, measured in result.quantities.items():
            if truth.get(name) is not None:
                self.quantities[name].add(measured, truth[name], len(self.seconds))
        if "speed_m_s" in result.quantities:
            speed = result.quantities["speed_m_s"].value
            self.speed_shares.append(speed / truth["speed_m_s"] - 1.0)

    def _matches(self, result: DropResult, fall: SimulatedDrop, hz: float) -> None:
        """Count edges taken for another rod than they came from."""
        origins: dict[tuple[int, bool], list[tuple[float, int]]] = defaultdict(list)
        for when, channel, blocked, rod in fall.truth["edges"]:
            origins[channel, blocked].append((when, rod))
        matches: dict[tuple[int, bool], list[tuple[float, int]]] = defaultdict(list)
        for number, rod in result.matches.items():
            edge = fall.drop.edges[number]
            matches[edge.channel, edge.blocked].append((edge.tick / hz, rod))
        for key, pairs in matches.items():
            times, rods = np.array(pairs).T
            moments, true = np.array(origins[key]).T
            nearest = true[np.abs(times[:, None] - moments).argmin(axis=1)]
            self.edges += times.size
            self.strays += int((nearest == STRAY).sum())
            self.wrong_rods += int(((nearest != STRAY) & (nearest != rods)).sum())

    def json(self) -> dict[str, Any]:
        """Return the figures to report."""
        figures: dict[str, Any] = {
            "sessions": len(self.seconds),
            "verdicts": dict(sorted(self.verdicts.items())),
            "edges_matched": self.edges,
            "edges_given_to_a_wrong_rod": self.wrong_rods,
            "strays_taken_for_a_rod": self.strays,
            "quantities": {name: errors.json() for name, errors in self.quantities.items()},
        }
        if self.speed_shares:
            squares = (share**2 for share in self.speed_shares)
            figures["speed_rms_relative"] = math.sqrt(fmean(squares))
        figures["analysis_ms_per_run"] = 1e3 * self.analysis_s / self.verdicts.total()
        return figures | {"wall_time_s": self.seconds}


def whole_sessions(
    protocol: str, url: str, seeds: int, repeats: int | None = None
) -> dict[str, Any]:
    """Compare sessions through device, line, daemon and file, of rigs 1, 2, …, with their truth."""
    tally = AccuracyTally()
    for seed in range(1, seeds + 1):
        tally.add(with_device(protocol, url, seed, repeats))
        say(f"session {seed} of {seeds}: {tally.seconds[-1]:.1f} s")
    return tally.json()


def short_sessions(protocol: str, url: str, rigs: int) -> dict[str, Any]:
    """Compare one short session on each of many rigs with its truth: one block of drops.

    Parameters
    ----------
    url
        ``sim://``, with dials if wanted. Those of the clock and the line change nothing here.
    """
    scene = reader.read(protocol)
    tally = AccuracyTally()
    asked = Asked(simulation(protocol, url=url), range(1, rigs + 1), blocks(scene, rigs))
    for session in without_device([(scene, asked)]):
        tally.add(session)
    return tally.json()


def blocks(protocol: Protocol, rigs: int) -> list[list[int]]:
    """Choose the runs of each rig: a whole block, and over the rigs all of the plan's alike."""
    by_incline: dict[float, list[int]] = defaultdict(list)
    for run in runs(protocol):
        by_incline[run.incline_deg].append(run.number)
    most = max(map(len, by_incline.values()))
    whole = [
        numbers[first : first + BLOCK]
        for first in range(0, most, BLOCK)
        for numbers in by_incline.values()
        if numbers[first : first + BLOCK]
    ]
    return [whole[rig % len(whole)] for rig in range(rigs)]


def run(arguments: Namespace) -> Iterator[Findings]:
    """Measure accuracy over several simulated sessions."""
    if arguments.doubled:
        cases = dict(_doubled_cases(arguments))
        lines = [*_table(cases["default"]), "", *acceptance_table(cases)]
        yield Findings(cases, lines, _HEAD)
    else:
        seeds = arguments.seeds or SESSIONS
        figures = whole_sessions(arguments.protocol, arguments.port, seeds, arguments.repeats)
        yield Findings(figures, _table(figures), _HEAD)


def _doubled_cases(arguments: Namespace) -> Iterator[tuple[str, dict[str, Any]]]:
    """Measure with each dial of the simulation doubled, many rigs each, several at a time."""
    rigs, protocol = arguments.seeds or RIGS, arguments.protocol
    ports = {dial: with_settings(arguments.port, {dial: size}) for dial, size in DOUBLED.items()}
    ports = {"default": arguments.port} | ports
    calls: dict[str, tuple[Any, ...]] = {
        dial: (short_sessions, protocol, port, rigs)
        for dial, port in ports.items()
        if dial not in STACK
    }
    calls |= {
        f"{dial}, whole stack": (whole_sessions, protocol, ports[dial], 1, BLOCK)
        for dial in ("default", *STACK)
    }
    for name, case in zip(calls, results([*calls.values()], arguments.jobs), strict=True):
        say(f"{name}: {sum(case['verdicts'].values())} drops")
        yield name, case


def _table(figures: Figures) -> list[str]:
    verdicts = ", ".join(f"{n} {verdict}" for verdict, n in figures["verdicts"].items())
    rows = [["error of one run", "rms", "bias", "worst", "mean U95", "bias/U", "in U95", "rms / u"]]
    for name, errors in figures["quantities"].items():
        rows.append([
            *_sizes(name, errors, "rms", "bias", "worst", "mean_U95"),
            f"{errors['bias_over_U']:.2f}", " ".join(shares_held(errors, 1)).rstrip(),
            f"{errors['times_u']:.2f}",
        ])  # fmt: skip
    own = figures["analysis_ms_per_run"]
    return [
        f"{figures['sessions']} simulated sessions, drops: {verdicts}",
        f"{figures['edges_matched']} edges matched, {figures['edges_given_to_a_wrong_rod']} to a "
        f"wrong rod, {figures['strays_taken_for_a_rod']} strays taken for a rod",
        *text_table(rows, left={0}),
        f"analysis of a run with learning: {own:.0f} ms of processor time",
        f"wall time of a session: median {median(figures['wall_time_s']):.1f} s",
    ]


def _sizes(name: str, errors: Figures, *sizes: str) -> list[str]:
    """Write a measurand's name, and sizes in its fine unit."""
    row = MEASURANDS[name]
    return [
        f"{row.label} ({row.fine})",
        *(f"{errors[size] * row.fine_scale:.3f}" for size in sizes),
    ]


LIMITS = {
    "separation_m": ("Δz", "mm", 1e3, 0.5e-3),
    "speed_m_s": ("V", "%", 1e2, 3e-3),
    "release_skew_s": ("skew", "ms", 1e3, 0.1e-3),
}
"""Quantity → name, unit, factor, largest rms error of one run; of V relative."""
BIAS = 0.1
"""Largest bias of the mean, in units of the mean U95 of one run."""
COVERAGE = (0.93, 0.97)
"""Share of the truths that 95 % intervals should hold."""
_SURE = 2.0  # standard errors: what differs by less may be chance
_NAMES = {
    "separation_m": "Δz",
    "separation_raw_m": "raw",
    "release_skew_s": "skew",
    "speed_m_s": "V",
    "fall_time_s": "time",
}


def failures(figures: Figures) -> Iterator[str]:
    """Say what of one case is beyond a limit, by more than chance.

    Parameters
    ----------
    figures
        As `AccuracyTally.json` gives them.
    """
    if figures["edges_given_to_a_wrong_rod"]:
        yield f"{figures['edges_given_to_a_wrong_rod']} edges given to a wrong rod"
    for name, errors in figures["quantities"].items():
        label = _NAMES.get(name, name)
        if name in LIMITS and _rms(figures, name) > LIMITS[name][3]:
            yield f"rms error of {label}"
        if "coverage_se" not in errors:
            continue  # one rig tells nothing of intervals: its drops share their errors
        sure = _SURE * errors["bias_se"] / errors["mean_U95"]
        if abs(errors["bias_over_U"]) - sure > BIAS:
            yield f"bias of {label} is {errors['bias_over_U']:.2f} U"
        low, high = COVERAGE
        sure = _SURE * errors["coverage_se"]
        if not low - sure <= errors["coverage"] <= high + sure:
            yield f"coverage of {label} is {errors['coverage']:.1%}"


def acceptance_table(cases: Mapping[str, Figures]) -> list[str]:
    """One line a case: rms errors, the largest bias, coverage by quantity, and what fails."""
    names = [name for name in _NAMES if name in next(iter(cases.values()))["quantities"]]
    limits = [name for name in LIMITS if name in names]
    heads = ["{} ({})".format(*LIMITS[name][:2]) for name in limits]
    coverages = [f"{_NAMES[name]} in U95 (%)" for name in names]
    rows = [["doubled", "runs", "void", *heads, "bias/U", *coverages, "wrong"]]
    for case, figures in cases.items():
        verdicts, errors = figures["verdicts"], figures["quantities"]
        rows.append([
            case, str(sum(verdicts.values())), str(verdicts.get("void", 0)),
            *(f"{_rms(figures, name) * LIMITS[name][2]:.4f}" for name in limits),
            f"{max((each['bias_over_U'] for each in errors.values()), key=abs):.2f}",
            *(f"{100 * errors[name]['coverage']:.1f}" for name in names),
            str(figures["edges_given_to_a_wrong_rod"]),
        ])  # fmt: skip
    failed = [
        f"{case}: {failure}" for case, figures in cases.items() for failure in failures(figures)
    ]
    return [*text_table(rows, left={0}), *failed]


def _rms(figures: Figures, name: str) -> float:
    """Rms error, of V relative to it."""
    if name == "speed_m_s":
        return float(figures["speed_rms_relative"])
    return float(figures["quantities"][name]["rms"])
