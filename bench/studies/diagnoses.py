"""How many faults of a rig are named rightly, and how many where there is none."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.studies.falls import Asked, falls, simulation
from bench.studies.layout_catalogue import (
    FENCE,
    KINDS,
    SINGLE,
    STANDARD,
    GateLayout,
    Kind,
    chosen,
    under,
)
from bench.studies.time_scales import time_scale
from bench.studies.wrong_rigs import WRONG_RIGS
from bench.workers import results
from rig.analysis.drop import DropCase
from rig.bench.findings import Findings
from rig.clock.calibration import TimeScale
from rig.commands.output import say
from rig.protocol import reader
from rig.reasons import sentences
from rig.text_table import text_table
from rig.threads import one_thread

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping, Sequence

    from rig.analysis.result import DropResult

DROPS = 2
"""With each fault of each size on each layout, every one on a rig of its own."""
CLEAN = 100
"""Drops on each layout without a fault."""
OUTCOMES = {
    "right": "named rightly",
    "likely": "among the likeliest",
    "unnamed": "void or remarked, unnamed",
    "wrong": "named wrongly",
    "unnoticed": "not noticed",
}
"""What becomes of a drop, and the heading in the table."""
_HEAD = """\
# Which faults of a rig are named

`./run bench diagnoses --drops {drops} --clean {clean}`: on each layout, {drops} drops of a rig
with one fault, and {clean} without a fault. A fault within the protocol's own ± is rightly not
noticed. By layout: `diagnoses.csv`."""
NONE = "no fault"
_STRIDE = 5  # from run to run of a plan: all inclinations and either chain come soon
_BY_NAME = {kind.name: kind for kind in KINDS}
LAYOUTS = (
    GateLayout(STANDARD, (25, 70), (20, 80)),
    GateLayout(STANDARD, (25,), (20, 80, 150)),
    GateLayout(STANDARD, (22, 34, 70, 130), (20, 60, 100, 140)),
    GateLayout(
        STANDARD, (22, 34, 70, 130, 204, 350, 690, 1078), (20, 60, 100, 140, 204, 350, 690, 1078)
    ),
    under(_BY_NAME["10 rods"], (0.2, 0.65), (0.18, 0.6)),
    under(_BY_NAME["thin at the top"], (0.2, 0.3, 0.45, 0.7), (0.18, 0.35, 0.55, 0.75)),
    under(_BY_NAME["uneven"], (0.2, 0.65), (0.18, 0.6)),
    under(
        Kind("unlike", _BY_NAME["thin at the top"].chain, other=STANDARD.chain),
        (0.2, 0.3, 0.45, 0.7),
        (0.18, 0.35, 0.55, 0.75),
    ),
    under(SINGLE, (0.2, 0.3, 0.45, 0.7), ()),
    under(FENCE, (), (0.18, 0.35, 0.55, 0.75)),
)
"""All that the bench tries."""


@dataclass(slots=True)
class DiagnosisTally:
    """A fault of one size on one layout.

    Attributes
    ----------
    chain, heights_mm
        The layout in words.
    fault, size
        What is wrong, and how much.
    outcomes
        How many drops ended as each of `OUTCOMES`.
    said
        Reasons of those that accuse something else, and of those that name nothing.
    """

    chain: str
    heights_mm: str
    fault: str
    size: str = ""
    outcomes: Counter[str] = field(default_factory=Counter)
    said: list[str] = field(default_factory=list)

    def add(self, result: DropResult) -> None:
        """Count what was said of one drop."""
        outcome = judged(self.fault, result)
        self.outcomes[outcome] += 1
        if outcome in {"wrong", "unnamed"}:
            self.said.append(sentences(result.reasons))

    def json(self) -> dict[str, Any]:
        """Return the figures to report."""
        named = {name: getattr(self, name) for name in ("chain", "heights_mm", "fault", "size")}
        return named | {name: self.outcomes[name] for name in OUTCOMES} | {"said": self.said}


def judged(fault: str, result: DropResult) -> str:
    """Return which of `OUTCOMES` the reasons of a drop with a fault are."""
    codes = {reason.code for reason in result.reasons}
    accused = {rig.name for rig in WRONG_RIGS if rig.codes & codes} | ({"braked"} & codes)
    if accused == {fault}:
        return "right"
    if accused:
        return "wrong"
    likely = {
        candidate["code"]
        for reason in result.reasons
        for candidate in reason.values.get("candidates", ())
    }
    if any(rig.codes & likely for rig in WRONG_RIGS if rig.name == fault):
        return "likely"
    return "unnamed" if result.reasons else "unnoticed"


def run(arguments: Namespace) -> Iterator[Findings]:
    """Drop chains on rigs with one fault each, and on faultless ones."""
    layouts = chosen(LAYOUTS, arguments.only)
    clean = CLEAN if arguments.clean is None else arguments.clean
    drops = arguments.drops or DROPS
    records: list[dict[str, Any]] = []
    calls = [(cells, layout, drops, clean) for layout in layouts]
    for layout, tallies in zip(layouts, results(calls, arguments.jobs), strict=True):
        records += [tally.json() for tally in tallies]
        say(f"{layout.kind.name}: done")
    rows = [{name: row[name] for name in row if name != "said"} for row in records]
    head = _HEAD.format(drops=drops, clean=clean)
    yield Findings({"diagnoses": records}, _lines(records), head, rows, simulated=True)


def _lines(records: Sequence[Mapping[str, Any]]) -> list[str]:
    """One row a fault and size, all layouts together."""
    rows: dict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    for record in records:
        rows[record["fault"], record["size"]].update({name: record[name] for name in OUTCOMES})
    table = [
        [*words, *(str(counts[name] or "–") for name in OUTCOMES)] for words, counts in rows.items()
    ]
    return text_table([["fault", "size", *OUTCOMES.values()], *table], left={0, 1}, rule=True)


@dataclass(frozen=True, slots=True)
class _Case:
    """What a cell's drops are made from."""

    cell: DiagnosisTally
    asked: Asked
    slow: float = 0.0


