"""Timelines of drops: a line for each gate, with a bar while its beam was blocked."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING, NamedTuple

from rig.measurands import averaged
from rig.report.numbers import plus_minus

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from fractions import Fraction

    from rig.analysis.result import DropResult
    from rig.protocol.protocol import Gate
    from rig.records import Drop

_LEFT, _WIDTH, _LANE = 112, 640, 15
_STEPS_MS = (1, 2, 5, 10, 20, 50, 100, 200, 500)
_MOST_NUMBERS = 12
_LONGEST = 2.0  # times as long as most: what falls later in a drop is not drawn
_ROOM = 480_000
"""Characters of all timelines together, see `rig.report.attachments`."""
_AROUND = 900  # characters of a timeline's frame and caption
_FINE = 2  # steps of a pixel: whole numbers keep a page with a hundred drops small


class Lanes(NamedTuple):
    """What all timelines of a page have in common: gates from the top down, and the time shown."""

    gates: tuple[Gate, ...]
    span_ms: float

    @property
    def ticks(self) -> list[tuple[int, float]]:
        """Milliseconds on that axis, and where they are."""
        step = next((ms for ms in _STEPS_MS if self.span_ms / ms <= _MOST_NUMBERS), 1000)
        per_ms = _WIDTH / self.span_ms
        return [(ms, _LEFT + ms * per_ms) for ms in range(0, int(self.span_ms) + 1, step)]


class Timeline(NamedTuple):
    """A drop's shadows and unexplained edges, as SVG path data, and what is said beside them."""

    result: DropResult
    bars: str
    odd: str
    numbers: str

    @property
    def anchor(self) -> str:
        """Its place on the page."""
        return f"drop-{self.result.run.number}-{self.result.attempt}"


def timelines(
    gates: Sequence[Gate], timed: Sequence[tuple[Drop, float | Fraction, DropResult]]
) -> tuple[Lanes, dict[int, Timeline]]:
    """Draw when each beam was blocked, as far as there is room.

    Parameters
    ----------
    timed
        Each raw record with its calibrated ticks per second and its result.

    Returns
    -------
    Lanes, dict of int to Timeline
        What all have in common; those drawn, by number.
    """
    shared, shown, left = lanes(gates, timed), {}, _ROOM
    # Those that do not count come first where not all have room.
    for number in sorted(range(len(timed)), key=lambda n: (timed[n][-1].verdict == "accepted", n)):
        drawn = timeline(shared, *timed[number])
        left -= len(drawn.bars) + len(drawn.odd) + _AROUND
        if drawn.bars and left > 0:
            shown[number] = drawn
    return shared, dict(sorted(shown.items()))


def lanes(
    gates: Sequence[Gate], timed: Sequence[tuple[Drop, float | Fraction, DropResult]]
) -> Lanes:
    """Sort gates, the side that strikes first, and find the time that all drops need."""
    ordered = sorted(gates, key=lambda gate: (gate.side != "impact", -gate.height))
    spans = [times[-1] for drop, hz, _ in timed if (times := _times_ms(drop, hz))] or [1.0]
    return Lanes(tuple(ordered), max(1.0, min(max(spans), _LONGEST * median(spans))))


def timeline(lanes: Lanes, drop: Drop, hz: float | Fraction, result: DropResult) -> Timeline:
    """Draw when each beam was blocked.

    Parameters
    ----------
    lanes
        Of all drops of the page.
    drop
        The raw record.
    hz
        Calibrated ticks per second.
    result
        Which of its edges were matched; where none was, none is unexplained.
    """
    places = [round(ms * _FINE * _WIDTH / lanes.span_ms) for ms in _times_ms(drop, hz)]
    bars = marks = ""
    for number, gate in enumerate(lanes.gates):
        y = f"{_LANE * (number + 0.5):g}"
        at = {
            n: place
            for n, (edge, place) in enumerate(zip(drop.edges, places, strict=True))
            if edge.channel == gate.channel and place <= _FINE * _WIDTH
        }
        pen = 0
        blocked = bool(drop.initial_state >> gate.channel & 1)
        for begin, end in _spans(drop, at, blocked=blocked) if places else ():
            bars += f"m{begin - pen} 0h{end - begin}" if pen else f"M{begin} {y}h{end - begin}"
            pen = end
        if result.matches:
            odd = [place for n, place in at.items() if n not in result.matches]
            marks += "".join(f"M{place} {y}m0-5v10" for place in odd)
    values = [
        f", {row.symbol} {plus_minus(value, row.scale, row.decimals)} {row.unit}"
        for row in averaged()
        if (value := result.quantities.get(row.name)) is not None
    ]
    return Timeline(result, bars, marks, "".join(values))


def _times_ms(drop: Drop, hz: float | Fraction) -> list[float]:
    """Return the time of each edge, ms."""
    times = [1e3 * float(edge.tick / hz) for edge in drop.edges]
    # Imported edges are counted from a whole second, not from the release.
    begin = 0.0 if drop.fire_tick is not None and times[:1] >= [0.0] else min(times, default=0.0)
    return [time - begin for time in times]


def _spans(drop: Drop, at: dict[int, int], *, blocked: bool) -> Iterator[tuple[int, int]]:
    """Yield from where to where a beam was blocked, from the first edge or from the start."""
    since = 0 if blocked else None
    for number, place in at.items():
        if drop.edges[number].blocked:
            since = place if since is None else since
        elif since is not None:
            yield since, max(place, since + 1)
            since = None
    if since is not None:
        yield since, max(_FINE * _WIDTH, since + 1)
