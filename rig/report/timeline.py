"""Timeline of a drop: a line for each gate, with a bar while its beam was blocked."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

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
_FINE = 2  # steps of a pixel: whole numbers keep a page with a hundred drops small


@dataclass(frozen=True, slots=True)
class Timeline:
    """A drop's picture.

    Attributes
    ----------
    result
        What came of it.
    svg
        The picture; empty where no edge was recorded.
    """

    result: DropResult
    svg: str


def timeline(gates: Sequence[Gate], drop: Drop, hz: float | Fraction, result: DropResult) -> str:
    """Draw when each beam was blocked.

    Parameters
    ----------
    gates
        Of the protocol: a lane each, the highest at the top, the side that strikes first.
    drop
        The raw record.
    hz
        Calibrated ticks per second.
    result
        Which of its edges were matched; the others are drawn as marks.

    Returns
    -------
    str
        SVG for a page that has its colours; empty where there is no edge.
    """
    if not drop.edges:
        return ""
    two_sides = len({gate.side for gate in gates}) > 1
    ordered = sorted(gates, key=lambda gate: (gate.side != "impact", -gate.height))
    times = [1e3 * float(edge.tick / hz) for edge in drop.edges]
    # Imported edges are counted from a whole second, not from the release.
    begin = 0.0 if drop.fire_tick is not None and times[0] >= 0.0 else times[0]
    per_ms = _WIDTH / max(times[-1] - begin, 1.0)
    height = _LANE * len(ordered) + _FOOT
    parts = [
        f'<svg viewBox="0 0 {_LEFT + _WIDTH + _RIGHT:g} {height:g}" class="lanes" role="img" '
        f'aria-label="{escape(_alt(result))}">'
    ]
    for place, gate in enumerate(ordered):
        y = _LANE * (place + 0.5)
        side = f"{gate.side} " if two_sides else ""
        parts.append(
            f'<text x="{_LEFT - 6:g}" y="{y + 3.5:g}" text-anchor="end">{side}'
            f'{1e3 * gate.height:g} mm</text><path class="lane" d="M{_LEFT:g} {y:g}h{_WIDTH:g}"/>'
        )
        at = {
            n: round(_FINE * (times[n] - begin) * per_ms)
            for n, edge in enumerate(drop.edges)
            if edge.channel == gate.channel
        }
        bars = "".join(_bars(drop, at, blocked=bool(drop.initial_state >> gate.channel & 1)))
        odd = "".join(f"M{x}-5v10" for n, x in at.items() if n not in result.matches)
        placed = f'transform="translate({_LEFT:g} {y:g})scale({1 / _FINE:g} 1)"'
        parts += [f'<path class="blocked" {placed} d="{bars}"/>'] if bars else []
        parts += [f'<path class="odd" {placed} d="{odd}"/>'] if odd and result.matches else []
    parts += _axis(_LANE * len(ordered), times[-1] - begin, per_ms)
    return "".join([*parts, "</svg>"])


def _bars(drop: Drop, at: dict[int, int], *, blocked: bool) -> Iterator[str]:
    """Yield a stroke for each time a beam was blocked, from the first edge or from the start."""
    since, pen = 0 if blocked else None, 0
    spans = []
    for n, x in at.items():
        if drop.edges[n].blocked:
            since = x if since is None else since
        elif since is not None:
            spans.append((since, max(x, since + 1)))
            since = None
    if since is not None:
        spans.append((since, round(_FINE * _WIDTH)))
    for begin, end in spans:
        yield f"{'m' if pen else 'M'}{begin - pen} 0h{end - begin}"
        pen = end


def _axis(y: float, span_ms: float, per_ms: float) -> Iterator[str]:
    step = next((one for one in _STEPS_MS if span_ms / one <= _MOST_NUMBERS), 1000)
    yield f'<path class="axis" d="M{_LEFT:g} {y:g}h{_WIDTH:g}"/>'
    for value in range(0, int(span_ms) + 1, step):
        x = _LEFT + value * per_ms
        yield f'<path class="axis" d="M{x:.1f} {y:g}v4"/>'
        yield f'<text x="{x:.1f}" y="{y + 15:g}" text-anchor="middle">{value}</text>'
    yield (
        f'<text x="{_LEFT + _WIDTH / 2:g}" y="{y + 30:g}" text-anchor="middle">'
        "time since the release (ms)</text>"
    )


def _alt(result: DropResult) -> str:
    audit = result.audit
    return (
        f"When the gates were blocked in run {result.run.number}, attempt {result.attempt}: "
        f"{audit.matched} edges matched, {audit.missed} missed, {audit.spurious} unexplained"
    )
