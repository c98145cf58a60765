"""From edges to heights, live and matched; the tape of the history page; plots on their dots."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.protocol import reader
from rig.ready import ready_protocol
from rig.records import Drop, Edge
from rig.report.figure import Panel, PlotAxis, Trace
from rig.report.looks import MODEL
from rig.tui.braille import dots_of
from rig.tui.motion import motions
from rig.tui.plotting import axis_over, draw_picture
from rig.tui.replay import FASTEST, SLOWEST, Player, end_of, indicators_at, until
from sim.dials import Dials
from tests.analysis.drops import case
from tests.cli.lab import short

DELAY_S = 0.02  # of the simulated release


def test_points_lie_on_the_models_curve():
    one = case(reader.parse(short()), Dials.quiet(), run=1)
    both = motions(one.protocol, one.run, (one.drop, one.scale.hz, one.analyze()))
    assert [motion.role for motion in both] == ["impact", "free"]
    for motion in both:
        assert motion.delay_s == pytest.approx(DELAY_S, abs=1e-3)
        assert motion.times.size > 100
        there = motion.model.heights(motion.times - motion.delay_s)[0]
        assert np.abs(there - motion.heights).max() < 3e-3
        assert motion.measured_height(0.0) is None
        last = float(motion.times[-1])
        assert motion.measured_height(last) == pytest.approx(motion.model_height(last), abs=3e-3)


def test_a_ball_is_shown_until_it_has_passed_its_last_gate():
    ball = reader.read(ready_protocol("falling-ball"))
    (fall,) = motions(ball, ball.runs()[0])
    assert fall.end_s == pytest.approx((2 * 0.8 / 9.81) ** 0.5, abs=0.01)


def test_the_tape_goes_at_any_speed():
    drop = Drop(1, 1, 1000, (Edge(100, 3, True), Edge(200, 3, False)), initial_state=1 << 5)
    end = end_of(drop, 1000)
    assert end == pytest.approx(0.25)
    player = Player(speed=0.5, playing=True).advance(0.3, end)
    assert (player.time_s, player.playing) == (0.15, True)
    assert player.advance(9.0, end) == Player(0, end, 0.5, playing=False)
    assert player.step_time(-1, end).time_s == pytest.approx(0.14)
    assert Player().step_time(-1, end).time_s == 0.0
    assert player.step_time(99, end).time_s == end
    assert Player(time_s=end).toggle_play(end) == Player(playing=True)
    assert Player().change_speed(1e9).speed == FASTEST
    assert Player().change_speed(1e-9).speed == SLOWEST
    assert Player(at=2).other(1, 3) == Player(at=0)
    seen = until(drop.edges, 1000, 0.15)
    assert indicators_at((3, 5), drop, seen).blocked_channels == (3, 5)
    assert indicators_at((3, 5), drop, drop.edges).blocked_channels == (5,)
    assert [one.edges for one in indicators_at((3, 5), drop, drop.edges).gates] == [2, 0]


_LINE = Trace("model", [0.0, 4.0, 10.0], [0.0, 1.0, 3.0], "line", MODEL)
WIDTH, HEIGHT = 44, 20


def drawn(*traces):
    panel = Panel(PlotAxis("time (s)"), PlotAxis("z\n(cm)"), traces)
    return draw_picture((panel,), None, WIDTH, HEIGHT)


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
