"""What must not matter: names, the origin and unit of time, the order of simultaneous edges."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.adjust import DONE
from rig.analysis.result import DropResult
from rig.records import Edge
from sim.dials import Dials
from tests.analysis.drops import HZ, SCENES, UNIFORM, Case, case

MILD = Dials(skew_sd=1e-3)


def assert_same(one: DropResult, other: DropResult, share: float) -> None:
    """Same verdict, rods and numbers; numbers to a share of their uncertainty."""
    assert (one.verdict, one.reasons, one.audit) == (other.verdict, other.reasons, other.audit)
    assert one.matches == other.matches
    assert one.quantities.keys() == other.quantities.keys()
    for name, measured in one.quantities.items():
        assert abs(measured.value - other.quantities[name].value) <= share * measured.u
        assert other.quantities[name].u == pytest.approx(measured.u, rel=share + 1e-15)


@pytest.mark.parametrize(
    ("scene", "seconds"),
    [("uniform", -0.25), ("graded", 0.5), ("single", 3.0), ("fence", -0.25), ("fence", 5400.0)],
)
def test_origin_and_unit_of_time_and_other_gates(scene, seconds):
    """An imported file counts as it likes, and has gates of another scene too."""
    one = case(SCENES[scene], MILD)
    unused = [Edge(tick, 17, bool(tick % 2)) for tick in range(0, HZ, HZ // 50)]
    finer = [
        edge._replace(tick=1024 * (edge.tick + round(seconds * HZ)))
        for edge in [*one.drop.edges, *unused]
    ]
    other = replace(one.with_edges(finer), scale=one.scale._replace(hz=one.scale.hz * 1024))
    found, expected = other.analyze(), one.analyze()
    assert sorted(found.matches.values()) == sorted(expected.matches.values())
    # Both end where a step is short enough, and the next one would be by its square.
    assert_same(expected, replace(found, rods=expected.rods), DONE**2)


def coarse(one: Case) -> Case:
    """Ticks so long that edges of several gates fall together."""
    edges = [edge._replace(tick=edge.tick // 3200) for edge in one.drop.edges]
    return replace(one.with_edges(edges), scale=one.scale._replace(hz=one.scale.hz / 3200))


def test_the_order_of_simultaneous_edges():
    one = coarse(case(UNIFORM, MILD, incline=40.0))
    ticks = np.array([edge.tick for edge in one.drop.edges])
    assert (np.diff(ticks) == 0).sum() > 100
    # Simultaneous edges by falling channel: one gate's own keep their order.
    order = sorted(range(ticks.size), key=lambda n: (ticks[n], -one.drop.edges[n].channel))
    assert order != list(range(ticks.size))
    other = replace(one, drop=replace(one.drop, edges=tuple(one.drop.edges[n] for n in order)))
    found, expected = other.analyze(), one.analyze()
    rods = tuple(found.rods[order.index(n)] for n in range(len(order)))
    assert_same(expected, replace(found, rods=rods), 0.0)


@pytest.mark.parametrize("late", [1.0, 1800.0])
def test_a_record_may_begin_long_before_the_fall_and_end_long_after_it(late):
    """Also of half an hour, with edges at either end of it."""
    ends = [Edge(0, 0, True), Edge(round(2 * late * HZ), 0, False)]
    one = case(UNIFORM, Dials.quiet(), incline=40.0)
    moved = [edge._replace(tick=edge.tick + round(late * HZ)) for edge in one.drop.edges]
    result = one.with_edges([*ends, *moved]).analyze()
    assert result.audit.missed == 0
    assert result.audit.matched == len(moved)
