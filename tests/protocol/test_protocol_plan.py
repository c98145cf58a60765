import dataclasses
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.protocol.plan import runs
from rig.protocol.protocol import Run
from rig.protocol.reader import parse
from rig.protocol.site import gravity_at
from tests.tables import protocol_text

TWO = protocol_text("two-chains")


def planned(**changes):
    protocol = parse(TWO)
    plan = dataclasses.replace(protocol.plan, **changes)
    return runs(dataclasses.replace(protocol, plan=plan))


@pytest.mark.parametrize(
    ("order", "impact"), [("ABBA", "ABBAAB"), ("alternate", "ABABAB"), ("fixed", "AAAAAA")]
)
def test_order_within_each_incline(order, impact):
    made = planned(inclines=(10.0, 40.0), repeats=6, order=order)
    assert "".join(run.impact for run in made) == impact * 2
    assert [run.number for run in made] == list(range(1, 13))
    assert all({run.impact, run.free} == {"A", "B"} for run in made)


@given(st.integers(0, 2**63 - 1), st.sampled_from(["incline", "all"]))
def test_shuffling_keeps_every_drop(seed, randomize):
    inclines = (0.0, 10.0, 20.0, 30.0)
    ordered = planned(inclines=inclines, repeats=8)
    mixed = planned(inclines=inclines, repeats=8, randomize=randomize, seed=seed)
    assert Counter(dataclasses.replace(run, number=0) for run in mixed) == Counter(
        dataclasses.replace(run, number=0) for run in ordered
    )
    if randomize == "incline":
        assert "".join(run.impact for run in mixed) == "ABBA" * 8


def test_the_shuffle_is_the_same_for_ever():
    made = planned(inclines=tuple(range(0, 90, 10)), randomize="incline", seed=7)
    assert [run.incline_deg for run in made] == [60, 30, 50, 70, 80, 0, 40, 10, 20]


def test_scenes_with_one_chain():
    one = TWO.replace("  B: {like: A}\n", "")
    assert runs(parse(one)) == (Run(1, 0.0, "A", None),)
    falling = one.replace("surface: {restitution: 0.5}\n", "")
    assert runs(parse(falling)) == (Run(1, 0.0, None, "A"),)


def test_normal_gravity():
    # Poles and equator: the WGS 84 values of normal gravity.
    assert gravity_at(0, 0).value == pytest.approx(9.7803253359, abs=1e-10)
    assert gravity_at(90, 0).value == pytest.approx(9.8321849379, abs=2e-10)
    assert gravity_at(45, 0).value == pytest.approx(9.806198, abs=5e-7)
    assert gravity_at(61.19, 0).value == pytest.approx(9.82010, abs=5e-6)
    assert gravity_at(-45, 1000).value == pytest.approx(9.806198 - 3.086e-3, abs=5e-7)


def test_site_in_a_protocol():
    protocol = parse(TWO.replace("gravity: 9.81 m/s^2", "site: {latitude: 45°, height: 0 m}"))
    assert protocol.gravity == gravity_at(45, 0)