@one_thread
def cells(layout: GateLayout, drops: int, clean: int) -> list[DiagnosisTally]:
    """Let chains fall on one layout, with each fault and without."""
    with TemporaryDirectory() as folder:
        cases = [*_cases(layout, Path(folder), drops, clean)]
        protocol = reader.parse(layout.protocol())
        planned = {run.number: run for run in protocol.runs()}
        all_falls = falls([case.asked for case in cases])
        for case in cases:
            for fall in islice(all_falls, len(case.asked.seeds)):
                scale = time_scale(fall.seed)
                slow = TimeScale(scale.hz / (1.0 - case.slow), scale.u)
                result, _ = DropCase(protocol, planned[fall.drop.run], fall.drop, slow).read()
                case.cell.add(result)
    return [case.cell for case in cases]


def _cases(layout: GateLayout, folder: Path, drops: int, clean: int) -> Iterator[_Case]:
    stated = layout.protocol()
    numbers = [run.number for run in reader.parse(stated).runs()]
    wanted = [
        (text, fault.settings(size), drops, fault.slow(size), fault.name, fault.words(size))
        for fault in WRONG_RIGS
        for size, text in fault.rigs(stated)
    ]
    first = 1
    for text, settings, count, slow, fault, words in [*wanted, (stated, {}, clean, 0.0, NONE, "")]:
        path = folder / f"{first}.yaml"
        path.write_text(text, encoding="utf-8")
        chosen_runs = [[numbers[_STRIDE * (first + n) % len(numbers)]] for n in range(count)]
        asked = Asked(simulation(path, settings), range(first, first + count), chosen_runs)
        yield _Case(DiagnosisTally(layout.kind.name, layout.heights, fault, words), asked, slow)
        first += count
