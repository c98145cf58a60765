"""A line for each gate: state, edges, steadiness, by shape and word, not colour alone."""

from itertools import zip_longest
from time import monotonic

from textual.content import Content

from rig.protocol.protocol import SIDES, Gate, Protocol
from rig.tui.indicators import Indicator, Indicators
from rig.tui.model import Model

_WIDE = 39


def board(protocol: Protocol | None, indicators: Indicators, width: int) -> list[Content]:
    """Return a line for each gate, the highest first; both sides side by side if they fit."""
    if protocol is None:
        return []
    sides = [sorted(protocol.gates.on(side), key=lambda gate: -gate.height) for side in SIDES]
    titles = ("impact side", "free side") if protocol.vocabulary.two_sides else ("gates",) * 2
    columns = [
        [Content.styled(title.ljust(_WIDE), "bold"), *(_line(gate, indicators) for gate in gates)]
        for title, gates in zip(titles, sides, strict=True)
        if gates
    ]
    if width < _WIDE * len(columns):
        return [line for column in columns for line in column]
    blank = Content(" " * _WIDE)
    return [Content.assemble(*row) for row in zip_longest(*columns, fillvalue=blank)]


def _line(gate: Gate, indicators: Indicators) -> Content:
    """Return the line of a gate."""
    lamps = (lamp for lamp in indicators.gates if lamp.channel == gate.channel)
    lamp, now_s = next(lamps, Indicator(gate.channel)), monotonic()
    sign, color, word = ("●", "$warning", "BLOCKED") if lamp.blocked else ("○", "$success", "clear")
    works = "works ✓" if gate.channel in indicators.checked else ""
    quiet = "FLICKERS" if lamp.flickers(now_s) else works if lamp.steady(now_s) else "moving"
    if not indicators.known:
        sign, color, word, quiet = "?", "", "unknown", ""
    text = f" {gate.height * 1e3:6.1f} mm ch{gate.channel:<2} {word:7}{lamp.edges:4} {quiet}"
    return Content.assemble((sign, f"bold {color}"), text[: _WIDE - 2].ljust(_WIDE - 1))


def label(model: Model, channel: int) -> str:
    """Return the name of a channel's gate."""
    for gate in model.protocol.gates.gates if model.protocol else ():
        if gate.channel == channel:
            side = f"{gate.side} side, " if model.words.two_sides else ""
            return f"channel {channel}: {side}{gate.height * 1e3:.1f} mm"
    return f"channel {channel}, which the protocol does not use"
