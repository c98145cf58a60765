"""Layouts of gates as people may put them up, for properties that must hold on any of them."""

from __future__ import annotations

from hypothesis import strategies as st

from bench.studies.layout_catalogue import FENCE, KINDS, SINGLE, STANDARD, GateLayout, under
from rig.protocol.reader import parse

_MOST = 8
_HIGHEST = 0.85  # of the drop: below the hanging bottom rod, however thick


@st.composite
def layouts(draw: st.DrawFn) -> GateLayout:
    """One to eight gates a side below the hanging chain, at any of thirty heights."""
    kind = draw(st.sampled_from((STANDARD, *KINDS, SINGLE, FENCE)))
    protocol = parse(under(kind, (0.5,), (0.5,)).protocol())
    (chain, *_) = protocol.chains.values()
    lowest = 0.6 * chain.widths[0] / protocol.drop.value  # a beam must pass above what lies there
    step = (_HIGHEST - lowest) / 30
    heights = st.lists(st.integers(0, 29), min_size=1, max_size=_MOST, unique=True)
    sides = (sorted(lowest + step * n for n in draw(heights)) for _ in range(2))
    return under(kind, *sides)
