"""On which layouts of gates are drops read, and rightly? Against the simulation's hidden truth."""

from __future__ import annotations

import math
import time
from collections import Counter
from dataclasses import dataclass, field
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.studies.figures import layouts_figure
from bench.studies.layout_catalogue import LAYOUTS, chosen
from bench.studies.time_scales import time_scale
from bench.workers import results
from rig.analysis.drop import DropCase
from rig.analysis.result import GOOD
from rig.bench.falls import STRAY, Asked, falls, simulation
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.measurands import MEASURANDS
from rig.protocol import reader
from rig.protocol.plan import runs
from rig.text_table import text_table
from rig.threads import one_thread

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping, Sequence

    from bench.studies.layout_catalogue import GateLayout
    from rig.analysis.result import DropResult
    from rig.bench.falls import SimulatedDrop
    from rig.protocol.protocol import Protocol

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
the usual ones, and with all doubled. Left out: drops that truly miss more edges than accepted.

![Map of layouts](layouts.svg)"""


@dataclass(slots=True)
class Cell:
    """A layout with one disturbance, or all layouts with it.

    Attributes
    ----------
    chain, gates, heights_mm
        The layout in words.
    drops
        Made, of which `beyond` truly miss more edges, or leave more apart, than the protocol
        accepts; only the others count below.
    verdicts
        Of the others.
    wrong
        Good drops with an edge given to another rod than it came from.
    edges, wrong_edges, strays
        Of good drops: given to a rod, to a wrong one, and strays given to one.
    measured
        Which measurand the errors are of.
    reasons
        Kinds of reasons for voids, numbers left out, by their number.
    errors, ratios
        Of the results; and these over u.
    seconds
        Processor time of identification and adjustment.
    """

    chain: str
    gates: str
    heights_mm: str
    disturbance: str
    drops: int = 0
    beyond: int = 0
    wrong: int = 0
    edges: int = 0
    wrong_edges: int = 0
    strays: int = 0
    measured: str | None = None
    verdicts: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    errors: list[float] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)
    seconds: float = 0.0

    def add(
        self, protocol: Protocol, fall: SimulatedDrop, result: DropResult, seconds: float
    ) -> None:
        """Compare one drop with its truth."""
        self.drops += 1
        self.seconds += seconds
        if _beyond(protocol, fall, result):
            self.beyond += 1
            return
        self.verdicts[result.verdict] += 1
        if result.verdict not in GOOD:
            self.reasons.update(reason.code for reason in result.reasons)
            return
        wrong, strays = fall.rods(result.matches)
        self.wrong += wrong > 0
        self.edges += len(result.matches)
        self.wrong_edges += wrong
        self.strays += strays
        self.measured = next((name for name in MEASURED if name in result.quantities), None)
        if self.measured is not None:
            quantity = result.quantities[self.measured]
            self.errors.append(quantity.value - fall.truth[self.measured])
            self.ratios.append(self.errors[-1] / quantity.u)

    def json(self) -> dict[str, Any]:
        """Return the figures to report."""
        counted = max(1, self.verdicts.total())
        figures = {name: getattr(self, name) for name in self.__slots__[:11]}
        return figures | {
            "verdicts": dict(sorted(self.verdicts.items())),
            "void_share": self.verdicts["void"] / counted,
            "marginal_share": self.verdicts["marginal"] / counted,
            "error_rms": _rms(self.errors),
            "z_rms": _rms(self.ratios),
            "z_worst": max(map(abs, self.ratios), default=None),
            "ms_per_drop": 1e3 * self.seconds / max(1, self.drops),
            "reasons": dict(self.reasons.most_common()),
        }


def _rms(values: Sequence[float]) -> float | None:
    return math.sqrt(sum(value**2 for value in values) / len(values)) if values else None


def _beyond(protocol: Protocol, fall: SimulatedDrop, result: DropResult) -> bool:
    """Whether a drop is truly beyond the protocol's limits, so that it has to be void."""
    skew = fall.truth.get("release_skew_s")
    if skew is not None and abs(skew) > protocol.accept.release_skew:
        return True
    seen = {tuple(edge) for _, *edge in fall.truth["edges"] if edge[-1] != STRAY}
    expected = result.audit.matched + result.audit.missed
    return expected - len(seen) > protocol.accept.missed_edges * expected


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
    yield Findings(record, [*_lines(record)], head, flat, layouts_figure(rows), simulated=True)


