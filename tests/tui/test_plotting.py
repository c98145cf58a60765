"""Plots: curves, marks, bars and cursor on the same dots, and numbers at both axes."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.tui.braille import dots_of
from rig.tui.plotting import Picture, Series, plotted, ticks

_LINE = [0.0, 4.0, 10.0], [0.0, 1.0, 3.0]


def drawn(series, cursor=None, **more):
    return plotted(Picture("z (cm)", "t (ms)", series, **more), 44, 20, cursor)


def drawn_dots(plot, color=None):
    """Dots in one colour, or in any: columns and rows from the top left."""
    found = set()
    for y, row in enumerate(plot.rows):
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
    line = Series("line", *_LINE, "accent")
    point = Series("dots", [at], [height], "success", "·")
    alone = drawn_dots(drawn((point,), x_limits=(0.0, 10.0)), "success")
    assert len(alone) == 1
    # Both on one sheet: the mark sets no dot that the curve has not, or its neighbour.
    both, curve = (drawn_dots(drawn(what)) for what in ((line, point), (line,)))
    more = both - curve
    assert all(max(abs(x - to_x), abs(y - to_y)) <= 1 for x, y in more for to_x, to_y in
               [min(curve, key=lambda to: abs(to[0] - x))])  # fmt: skip
    point = point._replace(kind="bars", errors=[0.5])
    bars = drawn_dots(drawn((line, point), x_limits=(-1.0, 11.0)), "success")
    middle = sorted(bars)[len(bars) // 2][0]
    upright = [row for column, row in bars if column == middle]
    assert max(upright) - min(upright) + 1 == len(set(upright)) > 5


def test_a_curve_is_named_where_it_is_drawn_or_else_in_the_legend():
    line = Series("line", *_LINE, "accent", label="model")
    legend, *plot = ["".join(span.text for span in row) for row in drawn((line,)).rows]
    assert "model" not in legend
    assert "model" in "\n".join(plot)
    full = Series(
        "dots", [n / 20 for n in range(200)] * 9, [n / 600 for n in range(1800)], "primary"
    )
    legend, *_ = ["".join(span.text for span in row) for row in drawn((full, line)).rows]
    assert "⠒⠒ model" in legend


def test_the_cursor_says_what_is_there():
    series = (
        Series("line", *_LINE, "accent", label="model"),
        Series("bars", [4.0], [1.5], "primary", label="mean ± U", errors=[0.25]),
    )
    said = ["".join(span.text for span in drawn(series, at).rows[1]) for at in (4.0, 7.0)]
    assert said == ["t (ms) 4  model 1  mean ± U 1.5 ± 0.25", "t (ms) 7  model 2  mean ± U –"]


def test_residuals_stand_in_a_strip_of_their_own_below():
    line = Series("line", *_LINE, "accent")
    off = Series("dots", [4.0], [-0.3], "primary")
    plot = drawn((line,), residuals=(off,), residual_label="off (mm)")
    text = ["".join(span.text for span in row) for row in plot.rows]
    at = next(n for n, row in enumerate(text) if "off (mm)" in row)
    assert len(text) == 20
    assert any(row.strip().startswith("0┤") for row in text[at:])
    assert "t (ms)" in text[-1]


@given(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3), st.integers(0, 12))
def test_numbers_at_an_axis_are_round_inside_and_three_at_least(low, span, most):
    found = ticks(low, low + span, most)
    assert 3 <= len(found) <= max(6, most)
    assert all(low - 1e-6 * span <= one <= low + span * (1 + 1e-6) for one in found)
    gaps = {f"{b - a:.6g}" for a, b in pairwise(found)}
    assert {gap.lstrip("0.")[:1] for gap in gaps} <= {"1", "2", "5"}
