"""How many faults of a rig are named rightly, and how many where there is none."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.studies.layout_catalogue import FENCE, KINDS, SINGLE, STANDARD, GateLayout, Kind, under
from bench.studies.wrong_rigs import WRONG_RIGS
from bench.workers import results
from rig.analysis.drop import fit_drop
from rig.bench.falls import Asked, falls, time_scale, with_setting
from rig.clock.calibration import TimeScale
from rig.protocol import reader
from rig.protocol.plan import runs
from rig.reasons import sentences
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rig.analysis.result import DropResult

DROPS = 2
"""With each fault of each size on each layout, every one on a rig of its own."""
CLEAN = 100
"""Drops on each layout without a fault."""
OUTCOMES = ("right", "likely", "unnamed", "wrong", "unnoticed")
"""Named rightly; among the likeliest of several; void or remarked without a name; something else
is accused; accepted without a word."""
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
    accused = {rig.name for rig in WRONG_RIGS if rig.codes & codes}
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


def study(
    layouts: Sequence[GateLayout],
    drops: int,
    clean: int,
    jobs: int | None,
    say: Callable[[str], None],
) -> list[DiagnosisTally]:
    """Let chains fall on each layout, of rigs with one fault each and of faultless ones.

    Parameters
    ----------
    drops, clean
        With each size of each fault, and without any.
    jobs
        Layouts at a time; as many as there are processors if not given.
    say
        Told how far it is.
    """
    found: list[DiagnosisTally] = []
    for layout, some in zip(
        layouts, results([(cells, one, drops, clean) for one in layouts], jobs), strict=True
    ):
        found += some
        say(f"{layout.kind.name}: done")
    return found


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
        planned = {run.number: run for run in runs(protocol)}
        all_falls = falls([one.asked for one in cases])
        for one in cases:
            for fall in islice(all_falls, len(one.asked.seeds)):
                scale = time_scale(fall.seed)
                slow = TimeScale(scale.hz / (1.0 - one.slow), scale.u)
                result, _ = fit_drop(protocol, planned[fall.drop.run], fall.drop, slow)
                one.cell.add(result)
    return [one.cell for one in cases]


def _cases(layout: GateLayout, folder: Path, drops: int, clean: int) -> list[_Case]:
    stated = layout.protocol()
    numbers = [run.number for run in runs(reader.parse(stated))]
    found: list[_Case] = []

    def add(
        text: str, settings: dict[str, str], count: int, slow: float, fault: str, words: str = ""
    ) -> None:
        path = folder / f"{len(found)}.yaml"
        path.write_text(text, encoding="utf-8")
        url = with_setting("sim://", "protocol", str(path))
        for name, value in settings.items():
            url = with_setting(url, name, value)
        first = 1 + sum(len(one.asked.seeds) for one in found)
        made = [[numbers[_STRIDE * (first + n) % len(numbers)]] for n in range(count)]
        cell = DiagnosisTally(layout.kind.name, layout.heights, fault, words)
        found.append(_Case(cell, Asked(url, range(first, first + count), made), slow))

    for fault in WRONG_RIGS:
        for size, text in fault.rigs(stated):
            words = f"{size:+g} {fault.unit}".strip() if fault.unit else ""
            add(text, dict(fault.settings(size)), drops, fault.slow(size), fault.name, words)
    add(stated, {}, clean, 0.0, NONE)
    return found
