"""On which layouts of gates are drops read, and rightly? Against the simulation's hidden truth."""

from __future__ import annotations

import json
import math
import time
from collections import Counter
from dataclasses import asdict, dataclass, field
from itertools import chain, islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.studies.baselines import plain_fit
from bench.studies.columns import Column, filled
from bench.studies.disturbances import DOUBLED, STACK
from bench.studies.figures import layouts_figure
from bench.studies.layout_catalogue import LAYOUTS, chosen
from bench.studies.time_scales import time_scale
from bench.workers import results
from rig.analysis.drop import fit_drop
from rig.analysis.result import GOOD
from rig.bench.falls import HZ, STRAY, Asked, falls, simulation
from rig.bench.findings import Findings
from rig.commands.output import say
from rig.errors import InputError
from rig.measurands import MEASURANDS
from rig.protocol import reader
from rig.protocol.plan import runs
from rig.text_table import text_table
from rig.threads import one_thread

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from bench.studies.layout_catalogue import GateLayout
    from rig.analysis.result import DropResult
    from rig.bench.falls import SimulatedDrop
    from rig.protocol.protocol import Protocol

    Record = Mapping[str, Any]

DROPS = 12
"""On each layout with each disturbance, every one on a rig of its own."""
DISTURBANCES: Mapping[str, Mapping[str, str]] = {
    "quiet": {"quiet": "1"},
    "default": {},
    "doubled": {dial: size for dial, size in DOUBLED.items() if dial not in STACK},
}
"""Settings of the simulated rig by name."""
MEASURED = ("separation_m", "speed_m_s", "gravity_m_s2")
"""What a layout's errors are of: the first of these that its scene has."""
_STRIDE = 7  # from run to run of a plan: all inclinations and either chain come soon
_HEAD = """\
# Which gate layouts can be read

`./run bench layouts --drops {drops}`: {drops} drops on each layout, without disturbances, with
the usual ones, and with all doubled. Left out: drops that truly miss more edges than accepted.

![Map of layouts](layouts.svg)"""


@dataclass(slots=True)
class Sums:
    """What is added up over the drops of a cell.

    Attributes
    ----------
    seconds, good_seconds, plain_seconds
        Processor time of identification and adjustment, of all drops and of good ones, and of one
        ``numpy.linalg.lstsq`` with the edges and unknowns of the good ones.
    measured
        Drops with a result.
    errors, ratios
        Squares of their errors, and of these over u.
    worst
        The largest error over u.
    """

    seconds: float = 0.0
    good_seconds: float = 0.0
    plain_seconds: float = 0.0
    measured: int = 0
    errors: float = 0.0
    ratios: float = 0.0
    worst: float = 0.0


@dataclass(slots=True)
class Cell:
    """A layout with one disturbance.

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
    sums
        Of times and errors.
    """

    chain: str
    gates: str
    heights_mm: str
    disturbance: str
    drops: int = 0
    beyond: int = 0
    verdicts: Counter[str] = field(default_factory=Counter)
    wrong: int = 0
    edges: int = 0
    wrong_edges: int = 0
    strays: int = 0
    measured: str | None = None
    reasons: Counter[str] = field(default_factory=Counter)
    sums: Sums = field(default_factory=Sums)

    def add(
        self, protocol: Protocol, fall: SimulatedDrop, result: DropResult, seconds: float
    ) -> None:
        """Compare one drop with its truth."""
        sums = self.sums
        self.drops += 1
        sums.seconds += seconds
        if _beyond(protocol, fall, result):
            self.beyond += 1
            return
        self.verdicts[result.verdict] += 1
        if result.verdict not in GOOD:
            self.reasons.update(reason.code for reason in result.reasons)
            return
        begin = time.process_time()
        plain_fit(protocol, fall.drop, result, HZ)
        sums.plain_seconds += time.process_time() - begin
        sums.good_seconds += seconds
        wrong, strays = fall.rods(result.matches)
        self.wrong += wrong > 0
        self.edges += len(result.matches)
        self.wrong_edges += wrong
        self.strays += strays
        self.measured = next((name for name in MEASURED if name in result.quantities), None)
        if self.measured is not None:
            quantity = result.quantities[self.measured]
            error = quantity.value - fall.truth[self.measured]
            sums.measured += 1
            sums.errors += error**2
            sums.ratios += (error / quantity.u) ** 2
            sums.worst = max(sums.worst, abs(error / quantity.u))

    def share(self, verdict: str) -> float:
        """Share of a verdict in the drops that count; 0 where none does."""
        return self.verdicts[verdict] / max(1, self.verdicts.total())

    def json(self) -> dict[str, Any]:
        """Return the figures to report; `read` makes the same cell of them."""
        sums = self.sums
        return {name: getattr(self, name) for name in _COUNTED} | {
            "verdicts": dict(sorted(self.verdicts.items())),
            "void_share": self.share("void"),
            "marginal_share": self.share("marginal"),
            "error_rms": _rms(sums.errors, sums.measured),
            "z_rms": _rms(sums.ratios, sums.measured),
            "z_worst": sums.worst if sums.measured else None,
            "ms_per_drop": 1e3 * sums.seconds / max(1, self.drops),
            "times_lstsq": _over(sums.good_seconds, sums.plain_seconds),
            "reasons": dict(self.reasons.most_common()),
            "sums": asdict(sums),
        }

    @classmethod
    def read(cls, record: Record) -> Cell:
        """Take a cell from what `json` returned."""
        return cls(
            **{name: record[name] for name in _COUNTED},
            verdicts=Counter(record["verdicts"]),
            reasons=Counter(record["reasons"]),
            sums=Sums(**record["sums"]),
        )


