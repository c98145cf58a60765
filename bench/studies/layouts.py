"""On which layouts of gates are drops read, and rightly? Against the simulation's hidden truth."""

from __future__ import annotations

import time
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

from bench.studies.columns import Column, aligned
from bench.studies.falls import Asked, falls, simulation
from bench.studies.layout_catalogue import LAYOUTS, chosen
from bench.studies.scores import Score, total
from bench.studies.time_scales import time_scale
from bench.workers import results
from rig.analysis.drop import DropCase
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.measurands import MEASURANDS
from rig.protocol import reader
from rig.threads import one_thread

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping, Sequence

    from bench.studies.layout_catalogue import GateLayout

    Record = Mapping[str, Any]

DISTURBANCES: Mapping[str, Mapping[str, str]] = {
    "quiet": {"quiet": "1"},
    "default": {},
    "doubled": {
        "skew_sd": "4 ms", "delay_sd": "2 ms", "hang_sd": "0.2 mm", "drop_error": "1",
        "rod_sd": "0.6 mm", "width_sd": "0.2 mm", "gate_sd": "0.4 mm", "datum_sd": "0.4 mm",
        "beam_sd": "1 mm", "impulse_sd": "0.04", "jitter_sd": "4 us", "missed": "2 %",
        "chatter": "1 %", "string": "0.4 %", "bounce": "10 %",
    },
}  # fmt: skip
"""Settings of the simulated rig by name: its dials at nothing, at their default and at twice it."""
MEASURED = ("separation_m", "speed_m_s", "gravity_m_s2")
"""What a layout's errors are of: the first of these that its scene has."""
_STRIDE = 7  # from run to run of a plan: all inclinations and either chain come soon
_HEAD = """\
# Which gate layouts can be read

`./run bench layouts --drops {drops}`: {drops} drops on each layout, without disturbances, with
the usual ones, and with all doubled. Void shares leave out drops that truly are beyond limits."""


class Cell(NamedTuple):
    """A layout with one disturbance, or all layouts with it, and what became of the drops."""

    chain: str
    gates: str
    heights_mm: str
    disturbance: str
    score: Score

    def json(self) -> dict[str, Any]:
        """Return the figures to report; errors are those of the first of `MEASURED`."""
        figures = self.score.json()
        errors = figures.pop("quantities")
        measured = next((name for name in MEASURED if name in errors), None)
        sizes = {f"error_{size}": errors[measured][size] if measured else None for size in _SIZES}
        named = {name: getattr(self, name) for name in self._fields[:-1]}
        return named | figures | {"measured": measured} | sizes


def run(arguments: Namespace) -> Iterator[Findings]:
    """Let chains fall on every layout with every disturbance."""
    layouts = chosen(LAYOUTS, arguments.only)
    calls = [(cells, layout, arguments.drops) for layout in layouts]
    done: list[Cell] = []
    for n, part in enumerate(results(calls, arguments.jobs), 1):
        done += part
        say(f"{n} of {len(layouts)}: {part[0].chain}, {part[0].gates} gates")
    record = as_json(done)
    rows = record["layouts"]
    # What lies deeper is in the JSON.
    flat = [{name: row[name] for name in row if not isinstance(row[name], dict)} for row in rows]
    head = _HEAD.format(drops=arguments.drops)
    yield Findings(record, [*_lines(record)], head, flat, simulated=True)


@one_thread
def cells(layout: GateLayout, drops: int) -> list[Cell]:
    """Let chains fall on one layout with every disturbance, each drop on a rig of its own."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "layout.yaml"
        path.write_text(layout.protocol(), encoding="utf-8")
        protocol = reader.read(path)
        planned = {run.number: run for run in protocol.runs()}
        numbers, rigs = [*planned], range(drops)
        plan = [[numbers[_STRIDE * rig % len(numbers)]] for rig in rigs]
        seeds = [1 + rig for rig in rigs]
        all_falls = falls([
            Asked(simulation(path, dials), seeds, plan) for dials in DISTURBANCES.values()
        ])  # fmt: skip
        named = layout.kind.name, layout.gates, layout.heights
        part = [Cell(*named, name, Score()) for name in DISTURBANCES]
        for cell in part:
            for fall in islice(all_falls, drops):
                begin = time.process_time()
                result, _ = DropCase(
                    protocol, planned[fall.drop.run], fall.drop, time_scale(fall.seed)
                ).read()
                cell.score.seconds += time.process_time() - begin
                cell.score.add_drop(protocol, result, fall, fall.seed)
    return part


def as_json(cells: Sequence[Cell]) -> dict[str, Any]:
    """``{"layouts": [...], "totals": [...]}``."""
    totals = [
        Cell("all", "", "", name, total(cell.score for cell in cells if cell.disturbance == name))
        for name in DISTURBANCES
    ]
    return {"layouts": [cell.json() for cell in cells], "totals": [cell.json() for cell in totals]}


def _lines(record: Record) -> Iterator[str]:
    """One row a layout, with its disturbances side by side, then what all have together."""
    yield f"in each cell: {' / '.join(DISTURBANCES)}"
    rows = []
    for _, group in groupby(record["layouts"], itemgetter("chain", "heights_mm")):
        part = [*group]
        row = next((MEASURANDS[cell["measured"]] for cell in part if cell["measured"]), None)
        shares = {column.key: " / ".join(column.cell(cell) for cell in part) for column in _FIGURES}
        rows.append(part[0] | shares | {"of": f"{row.symbol} ({row.fine})" if row else ""})
    words = [Column(column.heading, column.key) for column in _FIGURES]
    words[3:3] = [Column("of", "of")]
    yield from aligned([Column("chain", "chain"), Column("gates (mm)", "heights_mm"), *words], rows)
    yield from ("", *aligned(_TOTALS, record["totals"]))


_SIZES = ("rms", "z_rms")
_FIGURES = (
    Column("void", "void_share", ".0%"), Column("marginal", "marginal_share", ".0%"),
    Column("wrong", "wrong_drops", "d"), Column("rms error", "error_rms", ".3g", 1e3),
    Column("rms error/u", "error_z_rms", ".2g"),
)  # fmt: skip
"""Of each layout; errors in mm, mm/s or mm/s²."""
_TOTALS = (
    Column("disturbances", "disturbance"), Column("drops", "drops", "d"),
    Column("beyond limits", "beyond", "d"), Column("void", "void_share", ".1%"),
    Column("marginal", "marginal_share", ".1%"), Column("wrong drops", "wrong_drops", "d"),
    Column("edges", "edges", "d"), Column("wrong edges", "wrong_edges", "d"),
    Column("rms error/u", "error_z_rms", ".2g"), Column("ms a drop", "ms_per_drop", ".1f"),
)  # fmt: skip
"""Of all layouts together."""
