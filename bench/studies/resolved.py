"""The resolved world by itself: error against run time, others' chains, one fall drawn."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from subprocess import PIPE
from subprocess import run as run_process
from typing import TYPE_CHECKING, Any

from rig.bench.falls import Asked, falls, simulation
from rig.bench.findings import Findings
from rig.bench.work import measure as measure_problem
from rig.commands.bench_precision import Study
from rig.errors import RigError
from rig.films import Film
from rig.protocol import reader
from rig.protocol.plan import runs as planned
from rig.report.canvas import figure_file
from rig.report.film import film_figure
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

_UNIFORM = "inclined-uniform.yaml"
_WORK_HEAD = """\
# Error against run time of the resolved world

`./run bench resolved --work`: three rods fall with several steps, methods and stiffnesses; an
error is the median over inclines. Of 25 rods, whose falls are chaotic, means count. Times are of
one machine.

"""


def run(arguments: Namespace) -> Iterator[Findings]:
    """Find what is asked for: error against run time, others' chains, or one fall drawn."""
    if arguments.work:
        yield _work(arguments.falls)
    elif arguments.published:
        yield _published(measure("published_falls"))
    else:
        drawing = figure_file(
            film_figure(film(arguments.protocols, arguments.film)), "svg"
        ).decode()
        yield Findings({}, ["resolved-fall.svg"], picture=drawing, name="resolved-fall")


def _work(falls: int) -> Findings:
    """Error against run time of the world's step and stiffness."""
    from bench.studies.resolved_precision import ensembles, problems  # noqa: PLC0415 - compiles

    study = Study("resolved-work", _WORK_HEAD)
    for problem in problems():
        study.add(problem, *measure_problem(problem))
    found, means = study.findings(), ensembles(falls)
    rows = [["25 rods at 50°: step (µs)", "mean Δz ± standard error (mm)", "falls", "s a fall"]]
    rows += [
        [f"{1e6 * row['step_s']:g}", f"{1e3 * row['mean_m']:.2f} ± {1e3 * row['se_m']:.2f}",
         f"{row['falls']:g}", f"{row['cpu_s']:.3f}"]
        for row in means
    ]  # fmt: skip
    points = [["method", "step or touch (s)", "error", "ms"]]
    points += [
        [point.method, f"{point.value:.1e}", f"{point.error:.1e}", f"{1e3 * point.cpu_s:.4g}"]
        for point in study.points
    ]
    lines = [
        *text_table(points, left={0}, rule=True),
        "",
        *text_table(rows, left={0}, rule=True),
        "",
        *study.remarks(),
    ]
    record = {**found.record, "ensembles": means}
    return replace(found, record=record, lines=lines, picture="", name="resolved-work")


def _published(chains: list[dict[str, Any]]) -> Findings:
    """How chains of other experiments fall."""
    rows = [["", "of", "mean", "sd", "falls"]]
    rows += [
        [row["what"], row["of"], f"{row['mean']:.4f}",
         "–" if row["sd"] is None else f"{row['sd']:.4f}", str(row["n"])]
        for row in chains
    ]  # fmt: skip
    table = text_table(rows, left={0, 1}, rule=True)
    return Findings(
        {"results": chains}, table, rows=chains, name="resolved-published", simulated=True
    )


def measure(module: str) -> list[dict[str, Any]]:
    """Have a module of this folder, in a process of its own, print lines of JSON.

    Raises
    ------
    RigError
        It gave up.
    """
    command = [sys.executable, "-m", f"{__package__}.{module}"]
    process = run_process(command, stdout=PIPE, text=True, check=False)
    if process.returncode:
        raise RigError(f"the simulation ended with exit code {process.returncode}")
    return [json.loads(line) for line in process.stdout.splitlines()]


def film(folder: str, incline_deg: float) -> Film:
    """Let the uniform chain fall onto a board once, to be drawn.

    Raises
    ------
    RigError
        The simulation gave up.
    """
    path = Path(folder) / _UNIFORM
    number = next(
        each.number for each in planned(reader.read(path)) if each.incline_deg == incline_deg
    )
    url = simulation(path, {"dynamics": "resolved", "film": "1"})
    (fall,) = falls([Asked(url, [1], [[number]])])
    return Film(**fall.truth["film"])
