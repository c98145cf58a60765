"""The resolved world by itself: others' chains, one fall drawn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.studies.published_falls import results
from rig.bench.falls import Asked, falls, simulation
from rig.bench.findings import Findings
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


def run(arguments: Namespace) -> Iterator[Findings]:
    """Let others' chains fall, or draw a fall."""
    if arguments.published:
        yield _published([*results()])
    else:
        drawing = figure_file(
            film_figure(film(arguments.protocols, arguments.film)), "svg"
        ).decode()
        yield Findings({}, ["resolved-fall.svg"], picture=drawing, name="resolved-fall")


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
