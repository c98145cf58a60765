"""The JSON that scripts rely on: names, types, units and numbers are those that were promised."""

import math

import pytest

from rig.analysis.curves import model_curves
from rig.model.predict import predict
from tests.analysis.drops import FENCE, GRADED, SINGLE, UNIFORM
from tests.analysis.kept_results import NAMES, differences, kept, results


@pytest.mark.parametrize("name", NAMES)
def test_what_is_kept_comes_out_again(name):
    """Where a change is meant, ``python -m tests.analysis.kept_results`` writes it anew."""
    found = results(name)
    assert not differences(found, kept(name))
    sessions = [said for _, said in found.values() if "summary" in said]
    for run in [run for said in sessions for run in said["runs"] if "budget" in run]:
        for quantity in {line["quantity"] for line in run["budget"]}:
            parts = [line["u"] for line in run["budget"] if line["quantity"] == quantity]
            assert math.hypot(*parts) == pytest.approx(run[quantity]["u"], rel=1e-9)


def test_curves_are_the_model_s_and_the_pile_s_edge_is_seen():
    curves = model_curves(UNIFORM)
    inclines = curves["incline_deg"]
    assert inclines == sorted(inclines)
    assert (inclines[0], inclines[-1]) == (0.0, 85.0)
    chain = UNIFORM.chains["A"].chain
    for n in range(0, len(inclines), 7):
        one = predict(chain, UNIFORM.surface, inclines[n], UNIFORM.drop, UNIFORM.gravity)
        for name, u95, u in (
            ("separation_m", "separation_U95_m", one.separation_u_m),
            ("speed_m_s", "speed_U95_m_s", one.speed_u_m_s),
        ):
            assert curves[name][n] == getattr(one, name)
            assert curves[u95][n] == pytest.approx(1.959964 * u, rel=2e-6)
    segments = dict(zip(inclines, curves["segments"], strict=True))
    assert segments[30.0] == "surface"
    assert {segment for incline, segment in segments.items() if incline < 30.0} == {"pile"}
    assert max(incline for incline in inclines if incline < 30.0) > 30.0 - 1e-9


def test_curves_have_what_the_scene_has():
    assert model_curves(FENCE) == {}
    assert "separation_m" not in model_curves(SINGLE)
    graded = model_curves(GRADED)
    assert graded["separation_m"][graded["incline_deg"].index(40.0)] == pytest.approx(
        0.20034710240655192, rel=1e-12
    )
