"""Errors in the model's world: whole sessions compared with the simulation's hidden truth."""

from __future__ import annotations

from collections import Counter, defaultdict
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.studies.errors import Errors, shares_held
from bench.studies.sessions import with_device
from rig.analysis.result import GOOD
from rig.bench.falls import STRAY
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.measurands import MEASURANDS
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable, Iterator, Mapping

    from bench.studies.sessions import SimulatedSession
    from rig.analysis.result import DropResult
    from rig.bench.falls import SimulatedDrop

    Figures = Mapping[str, Any]

_HEAD = """\
# Errors in the model's world

`./run bench accuracy`: simulated sessions through board, line and file, compared with the true
values. *In U95*: how often ± U holds the true value (95 % is intended). *rms / u*: rms error over
the stated standard uncertainty."""


def run(arguments: Namespace) -> Iterator[Findings]:
    """Measure accuracy over several sessions through device, line, daemon and file."""
    figures = summarize(_sessions(arguments))
    yield Findings(figures, _table(figures), _HEAD)


def _sessions(arguments: Namespace) -> Iterator[SimulatedSession]:
    for seed in range(1, arguments.seeds + 1):
        with TemporaryDirectory() as folder:
            session = with_device(
                Path(folder), arguments.protocol, arguments.port, seed, arguments.repeats
            )
        say(f"session {seed} of {arguments.seeds}: {session.wall_s:.1f} s")
        yield session


def summarize(sessions: Iterable[SimulatedSession]) -> dict[str, Any]:
    """Compare sessions, each of another rig, with their truths: only good drops have results."""
    quantities: dict[str, Errors] = defaultdict(Errors)
    verdicts, origins = Counter[str](), Counter[str]()
    wall_s: list[float] = []
    analysis_s = 0.0
    for rig, session in enumerate(sessions):
        for result, fall, scale in session.results():
            verdicts[result.verdict] += 1
            if result.verdict not in GOOD:
                continue
            origins.update(_origins(result, fall, scale.hz))
            for name, measured in result.quantities.items():
                if fall.truth.get(name) is not None:
                    quantities[name].add(measured, fall.truth[name], rig)
        wall_s.append(session.wall_s)
        analysis_s += session.analysis_s
    return {
        "sessions": len(wall_s),
        "verdicts": dict(sorted(verdicts.items())),
        "edges_matched": origins.total(),
        "edges_given_to_a_wrong_rod": origins["wrong"],
        "strays_taken_for_a_rod": origins["stray"],
        "quantities": {name: errors.json() for name, errors in quantities.items()},
        "analysis_ms_per_run": 1e3 * analysis_s / verdicts.total(),
        "wall_time_s": wall_s,
    }


def _origins(result: DropResult, fall: SimulatedDrop, hz: float) -> Iterator[str]:
    """Say of each matched edge whether the true one nearest in time is of the right rod."""
    true: dict[tuple[int, bool], list[tuple[float, int]]] = defaultdict(list)
    for when, channel, blocked, rod in fall.truth["edges"]:
        true[channel, blocked].append((when, rod))
    beams = {beam: np.array(passages).T for beam, passages in true.items()}
    for number, rod in result.matches.items():
        edge = fall.drop.edges[number]
        times, rods = beams[edge.channel, edge.blocked]
        origin = rods[np.abs(times - edge.tick / hz).argmin()]
        yield "right" if origin == rod else "stray" if origin == STRAY else "wrong"


def _table(figures: Figures) -> list[str]:
    verdicts = ", ".join(f"{n} {verdict}" for verdict, n in figures["verdicts"].items())
    rows = [["error of one run", "rms", "bias", "worst", "mean U95", "bias/U", "in U95", "rms / u"]]
    for name, errors in figures["quantities"].items():
        row = MEASURANDS[name]
        sizes = (errors[size] * row.fine_scale for size in ("rms", "bias", "worst", "mean_U95"))
        rows.append([
            f"{row.label} ({row.fine})", *(f"{size:.3f}" for size in sizes),
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
