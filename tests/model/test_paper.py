"""The paper's scenes and claims, against the reference values that were worked out elsewhere."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from rig.model import paper
from rig.model.predict import predict
from rig.protocol.reader import read
from tests.tables import cases


def row(columns: dict[str, list[float]], **wanted: float) -> dict[str, float]:
    """The one row in which some columns have given values."""
    rows = [
        dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)
    ]
    found = [r for r in rows if all(math.isclose(r[k], v) for k, v in wanted.items())]
    assert len(found) == 1
    return found[0]


def test_figure_3_goes_through_the_reference_values():
    columns = paper.figure_3()
    at_40 = row(columns, incline_deg=40.0, pile=0.0)
    assert at_40["separation_m"] == pytest.approx(0.11546810526538031, rel=1e-12)
    assert at_40["speed_m_s"] == pytest.approx(6.9327596650855757, rel=1e-12)
    assert row(columns, incline_deg=20.0, pile=1.0)["separation_m"] == pytest.approx(
        0.080175519527158543, rel=1e-12
    )


def test_figure_3_leaves_out_what_does_not_slide():
    columns = paper.figure_3(0.5)
    surface = [i for i, p in zip(columns["incline_deg"], columns["pile"], strict=True) if not p]
    assert not any(0.0 < incline < math.degrees(math.atan(0.2)) for incline in surface)
    assert 0.0 in surface
    assert 11.5 in surface


def test_figure_4_ends_at_the_surface_with_the_separation():
    columns = paper.figure_4()
    assert columns["height_m"][-1] == pytest.approx(0.0, abs=1e-15)
    assert columns["free_height_m"][-1] == pytest.approx(0.20034710240655192, rel=1e-12)
    # In free fall V² = 2g × fallen: an energy balance that nothing here computes.
    for height, speed2 in zip(columns["free_height_m"], columns["free_speed2"], strict=True):
        assert speed2 == pytest.approx(2 * paper.GRAVITY * (1.345 - height), rel=1e-12, abs=1e-14)


def test_figure_6_vanishes_at_both_ends():
    columns = paper.figure_6(999)
    separations = columns["separation_m"]
    assert max(separations) > 10 * separations[0]
    assert max(separations) > 10 * separations[-1]
    peak = columns["inertia"][separations.index(max(separations))]
    assert 0.2 < peak < 1 / 3  # "close to the peaks", says the text


PROTOCOLS = Path(__file__).parents[2] / "protocols"


@cases
def test_read_from_the_protocol(name, pile, incline, alpha, separation, speed, time):
    protocol = read(PROTOCOLS / f"{name}.yaml")
    surface = protocol.surface if pile else replace(protocol.surface, pile=None)
    chain = next(iter(protocol.chains.values())).chain
    found = predict(chain, surface, incline, protocol.drop, protocol.gravity)
    assert (found.in_domain, found.incline_deg) == (True, incline)
    values = found.alpha, found.separation_m, found.speed_m_s, found.fall_time_s
    for value, wanted in zip(values, (alpha, separation, speed, time), strict=True):
        if wanted is not None:
            assert value == pytest.approx(float(wanted), rel=1e-12, abs=0)
    stone = math.sqrt(2 * protocol.gravity.value * (protocol.drop.value + chain.heights[-1]))
    assert found.free_fall_speed_m_s == pytest.approx(stone, rel=1e-15)
    assert found.speed_m_s > stone
