"""From edges to heights, live and matched; and the tape of the history page."""

from dataclasses import replace

import numpy as np
import pytest

from rig.predictions import predicted_run
from rig.protocol import reader
from rig.protocol.plan import runs
from rig.records import Drop, Edge
from rig.tui.motion import motions, separation
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
    for motion in motions(scene, run, [], HZ):
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


@pytest.mark.parametrize("matched", [True, False])
def test_points_lie_on_the_models_curve(scene, matched):
    run = runs(scene)[0]
    pairs = edges_of(scene, run)
    rods = {number: rod for number, (_, rod) in enumerate(pairs)} if matched else None
    both = motions(scene, run, [edge for edge, _ in pairs], HZ, rods)
    assert [one.role for one in both] == ["impact", "free"]
    for one in both:
        assert one.delay_s == pytest.approx(DELAY_S, abs=1e-6)
        assert one.times.size > 200
        there = one.model.heights(one.times - one.delay_s)[0]
        assert np.abs(there - one.heights).max() < 1e-5
    gap = separation(both, 0.6)
    assert gap.times.size == gap.gaps.size > 100
    assert np.abs(gap.gaps - gap.expected).max() < 2e-3


def test_a_curve_ends_when_the_top_rod_strikes(scene):
    """What comes after is no fall: Δz is what the model says at that moment, and no more."""
    run = runs(scene)[0]
    both = motions(scene, run, [edge for edge, _ in edges_of(scene, run)], HZ)
    _, _, when, model, _ = separation(both, 5.0, 0.0)
    length = scene.chains[run.impact].chain.length
    at, heights = both[0].curve(5.0)
    np.testing.assert_array_equal(at, when)
    assert heights[-1] == pytest.approx(-length, abs=1e-9)
    assert when[-1] < 1.0
    assert model[-1] == pytest.approx(predicted_run(scene, run)["separation_m"].value, abs=1e-9)


def test_what_fell_apart_is_told_as_it_fell_or_as_if_let_go_together_and_never_mixed(scene):
    run, late_s = runs(scene)[0], 0.004
    free = {gate.channel for gate in scene.gates.on("free")}
    pairs = edges_of(scene, run)
    late = sorted((edge._replace(tick=edge.tick + round(late_s * HZ))
                   if edge.channel in free else edge, rod) for edge, rod in pairs)  # fmt: skip
    rods = {number: rod for number, (_, rod) in enumerate(late)}
    both = motions(scene, run, [edge for edge, _ in late], HZ, rods)
    fell, together = separation(both, 5.0), separation(both, 5.0, late_s)
    for gap in (fell, together):
        assert np.abs(gap.gaps - gap.expected).max() < 2e-3
    expected = predicted_run(scene, run)["separation_m"].value
    assert together.model[-1] == pytest.approx(expected, abs=1e-9)
    assert fell.model[-1] - expected > 0.01
    assert separation(both, 5.0, late_s).gaps[-1] < fell.gaps[-1] - 0.01


def test_live_a_missed_edge_shifts_nothing(scene):
    run = runs(scene)[0]
    kept = [edge for number, (edge, _) in enumerate(edges_of(scene, run)) if number % 40 != 39]
    for one in motions(scene, run, kept, HZ):
        there = one.model.heights(one.times - one.delay_s)[0]
        assert np.abs(there - one.heights).max() < 1e-3


def test_a_drop_without_edges_has_curves_only(scene):
    for one in motions(scene, runs(scene)[0], [], HZ):
        assert one.times.size == 0
        assert one.curve(0.5)[1][0] == pytest.approx(scene.drop.value)


def test_the_tape_goes_forwards_and_back_at_any_speed():
    drop = Drop(1, 1, 1000, (Edge(100, 3, True), Edge(200, 3, False)), initial_state=1 << 5)
    end = end_of(drop, 1000)
    assert end == pytest.approx(0.25)
    player = Player(speed=0.5, playing=True).ticked(0.3, end)
    assert (player.time_s, player.playing) == (0.15, True)
    assert player.ticked(9.0, end) == Player(0, end, 0.5, playing=False)
    assert player.moved(-1, end).time_s == pytest.approx(0.14)
    assert Player().moved(-1, end).time_s == 0.0
    assert player.moved(99, end).time_s == end
    back = replace(player, back=True)
    assert back.ticked(0.1, end).time_s == pytest.approx(0.1)
    assert back.ticked(9.0, end) == Player(0, 0.0, 0.5, playing=False, back=True)
    assert back.started(end).playing is False
    assert Player(back=True).started(end).time_s == end
    assert Player(time_s=end).started(end) == Player(playing=True)
    assert Player().turned(1e9).speed == FASTEST
    assert Player().turned(1e-9).speed == SLOWEST
    assert Player(at=2).other(1, 3) == Player(at=0)
    seen = until(drop.edges, 1000, 0.15)
    assert indicators_at((3, 5), drop, seen).blocked == (3, 5)
    assert indicators_at((3, 5), drop, drop.edges).blocked == (5,)
    assert [one.edges for one in indicators_at((3, 5), drop, drop.edges).gates] == [2, 0]
