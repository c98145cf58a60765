"""Gates as lamps: state, edges counted, steadiness; told by shape and word, not colour alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.content import Content

from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.protocol.scene import Gate, Protocol
    from rig.tui.gates import Lamp, Lamps

_WIDE, _SHORT = 50, 34
"""Widths of one lamp with all words, and with the needed ones."""
_MOST = 8
"""Lamps above each other: more would not fit a low screen."""


class LampBoard(Words):
    """All gates, one side beside the other."""

    DEFAULT_CSS = "LampBoard { height: auto; padding: 0 1; }"

    def show(self, protocol: Protocol | None, lamps: Lamps, now_s: float) -> None:
        """Draw what the gates do now."""
        width = self.size.width or 78
        self.say_content(board(protocol, lamps, now_s, width))


def board(protocol: Protocol | None, lamps: Lamps, now_s: float, width: int) -> Content:
    """Draw the lamps in a width of characters."""
    if protocol is None or protocol.gates is None:
        return Content("no gates in this scene")
    by_channel = {lamp.channel: lamp for lamp in lamps.lamps}
    columns: list[tuple[str, list[Gate]]] = []
    for side in ("impact", "free"):
        gates = sorted(protocol.gates.on(side), key=lambda gate: -gate.height)
        for begin in range(0, len(gates), _MOST):
            title = "" if begin else f"{side} side"
            columns.append((title, gates[begin : begin + _MOST]))
    wide = width // len(columns)
    rows = [Content.styled("".join(title.ljust(wide) for title, _ in columns).rstrip(), "bold")]
    for at in range(max(len(gates) for _, gates in columns)):
        cells = [
            _lamp(gates[at], by_channel.get(gates[at].channel), lamps, now_s, wide)
            if at < len(gates)
            else Content(" " * wide)
            for _, gates in columns
        ]
        rows.append(Content.assemble(*cells))
    return Content("\n").join(rows)


def _lamp(gate: Gate, lamp: Lamp | None, lamps: Lamps, now_s: float, width: int) -> Content:
    if lamp is None or not lamps.known:
        symbol, style, word = "?", "$foreground 60%", "unknown"
    elif lamp.blocked:
        symbol, style, word = "●", "bold $warning", "BLOCKED"
    else:
        symbol, style, word = "○", "$success", "clear"
    edges = 0 if lamp is None else lamp.edges
    quiet = ""
    if lamp is not None and lamps.known:
        quiet = "FLICKERS" if lamp.flickers(now_s) else "" if lamp.steady(now_s) else "moving"
        if not quiet and gate.channel in lamps.waved:
            quiet = "seen ✓"
    where = f"{gate.height * 1e3:7.1f} mm"
    if width >= _WIDE:
        text = f" {where}  channel {gate.channel:2}  {word:7}  {edges:5} edges  {quiet}"
    elif width >= _SHORT:
        text = f" {where} ch{gate.channel:<2} {word:7}{edges:4} {quiet}"
    else:
        text = f" {where} {word:7}{edges:4}"
    return Content.assemble((symbol, style), text[: width - 2].ljust(width - 1))


def named(gates: Sequence[Gate], channel: int) -> str:
    """Say which gate a channel is."""
    for gate in gates:
        if gate.channel == channel:
            return f"channel {channel}: {gate.side} side, {gate.height * 1e3:.1f} mm"
    return f"channel {channel}, which the protocol does not use"