@one_thread
def cells(layout: GateLayout, drops: int) -> list[Cell]:
    """Let chains fall on one layout with every disturbance, each drop on a rig of its own."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "layout.yaml"
        path.write_text(layout.protocol(), encoding="utf-8")
        protocol = reader.read(path)
        planned = {run.number: run for run in runs(protocol)}
        numbers, rigs = [*planned], range(drops)
        plan = [[numbers[_STRIDE * rig % len(numbers)]] for rig in rigs]
        seeds = [1 + rig for rig in rigs]
        all_falls = falls([
            Asked(simulation(path, dials), seeds, plan) for dials in DISTURBANCES.values()
        ])  # fmt: skip
        part = [Cell(layout.kind.name, layout.gates, layout.heights, name) for name in DISTURBANCES]
        for cell in part:
            for fall in islice(all_falls, drops):
                begin = time.process_time()
                result, _ = DropCase(
                    protocol, planned[fall.drop.run], fall.drop, time_scale(fall.seed)
                ).read()
                cell.add(protocol, fall, result, time.process_time() - begin)
    return part


def as_json(all_cells: Sequence[Cell]) -> dict[str, Any]:
    """``{"layouts": [...], "totals": [...], "reasons": {...}}``, the most frequent reason first."""
    totals = [
        _total([cell for cell in all_cells if cell.disturbance == name]) for name in DISTURBANCES
    ]
    return {
        "layouts": [cell.json() for cell in all_cells],
        "totals": [total.json() for total in totals],
        "reasons": dict(sum((total.reasons for total in totals), Counter[str]()).most_common()),
    }


def _total(group: Sequence[Cell]) -> Cell:
    """Sum up over layouts with one disturbance."""
    total = Cell("all", "", "", group[0].disturbance)
    for name in ("drops", "beyond", "wrong", "edges", "wrong_edges", "strays", "seconds"):
        setattr(total, name, sum(getattr(cell, name) for cell in group))
    for cell in group:
        total.verdicts += cell.verdicts
        total.reasons += cell.reasons
        total.ratios += cell.ratios
    return total


def _lines(record: Record) -> Iterator[str]:
    """One row a layout, with its disturbances side by side, then what all have together."""
    names = " / ".join(DISTURBANCES)
    yield f"void, marginal, drops with a wrong rod, error and its ratio to u: {names}"
    rows = [["chain", "gates (mm)", "void", "marginal", "wrong", "of", "rms error", "rms error/u"]]
    for layout, group in groupby(record["layouts"], itemgetter("chain", "heights_mm")):
        part = [*group]
        row = next((MEASURANDS[cell["measured"]] for cell in part if cell["measured"]), None)
        shares = [
            " / ".join(_figure(cell[name], form, scale) for cell in part)
            for name, form, scale in _FIGURES
        ]
        shares.insert(3, f"{row.symbol} ({row.fine})" if row else "")
        rows.append([*layout, *shares])
    yield from text_table(rows, left={0, 1, 5}, rule=True)
    yield ""
    totals = [["disturbances", *(heading for heading, *_ in _TOTALS)]]
    totals += [
        [total["disturbance"], *(_figure(total[name], form, 1) for _, name, form in _TOTALS)]
        for total in record["totals"]
    ]
    yield from text_table(totals, left={0}, rule=True)


def _figure(value: float | None, form: str, scale: float) -> str:
    """Write a figure of a cell, a dash where there is none."""
    return "–" if value is None else format(scale * value, form)


_FIGURES = (
    ("void_share", ".0%", 1.0), ("marginal_share", ".0%", 1.0), ("wrong", "d", 1),
    ("error_rms", ".3g", 1e3), ("z_rms", ".2g", 1.0),
)  # fmt: skip
"""Of each layout: name, form and scale; errors in mm, mm/s or mm/s²."""
_TOTALS = (
    ("drops", "drops", "d"), ("beyond limits", "beyond", "d"), ("void", "void_share", ".1%"),
    ("marginal", "marginal_share", ".1%"), ("wrong drops", "wrong", "d"), ("edges", "edges", "d"),
    ("wrong edges", "wrong_edges", "d"), ("rms error/u", "z_rms", ".2g"),
    ("ms a drop", "ms_per_drop", ".1f"),
)  # fmt: skip
"""Of all layouts together: heading, name and form."""