_COUNTED = ("chain", "gates", "heights_mm", "disturbance", "drops", "beyond", "wrong", "edges",
            "wrong_edges", "strays", "measured")  # fmt: skip


def _over(time_s: float, plain_s: float) -> float | None:
    return time_s / plain_s if plain_s > 0.0 else None


def _rms(squares: float, count: int) -> float | None:
    return math.sqrt(squares / count) if count else None


def _beyond(protocol: Protocol, fall: SimulatedDrop, result: DropResult) -> bool:
    """Whether a drop is truly beyond the protocol's limits, so that it has to be void."""
    skew = fall.truth.get("release_skew_s")
    if skew is not None and abs(skew) > protocol.accept.release_skew:
        return True
    seen = {tuple(edge) for _, *edge in fall.truth["edges"] if edge[-1] != STRAY}
    expected = result.audit.matched + result.audit.missed
    return expected - len(seen) > protocol.accept.missed_edges * expected


def run(arguments: Namespace) -> Iterator[Findings]:
    """Let chains fall on every layout with every disturbance.

    With ``--more`` drops, each on a further rig, are added to what is in the folder.
    """
    layouts = chosen(LAYOUTS, arguments.only)
    before: dict[tuple[str, str], list[Cell]] = {}
    if arguments.more:
        for cell in _read_cells(Path(arguments.output) / "layouts.json"):
            before.setdefault((cell.chain, cell.heights_mm), []).append(cell)
    drops = arguments.drops or DROPS
    calls = [
        (cells, layout, drops, before.pop((layout.kind.name, layout.heights), ()))
        for layout in layouts
    ]
    done: list[Cell] = []
    for n, part in enumerate(results(calls, arguments.jobs), 1):
        done += part
        say(f"{n} of {len(layouts)}: {part[0].chain}, {part[0].gates} gates")
    record = as_json([*done, *chain(*before.values())])
    rows = record["layouts"]
    # What lies deeper is in the JSON.
    flat = [{name: row[name] for name in row if not isinstance(row[name], dict)} for row in rows]
    counts = " or ".join(map(str, sorted({row["drops"] for row in rows})))
    head = _HEAD.format(drops=counts)
    yield Findings(record, _lines(record), head, flat, layouts_figure(rows), simulated=True)


