"""An indicator a gate: state, edges, steadiness; told by shape and word, not colour alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rich.segment import Segment
from textual.strip import Strip
from textual.widget import Widget

if TYPE_CHECKING:
    from collections.abc import Sequence

    from textual.geometry import Size

    from rig.protocol.scene import Gate, Protocol
    from rig.tui.indicators import Indicator, Indicators

_WIDE, _SHORT = 50, 34
"""Widths of one indicator with all words, and with the needed ones."""
_MOST = 8
"""Indicators above each other: more would not fit a low screen."""


class Span(NamedTuple):
    """Text and its component class; none for the board's own look."""

    text: str
    look: str = ""


class GateBoard(Widget):
    """All gates, one side beside the other.

    Every indicator changes at every tick of a drop: lines are made of a few parts each, without the
    wrapping and styling that other text goes through.
    """

    COMPONENT_CLASSES = {"gate--title", "gate--unknown", "gate--blocked", "gate--clear"}  # noqa: RUF012
    DEFAULT_CSS = """
    GateBoard { height: auto; padding: 0 1; }
    GateBoard > .gate--title { text-style: bold; }
    GateBoard > .gate--unknown { color: $foreground 70%; }
    GateBoard > .gate--blocked { color: $warning; text-style: bold; }
    GateBoard > .gate--clear { color: $success; }
    """

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self._rows: list[list[Span]] = []

    def show(self, protocol: Protocol | None, indicators: Indicators, now_s: float) -> None:
        """Draw what the gates do now."""
        self._take(board(protocol, indicators, now_s, self.size.width or 78))

    def clear(self) -> None:
        """Draw nothing."""
        self._take([])

    def _take(self, rows: list[list[Span]]) -> None:
        if rows != self._rows:
            higher = len(rows) != len(self._rows)
            self._rows = rows
            self.refresh(layout=higher)

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """As many lines as there are."""
        del container, viewport, width
        return len(self._rows)

    def render_line(self, y: int) -> Strip:
        """One line."""
        plain, width = self.rich_style, self.size.width
        parts = self._rows[y] if y < len(self._rows) else []
        line = [
            Segment(text, self.get_component_rich_style(look) if look else plain)
            for text, look in parts
        ]
        return Strip(line).adjust_cell_length(width, plain)


def board(
    protocol: Protocol | None, indicators: Indicators, now_s: float, width: int
) -> list[list[Span]]:
    """Draw the indicators in a width of characters."""
    if protocol is None or protocol.gates is None:
        return [[Span("no gates in this scene")]]
    by_channel = {one.channel: one for one in indicators.gates}
    columns: list[tuple[str, list[Gate]]] = []
    for side in ("impact", "free"):
        gates = sorted(protocol.gates.on(side), key=lambda gate: -gate.height)
        for begin in range(0, len(gates), _MOST):
            title = "" if begin else f"{side} side"
            columns.append((title, gates[begin : begin + _MOST]))
    wide = width // len(columns)
    rows = [[Span("".join(title.ljust(wide) for title, _ in columns), "gate--title")]]
    for at in range(max(len(gates) for _, gates in columns)):
        row: list[Span] = []
        for _, gates in columns:
            if at < len(gates):
                indicator = by_channel.get(gates[at].channel)
                row += _indicator(gates[at], indicator, indicators, now_s, wide)
            else:
                row.append(Span(" " * wide))
        rows.append(row)
    return rows


def _indicator(
    gate: Gate, indicator: Indicator | None, indicators: Indicators, now_s: float, width: int
) -> list[Span]:
    if indicator is None or not indicators.known:
        symbol, look, word = "?", "gate--unknown", "unknown"
    elif indicator.blocked:
        symbol, look, word = "●", "gate--blocked", "BLOCKED"
    else:
        symbol, look, word = "○", "gate--clear", "clear"
    edges = 0 if indicator is None else indicator.edges
    quiet = ""
    if indicator is not None and indicators.known:
        quiet = (
            "FLICKERS" if indicator.flickers(now_s) else "" if indicator.steady(now_s) else "moving"
        )
        if not quiet and gate.channel in indicators.checked:
            quiet = "seen ✓"
    where = f"{gate.height * 1e3:7.1f} mm"
    if width >= _WIDE:
        text = f" {where}  channel {gate.channel:2}  {word:7}  {edges:5} edges  {quiet}"
    elif width >= _SHORT:
        text = f" {where} ch{gate.channel:<2} {word:7}{edges:4} {quiet}"
    else:
        text = f" {where} {word:7}{edges:4}"
    return [Span(symbol, look), Span(text[: width - 2].ljust(width - 1))]


def named(gates: Sequence[Gate], channel: int) -> str:
    """Say which gate a channel is."""
    for gate in gates:
        if gate.channel == channel:
            return f"channel {channel}: {gate.side} side, {gate.height * 1e3:.1f} mm"
    return f"channel {channel}, which the protocol does not use"
