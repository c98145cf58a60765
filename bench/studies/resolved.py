"""The resolved world by itself: error against run time, and others' chains."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bench.studies.columns import Column, aligned, points_table
from bench.studies.resolved_paper import FIGURES
from rig.bench.findings import Findings
from rig.bench.work import measure as measure_problem
from rig.commands.bench_precision import Study
from rig.commands.output import say
from rig.report.canvas import figure_file
from rig.report.paper import paper_figure

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

_WORK_HEAD = """\
# Error against run time of the resolved world

`./run bench resolved --work`: three rods fall with several steps, methods and stiffnesses; an
error is the median over inclines. Of 25 rods, whose falls are chaotic, means count. Times are of
one machine.

"""


def run(arguments: Namespace) -> Iterator[Findings]:
    """Find what is asked for: error against run time, others' chains, or the paper's figures."""
    if arguments.work:
        yield _work(arguments.falls)
    elif arguments.published:
        yield _published()
    else:
        yield _paper(arguments.paper)


def _work(falls: int) -> Findings:
    """Error against run time of the world's step and stiffness."""
    from bench.studies.resolved_precision import ensembles, problems  # noqa: PLC0415 - compiles

    study = Study("resolved-work", _WORK_HEAD)
    for problem in problems():
        study.add(problem, *measure_problem(problem))
    means = ensembles(falls)
    columns = (
        Column("25 rods at 50°: step (µs)", "step_s", "g", 1e6),
        Column("mean Δz (mm)", "mean_m", ".2f", 1e3), Column("± (mm)", "se_m", ".2f", 1e3),
        Column("falls", "falls", "g"), Column("s a fall", "cpu_s", ".3f"),
    )  # fmt: skip
    found = study.findings([*points_table(study.points), "", *aligned(columns, means)])
    record = {**found.record, "ensembles": means}
    return replace(found, record=record, name="resolved-work")


def _published() -> Findings:
    """How chains of other experiments fall."""
    from bench.studies.published_falls import results  # noqa: PLC0415 - compiles

    rows = [*results()]
    columns = (
        Column("", "what"), Column("of", "of"), Column("mean", "mean", ".4f"),
        Column("sd", "sd", ".4f"), Column("falls", "n", "d"),
    )  # fmt: skip
    return Findings(
        {"results": rows}, aligned(columns, rows), rows=rows, name="resolved-published",
        simulated=True,
    )  # fmt: skip


def _paper(number: int) -> Findings:
    """A figure of the paper, with falls of that world."""
    say("simulating drops rod by rod; this takes some minutes")
    columns = FIGURES[number]()
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    drawing = figure_file(paper_figure(number, columns)[0], "svg").decode()
    name = f"figure-{number}-resolved"
    return Findings({"falls": rows}, [f"{name}.svg"], rows=rows, picture=drawing, name=name)