def _read_cells(file: Path) -> list[Cell]:
    """Read what this bench has left."""
    try:
        return [Cell.read(row) for row in json.loads(file.read_text(encoding="utf-8"))["layouts"]]
    except (OSError, ValueError, KeyError, TypeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not what this bench leaves"
        raise InputError(
            f"cannot add to {file}: {why}",
            "leave --more out to begin anew; ./run bench layouts writes this file there",
        ) from error


@one_thread
def cells(layout: GateLayout, drops: int, before: Sequence[Cell] = ()) -> list[Cell]:
    """Let chains fall on one layout with every disturbance, and add up with what was found."""
    begun = {cell.disturbance: cell for cell in before}
    with TemporaryDirectory() as folder:
        path = Path(folder) / "layout.yaml"
        path.write_text(layout.protocol(), encoding="utf-8")
        protocol = reader.read(path)
        planned = {run.number: run for run in runs(protocol)}
        numbers = [*planned]
        filled_cells = [
            begun.get(name) or Cell(layout.kind.name, layout.gates, layout.heights, name)
            for name in DISTURBANCES
        ]
        asked = []
        for cell in filled_cells:
            rigs = range(cell.drops, cell.drops + drops)
            each = [[numbers[_STRIDE * rig % len(numbers)]] for rig in rigs]
            url = simulation(path, DISTURBANCES[cell.disturbance])
            asked.append(Asked(url, [1 + rig for rig in rigs], each))
        all_falls = falls(asked)
        for cell in filled_cells:
            for fall in islice(all_falls, drops):
                begin = time.process_time()
                result, _ = fit_drop(
                    protocol, planned[fall.drop.run], fall.drop, time_scale(fall.seed)
                )
                cell.add(protocol, fall, result, time.process_time() - begin)
    return filled_cells


def as_json(all_cells: Sequence[Cell]) -> dict[str, Any]:
    """``{"layouts": [...], "totals": [...], "reasons": {...}}``, the most frequent reason first."""
    reasons = sum((cell.reasons for cell in all_cells), Counter[str]())
    return {
        "layouts": [cell.json() for cell in all_cells],
        "totals": [
            _total(name, [cell for cell in all_cells if cell.disturbance == name])
            for name in DISTURBANCES
        ],
        "reasons": dict(reasons.most_common()),
    }


def _total(name: str, group: Sequence[Cell]) -> dict[str, Any]:
    """Sum up over layouts."""
    verdicts = sum((cell.verdicts for cell in group), Counter[str]())
    counted = max(1, verdicts.total())

    def added(figure: str) -> Any:
        return sum(getattr(cell, figure) for cell in group)

    def summed(figure: str) -> Any:
        return sum(getattr(cell.sums, figure) for cell in group)

    return {
        "disturbance": name,
        "drops": added("drops"),
        "beyond": added("beyond"),
        "void_share": verdicts["void"] / counted,
        "marginal_share": verdicts["marginal"] / counted,
        "wrong": added("wrong"),
        "edges": added("edges"),
        "wrong_edges": added("wrong_edges"),
        "z_rms": _rms(summed("ratios"), summed("measured")),
        "ms_per_drop": 1e3 * summed("seconds") / max(1, added("drops")),
        "times_lstsq": _over(summed("good_seconds"), summed("plain_seconds")),
    }


def _lines(record: Record) -> list[str]:
    """One row a layout, with its disturbances side by side, then what all have together."""
    by_layout: dict[tuple[str, str], list[Record]] = {}
    for cell in record["layouts"]:
        by_layout.setdefault((cell["chain"], cell["heights_mm"]), []).append(cell)
    rows = [{"of": cells[0], "cells": cells} for cells in by_layout.values()]
    names = " / ".join(DISTURBANCES)
    return [
        f"void, marginal, drops with a wrong rod, error and its ratio to u: {names}",
        *_table(_COLUMNS, rows),
        "",
        *_table(_TOTALS, record["totals"]),
    ]


def _table(columns: Sequence[Column[Record]], records: Sequence[Record]) -> list[str]:
    """Write records as aligned text; what a line is of begins it."""
    present, rows = filled(columns, records)
    words = {n for n, column in enumerate(present) if not column.numeric}
    return text_table([[column.heading for column in present], *rows], left=words, rule=True)


def _side_by_side(text: Callable[[Record], str]) -> Callable[[Record], str]:
    return lambda row: " / ".join(text(cell) for cell in row["cells"])


def _figure(name: str, form: str, scale: float = 1.0) -> Callable[[Record], str]:
    """Write a figure of a cell, a dash where there is none."""
    return lambda cell: "–" if cell[name] is None else format(scale * cell[name], form)


def _symbol(row: Record) -> str:
    name = next((cell["measured"] for cell in row["cells"] if cell["measured"]), None)
    return f"{MEASURANDS[name].symbol} ({MEASURANDS[name].fine})" if name else ""


_COLUMNS: tuple[Column[Record], ...] = (
    Column("chain", lambda row: row["of"]["chain"], numeric=False),
    Column("gates (mm)", lambda row: row["of"]["heights_mm"], numeric=False),
    Column("void", _side_by_side(_figure("void_share", ".0%"))),
    Column("marginal", _side_by_side(_figure("marginal_share", ".0%"))),
    Column("wrong", _side_by_side(_figure("wrong", "d", 1))),
    Column("of", _symbol, numeric=False),
    Column("rms error", _side_by_side(_figure("error_rms", ".3g", 1e3))),  # mm, mm/s or mm/s²
    Column("rms error/u", _side_by_side(_figure("z_rms", ".2g"))),
    Column("times lstsq", _side_by_side(_figure("times_lstsq", ".0f"))),
)
_TOTALS: tuple[Column[Record], ...] = (
    Column("disturbances", lambda total: total["disturbance"], numeric=False),
    Column("drops", _figure("drops", "d", 1)),
    Column("beyond limits", _figure("beyond", "d", 1)),
    Column("void", _figure("void_share", ".1%")),
    Column("marginal", _figure("marginal_share", ".1%")),
    Column("wrong drops", _figure("wrong", "d", 1)),
    Column("edges", _figure("edges", "d", 1)),
    Column("wrong edges", _figure("wrong_edges", "d", 1)),
    Column("rms error/u", _figure("z_rms", ".2g")),
    Column("ms a drop", _figure("ms_per_drop", ".1f")),
    Column("times lstsq", _figure("times_lstsq", ".0f")),
)
