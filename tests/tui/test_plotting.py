"""Plots: traces of panels on the dots that their axes name."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.report.figure import Panel, PlotAxis, Trace
from rig.report.looks import MODEL
from rig.tui.braille import dots_of
from rig.tui.plotting import Picture, axis_over, draw_picture

_LINE = Trace("model", [0.0, 4.0, 10.0], [0.0, 1.0, 3.0], "line", MODEL)
WIDTH, HEIGHT = 44, 20


def drawn(*traces):
    panel = Panel(PlotAxis("time (s)"), PlotAxis("z\n(cm)"), traces)
    return draw_picture(Picture(panel, None), WIDTH, HEIGHT, None)


def drawn_dots(plot, color=None):
    """Dots in one colour, or in any: columns and rows from the top left."""
    found = set()
    for y, row in enumerate(plot):
        x = 0
        for span in row:
            for letter in span.text:
                if color in {None, span.color}:
                    found |= {(2 * x + to_x, 4 * y + to_y) for to_x, to_y in dots_of(letter)}
                x += 1
    return found


@pytest.mark.parametrize("at", [0.0, 3.3, 4.0, 7.1, 10.0])
def test_a_mark_lies_on_the_very_dot_of_the_curve_it_belongs_to(at):
    height = (0.25 * at) if at <= 4.0 else 1.0 + (at - 4.0) / 3.0
    point = Trace("", [at], [height], "mean")
    marks = drawn_dots(drawn(_LINE, point), "primary")
    curve = drawn_dots(drawn(_LINE))
    columns = {x for x, _ in marks}
    middle = sum(columns) / len(columns), sum(y for _, y in marks) / len(marks)
    assert min(abs(x - middle[0]) + abs(y - middle[1]) for x, y in curve) <= 2
    bars = drawn_dots(drawn(_LINE, Trace("", [at], [height], "mean", 0, [0.5])), "primary")
    assert max(y for _, y in bars) - min(y for _, y in bars) > 8


@given(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3), st.integers(12, 180), st.integers(1, 9))
def test_numbers_at_an_axis_are_round_and_the_range_is_inside(low, span, cells, least):
    axis = axis_over(low, low + span, cells, least)
    assert axis.value(-0.5) <= low + 1e-9 * abs(low)
    assert axis.value(cells - 0.5) >= (low + span) * (1 - 1e-9)
    values = list(axis.ticks.values())
    gaps = {f"{b - a:.6g}" for a, b in pairwise(values)}
    assert {gap.lstrip("0.")[:1] for gap in gaps} <= {"1", "2", "5", "9", "4"}
    assert all(b - a >= least for a, b in pairwise(axis.ticks))
