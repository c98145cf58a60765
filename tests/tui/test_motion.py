"""From edges to heights, live and matched; and the tape of the history page."""

from types import SimpleNamespace

import numpy as np
import pytest

from rig.protocol import reader
from rig.protocol.plan import runs
from rig.ready import ready_protocol
from rig.records import Drop, Edge
from rig.tui.motion import motions
from rig.tui.replay import FASTEST, SLOWEST, Player, end_of, indicators_at, until
from tests.cli.lab import short

HZ = 1e6
DELAY_S = 0.02


@pytest.fixture(scope="module")
def scene():
    return reader.parse(short())


def edges_of(scene, run):
    """Edges of the model's own fall, let go `DELAY_S` after the fire stamp, and their rods."""
    found = []
    for motion in motions(scene, run):
        name = run.impact if motion.role == "impact" else run.free
        chain = scene.chains[name]
        for gate in scene.gates.on(motion.role):
            for rod, place in enumerate(chain.chain.heights):
                for blocked in (True, False):
                    half = chain.widths[rod] / 2 * (1 if blocked else -1)
                    level = gate.height - place + half
                    if level >= scene.drop.value or (motion.role == "impact" and level <= -place):
                        continue
                    time = float(motion.model.times(np.array([level]))[0]) + DELAY_S
                    found.append((Edge(round(time * HZ), gate.channel, blocked), rod))
    return sorted(found)


def recorded(run, pairs):
    """A drop of these edges, and what an analysis says that they are."""
    edges = tuple(edge for edge, _ in pairs)
    matches = {number: rod for number, (_, rod) in enumerate(pairs)}
    result = SimpleNamespace(run=run, matches=matches, quantities={})
    return Drop(run.number, 1, HZ, edges), HZ, result


def test_points_lie_on_the_models_curve(scene):
    run = runs(scene)[0]
    both = motions(scene, run, recorded(run, edges_of(scene, run)))
    assert [one.role for one in both] == ["impact", "free"]
    for one in both:
        assert one.delay_s == pytest.approx(DELAY_S, abs=1e-3)
        assert one.times.size > 100
        there = one.model.heights(one.times - one.delay_s)[0]
        assert np.abs(there - one.heights).max() < 3e-3
        assert one.measured_height(0.0) is None
        last = float(one.times[-1])
        assert one.measured_height(last) == pytest.approx(one.model_height(last), abs=3e-3)


def test_a_ball_is_shown_until_it_has_passed_its_last_gate():
    ball = reader.read(ready_protocol("falling-ball"))
    (fall,) = motions(ball, runs(ball)[0])
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
