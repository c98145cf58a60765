"""Timelines of drops: a line for each gate, with a bar while its beam was blocked."""

from __future__ import annotations

from html import escape
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from fractions import Fraction

    from rig.analysis.result import DropResult
    from rig.protocol.protocol import Gate
    from rig.records import Drop

_LEFT, _WIDTH, _RIGHT = 112.0, 640.0, 24.0
_LANE, _FOOT = 15.0, 34.0
_STEPS_MS = (1, 2, 5, 10, 20, 50, 100, 200, 500)
_MOST_NUMBERS = 12
_LONGEST = 2.0  # times as long as most: what falls later in a drop is not drawn
_FINE = 2  # steps of a pixel: whole numbers keep a page with a hundred drops small


class Lanes(NamedTuple):
    """What all timelines of a page have in common: gates from the top down, and the time shown."""

    gates: tuple[Gate, ...]
    span_ms: float

    @property
    def height(self) -> float:
        """Of a timeline."""
        return _LANE * len(self.gates) + _FOOT

    @property
    def svg(self) -> str:
        """A line with its name for each gate, and the axis of time."""
        two_sides = len({gate.side for gate in self.gates}) > 1
        parts = []
        for place, gate in enumerate(self.gates):
            y = _LANE * (place + 0.5)
            words = f"{gate.side if two_sides else ''} {1e3 * gate.height:g} mm".strip()
            parts += [
                _text(_LEFT - 6, y + 3.5, words, "end"),
                f'<path class="lane" d="M{_LEFT:g} {y:g}h{_WIDTH:g}"/>',
            ]
        foot, per_ms = _LANE * len(self.gates), _WIDTH / self.span_ms
        step = next((ms for ms in _STEPS_MS if self.span_ms / ms <= _MOST_NUMBERS), 1000)
        numbers = range(0, int(self.span_ms) + 1, step)
        ticks = "".join(f"M{_LEFT + ms * per_ms:.1f} {foot:g}v4" for ms in numbers)
        parts.append(f'<path class="lane-axis" d="M{_LEFT:g} {foot:g}h{_WIDTH:g}{ticks}"/>')
        parts += [_text(_LEFT + ms * per_ms, foot + 15, str(ms), "middle") for ms in numbers]
        words = "time since the release (ms)"
        return "".join([*parts, _text(_LEFT + _WIDTH / 2, foot + 30, words, "middle")])


def lanes(gates: Sequence[Gate], drops: Sequence[tuple[Drop, float | Fraction]]) -> Lanes:
    """Sort gates, the side that strikes first, and find the time that all drops need.

    Parameters
    ----------
    drops
        Each with its calibrated ticks per second.
    """
    ordered = sorted(gates, key=lambda gate: (gate.side != "impact", -gate.height))
    spans = [times[-1] for drop, hz in drops if (times := _times_ms(drop, hz))] or [1.0]
    return Lanes(tuple(ordered), max(1.0, min(max(spans), _LONGEST * median(spans))))


def timeline(lanes: Lanes, drop: Drop, hz: float | Fraction, result: DropResult) -> str:
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
        Which of its edges were matched; the others are drawn as marks.

    Returns
    -------
    str
        SVG for a page that has its colours and `Lanes.svg`; empty where there is no edge.
    """
    if not drop.edges:
        return ""
    per_ms = _FINE * _WIDTH / lanes.span_ms
    places = [round(ms * per_ms) for ms in _times_ms(drop, hz)]
    bars = odd = ""
    for number, gate in enumerate(lanes.gates):
        y = f"{_LANE * (number + 0.5):g}"
        at = {
            n: place
            for n, (edge, place) in enumerate(zip(drop.edges, places, strict=True))
            if edge.channel == gate.channel and place <= _FINE * _WIDTH
        }
        pen = 0
        for begin, end in _spans(drop, at, blocked=bool(drop.initial_state >> gate.channel & 1)):
            bars += f"m{begin - pen} 0h{end - begin}" if pen else f"M{begin} {y}h{end - begin}"
            pen = end
        odd += "".join(f"M{place} {y}m0-5v10" for n, place in at.items() if n not in result.matches)
    placed = f'transform="translate({_LEFT:g} 0)scale({1 / _FINE:g} 1)"'
    marks = f'<path class="lane-odd" {placed} d="{odd}"/>' if odd and result.matches else ""
    return (
        f'<svg viewBox="0 0 {_LEFT + _WIDTH + _RIGHT:g} {lanes.height:g}" role="img" '
        f'aria-label="{escape(_alt(result))}"><use href="#lanes"/>'
        f'<path class="lane-bar" {placed} d="{bars}"/>{marks}</svg>'
    )


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
        yield since, max(round(_FINE * _WIDTH), since + 1)


def _text(x: float, y: float, words: str, anchor: str) -> str:
    return (
        f'<text class="lane-name" x="{x:.5g}" y="{y:g}" text-anchor="{anchor}">'
        f"{escape(words)}</text>"
    )


def _alt(result: DropResult) -> str:
    audit = result.audit
    return (
        f"When the gates were blocked in run {result.run.number}, attempt {result.attempt}: "
        f"{audit.matched} edges matched, {audit.missed} missed, {audit.spurious} unexplained"
    )
