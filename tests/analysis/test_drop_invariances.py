"""What must not matter: names, the origin and unit of time, the order of simultaneous edges."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.fit import CLOSE
from rig.analysis.result import DropResult
from rig.model.chain import Chain
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
    ("scene", "seconds"), [("uniform", -0.25), ("graded", 0.5), ("single", 3.0), ("fence", -0.25)]
)
def test_the_origin_of_time(scene, seconds):
    """An imported file counts from where it likes."""
    one = case(SCENES[scene], MILD)
    shift = round(seconds * HZ)
    later = one.with_edges([edge._replace(tick=edge.tick + shift) for edge in one.drop.edges])
    # Both end where a step is short enough, and the next one would be by its square.
    assert_same(one.analyze(), later.analyze(), CLOSE**2)


@pytest.mark.parametrize("scene", SCENES)
def test_the_unit_of_time(scene):
    one = case(SCENES[scene], MILD)
    finer = replace(
        one.with_edges([edge._replace(tick=edge.tick * 1024) for edge in one.drop.edges]),
        scale=one.scale._replace(hz=one.scale.hz * 1024),
    )
    assert_same(one.analyze(), finer.analyze(), 0.0)


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
    rods = {order[n]: rod for n, rod in found.matches.items()}
    assert_same(expected, replace(found, matches=rods), 0.0)


def test_edges_of_gates_that_the_scene_does_not_have():
    one = case(SCENES["single"], MILD)
    unused = [
        Edge(tick, channel, bool(tick % 2))
        for tick in range(0, HZ, HZ // 50)
        for channel in (9, 15)
    ]
    other = one.with_edges([*one.drop.edges, *unused]).analyze()
    expected = one.analyze()
    assert other.audit == expected.audit
    assert sorted(other.matches.values()) == sorted(expected.matches.values())
    assert_same(expected, replace(other, matches=expected.matches), 0.0)


def test_the_name_of_a_chain():
    """Unlike chains with their names exchanged, and the run's with them."""
    b = UNIFORM.chains["B"]
    b = replace(
        b,
        chain=Chain((1.0,) * 22, tuple(0.055 * k for k in range(22))),
        widths=b.widths[:22],
        diameters=b.diameters[:22],
    )
    protocol = replace(UNIFORM, chains={"A": UNIFORM.chains["A"], "B": b})
    for number in (1, 2):
        one = case(protocol, MILD, run=number)
        chains = {"A": protocol.chains["B"], "B": protocol.chains["A"]}
        names = {"A": "B", "B": "A"}
        other = replace(
            one,
            protocol=replace(protocol, chains=chains),
            run=replace(one.run, impact=names[one.run.impact], free=names[one.run.free]),
        )
        assert_same(one.analyze(), other.analyze(), 0.0)
