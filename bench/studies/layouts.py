"""On which layouts of gates are drops read, and rightly? Against the simulation's hidden truth."""

from __future__ import annotations

import math
import re
import time
from collections import Counter
from dataclasses import asdict, dataclass, field
from itertools import chain, islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bench.studies.baselines import plain_fit
from bench.studies.fast_accuracy import DOUBLED, STACK
from bench.workers import results
from rig.analysis.drop import fit_drop
from rig.analysis.result import GOOD
from rig.bench.falls import HZ, STRAY, Asked, falls, time_scale, with_setting
from rig.protocol import reader
from rig.protocol.plan import runs
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from bench.studies.layout_catalogue import GateLayout
    from rig.analysis.result import DropResult
    from rig.bench.falls import SimulatedDrop
    from rig.protocol.protocol import Protocol, Run

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
_NUMBER = re.compile(r"[-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


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
            found = result.quantities[self.measured]
            error = found.value - fall.truth[self.measured]
            sums.measured += 1
            sums.errors += error**2
            sums.ratios += (error / found.u) ** 2
            sums.worst = max(sums.worst, abs(error / found.u))

    def share(self, verdict: str) -> float:
        """Share of a verdict in the drops that count; 0 where none does."""
        return self.verdicts[verdict] / max(1, self.verdicts.total())

    def json(self) -> dict[str, Any]:
        """Return the figures to report; `read` makes the same cell of them."""
        sums = self.sums
        return {name: getattr(self, name) for name in _TOLD} | {
            "verdicts": dict(sorted(self.verdicts.items())),
            "void_share": self.share("void"),
            "marginal_share": self.share("marginal"),
            "error_rms": _rms(sums.errors, sums.measured),
            "z_rms": _rms(sums.ratios, sums.measured),
            "z_worst": sums.worst if sums.measured else None,
            "ms_per_drop": 1e3 * sums.seconds / max(1, self.drops),
            "times_lstsq": _ratio(sums.good_seconds, sums.plain_seconds),
            "reasons": dict(self.reasons.most_common()),
            "sums": asdict(sums),
        }

    @classmethod
    def read(cls, said: Mapping[str, Any]) -> Cell:
        """Take a cell from what `json` returned."""
        return cls(
            **{name: said[name] for name in _TOLD},
            verdicts=Counter(said["verdicts"]),
            reasons=Counter(said["reasons"]),
            sums=Sums(**said["sums"]),
        )


_TOLD = ("chain", "gates", "heights_mm", "disturbance", "drops", "beyond", "wrong", "edges",
         "wrong_edges", "strays", "measured")  # fmt: skip


def _ratio(one: float, other: float) -> float | None:
    return one / other if other > 0.0 else None


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


def study(
    layouts: Sequence[GateLayout],
    drops: int,
    jobs: int | None,
    say: Callable[[str], None],
    before: Sequence[Cell] = (),
) -> list[Cell]:
    """Let chains fall on every layout with every disturbance.

    Parameters
    ----------
    drops
        In each cell.
    jobs
        Layouts at a time; as many as there are processors if not given.
    say
        Told how far it is.
    before
        What was found before, to which these drops are added; each is on a further rig.

    Returns
    -------
    list
        In the order of the layouts, each with its disturbances; then what was found on others.
    """
    known: dict[tuple[str, str], list[Cell]] = {}
    for cell in before:
        known.setdefault((cell.chain, cell.heights_mm), []).append(cell)
    calls = [(cells, one, drops, known.pop((one.kind.name, one.heights), ())) for one in layouts]
    found: list[Cell] = []
    for n, some in enumerate(results(calls, jobs), 1):
        found += some
        say(f"{n} of {len(layouts)}: {some[0].chain}, {some[0].gates} gates")
    return [*found, *chain(*known.values())]


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
        found = [
            begun.get(name) or Cell(layout.kind.name, layout.gates, layout.heights, name)
            for name in DISTURBANCES
        ]
        rigs = [range(cell.drops, cell.drops + drops) for cell in found]
        asked = [
            Asked(
                _url(path, settings),
                [1 + n for n in mine],
                [[numbers[_STRIDE * n % len(numbers)]] for n in mine],
            )
            for settings, mine in zip(DISTURBANCES.values(), rigs, strict=True)
        ]
        all_falls = falls(asked)
        for cell in found:
            _fill(cell, protocol, planned, islice(all_falls, drops))
    return found


def _url(path: Path, settings: Mapping[str, str]) -> str:
    url = with_setting("sim://", "protocol", str(path))
    for name, value in settings.items():
        url = with_setting(url, name, value)
    return url


def _fill(
    cell: Cell, protocol: Protocol, planned: Mapping[int, Run], made: Iterable[SimulatedDrop]
) -> None:
    """Analyse drops, and compare each with its truth."""
    for fall in made:
        begin = time.process_time()
        result, _ = fit_drop(protocol, planned[fall.drop.run], fall.drop, time_scale(fall.seed))
        cell.add(protocol, fall, result, time.process_time() - begin)


def totals(found: Sequence[Cell]) -> list[dict[str, Any]]:
    """Sum up over layouts, one line a disturbance."""
    return [
        _total(name, [one for one in found if one.disturbance == name]) for name in DISTURBANCES
    ]


def _total(name: str, of: Sequence[Cell]) -> dict[str, Any]:
    verdicts = sum((one.verdicts for one in of), Counter[str]())
    counted = max(1, verdicts.total())
    sums = [one.sums for one in of]
    drops = sum(one.drops for one in of)
    return {
        "disturbance": name,
        "drops": drops,
        "beyond": sum(one.beyond for one in of),
        "void_share": verdicts["void"] / counted,
        "marginal_share": verdicts["marginal"] / counted,
        "wrong": sum(one.wrong for one in of),
        "edges": sum(one.edges for one in of),
        "wrong_edges": sum(one.wrong_edges for one in of),
        "z_rms": _rms(sum(one.ratios for one in sums), sum(one.measured for one in sums)),
        "ms_per_drop": 1e3 * sum(one.seconds for one in sums) / max(1, drops),
        "times_lstsq": _ratio(
            sum(one.good_seconds for one in sums), sum(one.plain_seconds for one in sums)
        ),
    }


def as_json(found: Sequence[Cell]) -> dict[str, Any]:
    """``{"layouts": [...], "totals": [...], "reasons": {...}}``, the most frequent reason first."""
    reasons = sum((one.reasons for one in found), Counter[str]())
    return {
        "layouts": [cell.json() for cell in found],
        "totals": totals(found),
        "reasons": dict(reasons.most_common()),
    }
