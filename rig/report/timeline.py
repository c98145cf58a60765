"""Timelines of drops: a line for each gate, with a bar while its beam was blocked."""

from collections import defaultdict
from collections.abc import Sequence
from fractions import Fraction
from itertools import accumulate, groupby, pairwise
from operator import itemgetter
from statistics import median
from typing import NamedTuple

from rig.analysis.result import DropResult
from rig.protocol.protocol import Gate
from rig.records import Drop
from rig.report.falls import TimedDrop

_LEFT, _WIDTH, _LANE = 112, 640, 15
_STEPS_MS = (1, 2, 5, 10, 20, 50, 100, 200, 500)
_MOST_NUMBERS = 12
_LONGEST = 2.0  # longest time shown, in units of the median drop
_ROOM = 480_000
"""Most characters of all timelines together, see `rig.report.attachments`."""
_AROUND = 900  # characters of a timeline's frame and caption
_FINE = 2  # steps in a pixel: whole numbers keep a page with a hundred drops small


class Lanes(NamedTuple):
    """Common layout of all timelines of a page: gates from the top down, and the time range."""

    gates: tuple[Gate, ...]
    span_ms: float

    @property
    def ticks(self) -> list[tuple[int, float]]:
        """Ticks of the time axis, ms, and their positions."""
        step = next((ms for ms in _STEPS_MS if self.span_ms / ms <= _MOST_NUMBERS), 1000)
        per_ms = _WIDTH / self.span_ms
        return [(ms, _LEFT + ms * per_ms) for ms in range(0, int(self.span_ms) + 1, step)]


class Timeline(NamedTuple):
    """A drop's shadows and unexplained edges, as SVG path data."""

    result: DropResult
    bars: str
    odd: str


def timelines(gates: Sequence[Gate], timed: Sequence[TimedDrop]) -> tuple[Lanes, list[Timeline]]:
    """Return the timelines of blocked beams, within the limit of size.

    Parameters
    ----------
    timed
        Each raw record with its calibrated ticks per second and its result.

    Returns
    -------
    Lanes, list of Timeline
        Common layout, and the timelines of the drops that fit.
    """
    shared = lanes(gates, timed)
    drawn = [timeline(shared, drop) for drop in timed]
    # If not all fit, drops that are not accepted come first.
    drawn.sort(key=lambda drop: drop.result.verdict == "accepted")
    sizes = accumulate(len(drop.bars) + len(drop.odd) + _AROUND for drop in drawn)
    return shared, [
        drop for drop, size in zip(drawn, sizes, strict=True) if drop.bars and size < _ROOM
    ]


def lanes(gates: Sequence[Gate], timed: Sequence[TimedDrop]) -> Lanes:
    """Return the layout: gates sorted with the impact side first, and the time range."""
    ordered = sorted(gates, key=lambda gate: (gate.side != "impact", -gate.height))
    spans = [times[-1] for drop, hz, _ in timed if (times := _times_ms(drop, hz))] or [1.0]
    return Lanes(tuple(ordered), max(1.0, min(max(spans), _LONGEST * median(spans))))


def timeline(lanes: Lanes, timed: TimedDrop) -> Timeline:
    """Return the timeline of a drop's blocked beams.

    Parameters
    ----------
    lanes
        Common layout of the page.
    drop
        The raw record.
    hz
        Calibrated ticks per second.
    result
        Result with the matched edges; without matches, no edge counts as unexplained.
    """
    drop, hz, result = timed
    end = _FINE * _WIDTH
    places = [round(ms * end / lanes.span_ms) for ms in _times_ms(drop, hz)]
    bars, marks, matches = "", "", result.matches
    channels = defaultdict[int, list[tuple[int, bool, bool]]](list)
    for n, (edge, place) in enumerate(zip(drop.edges, places, strict=True)):
        if place <= end:
            channels[edge.channel].append((place, edge.blocked, n in matches))
    for number, gate in enumerate(lanes.gates):
        y, own = _LANE * (_FINE * number + 1), channels[gate.channel]
        # Bars run from each change to the next; an edge without a change has no effect.
        states = [(0, bool(drop.initial_state >> gate.channel & 1), True), *own, (end, None, True)]
        changes = [next(same) for _, same in groupby(states, key=itemgetter(1))]
        pen, lane = 0, ""
        for (begin, blocked, _), (until, *_) in pairwise(changes if places else ()):
            if blocked:
                lane += f"m{begin - pen} 0h{max(until - begin, 1)}"
                pen = max(until, begin + 1)
        bars += lane and f"M0 {y}{lane}"
        for place, _, matched in own if matches else ():
            marks += "" if matched else f"M{place} {y}m0-10v20"
    return Timeline(result, bars, marks)


def _times_ms(drop: Drop, hz: float | Fraction) -> list[float]:
    """Return the time of each edge, ms."""
    times = [1e3 * float(edge.tick / hz) for edge in drop.edges]
    # Imported times are relative to a whole second, not to the release.
    begin = 0.0 if drop.fire_tick is not None and times[:1] >= [0.0] else min(times, default=0.0)
    return [time - begin for time in times]
