"""An indicator for each gate: state, edges, steadiness, by shape and word, not colour alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.tui.braille import Span
from rig.tui.widgets.spans import SpanView

if TYPE_CHECKING:
    from rig.protocol.protocol import Gate, Protocol
    from rig.tui.indicators import Indicator, Indicators
    from rig.tui.model import Model

_WIDE, _SHORT = 50, 34
"""Widths of one indicator with all words, and with the needed ones."""
_MOST = 8
"""Indicators above each other: more would not fit a low screen."""


class GateBoard(SpanView):
    """All gates, one side beside the other."""

    DEFAULT_CSS = "GateBoard { height: auto; padding: 0 1; }"

    def show(self, protocol: Protocol | None, indicators: Indicators, now_s: float) -> None:
        """Draw what the gates do now."""
        self.take(board(protocol, indicators, now_s, self.size.width or 78))


def board(
    protocol: Protocol | None, indicators: Indicators, now_s: float, width: int
) -> list[list[Span]]:
    """Draw the indicators in a width of characters."""
    if protocol is None or protocol.gates is None:
        return [[Span("no gates in this scene")]]
    by_channel = {gate.channel: gate for gate in indicators.gates}
    columns: list[tuple[str, list[Gate]]] = []
    for side in ("impact", "free"):
        gates = sorted(protocol.gates.on(side), key=lambda gate: -gate.height)
        for begin in range(0, len(gates), _MOST):
            title = f"{side} side" if protocol.vocabulary.two_sides else "gates"
            title = "" if begin else title
            columns.append((title, gates[begin : begin + _MOST]))
    wide = width // len(columns)
    rows = [[Span("".join(title.ljust(wide) for title, _ in columns), bold=True)]]
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
        symbol, color, word = "?", "", "unknown"
    elif indicator.blocked:
        symbol, color, word = "●", "warning", "BLOCKED"
    else:
        symbol, color, word = "○", "success", "clear"
    edges = 0 if indicator is None else indicator.edges
    quiet = ""
    if indicator is not None and indicators.known:
        quiet = (
            "FLICKERS" if indicator.flickers(now_s) else "" if indicator.steady(now_s) else "moving"
        )
        if not quiet and gate.channel in indicators.checked:
            quiet = "works ✓"
    where = f"{gate.height * 1e3:7.1f} mm"
    if width >= _WIDE:
        text = f" {where}  channel {gate.channel:2}  {word:7}  {edges:5} edges  {quiet}"
    elif width >= _SHORT:
        text = f" {where} ch{gate.channel:<2} {word:7}{edges:4} {quiet}"
    else:
        text = f" {where} {word:7}{edges:4}"
    return [Span(symbol, color, bold=True), Span(text[: width - 2].ljust(width - 1))]


def named(model: Model, channel: int) -> str:
    """Name the gate of a channel."""
    for gate in model.protocol.gates.gates if model.protocol and model.protocol.gates else ():
        if gate.channel == channel:
            side = f"{gate.side} side, " if model.words.two_sides else ""
            return f"channel {channel}: {side}{gate.height * 1e3:.1f} mm"
    return f"channel {channel}, which the protocol does not use"
