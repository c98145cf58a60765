"""The JSON that scripts rely on: names, types and units exactly as promised."""

import json
from functools import cache
from typing import Any

import pytest

from rig.analysis.curves import model_curves
from rig.model.predict import predict
from tests.analysis.drops import FENCE, GRADED, SCENES, SINGLE, UNIFORM, case, first_run
from tests.analysis.sessions import MILD, analysis

RUN_KEYS = {"run", "incline_deg", "impact_chain", "edges", "verdict", "reasons"}
MEASURED = {
    "uniform": {"separation_m", "separation_raw_m", "speed_m_s", "release_skew_s"},
    "graded": {"separation_m", "separation_raw_m", "speed_m_s", "release_skew_s"},
    "single": {"speed_m_s"},
    "fence": {"gravity_m_s2"},
}
COMPARED = {
    "uniform": {"separation_m": "separation_sd_m", "speed_m_s": "speed_sd_m_s"},
    "graded": {"separation_m": "separation_sd_m", "speed_m_s": "speed_sd_m_s"},
    "single": {"speed_m_s": "speed_sd_m_s"},
    "fence": {"gravity_m_s2": "gravity_sd_m_s2"},
}
NEVER = {scene: set().union(*MEASURED.values()) - names for scene, names in MEASURED.items()}


@cache
def session(scene: str) -> dict[str, Any]:
    """Two good runs, a superseded attempt at the second and a void one."""
    protocol = SCENES[scene]
    first = first_run(protocol, 40.0 if scene == "uniform" else None)
    cases = [
        case(protocol, MILD, run=first),
        case(protocol, MILD, run=first + 1),
        case(protocol, MILD, run=first + 1, attempt=2),
        case(protocol, MILD, run=first + 2).with_edges([]),
    ]
    found = analysis(cases)
    text = json.dumps(found.json(), allow_nan=False)
    return json.loads(text)


def is_q(value: Any) -> bool:
    return (
        set(value) == {"value", "u", "U95"}
        and all(type(number) is float for number in value.values())
        and 0.0 < value["u"] < value["U95"]
    )


@pytest.mark.parametrize("scene", SCENES)
def test_runs_have_the_promised_fields(scene):
    good, latest, void = session(scene)["runs"]
    (earlier,) = session(scene)["superseded"]
    for run in (good, latest, earlier):
        assert run.keys() >= RUN_KEYS
        assert MEASURED[scene] <= run.keys()
        assert not NEVER[scene] & run.keys()
        assert all(is_q(run[name]) for name in MEASURED[scene])
        assert run["verdict"] in {"accepted", "marginal"}
    assert void["verdict"] == "void"
    assert void.keys() >= RUN_KEYS
    for run in (good, latest, earlier, void):
        assert type(run["run"]) is int
        assert type(run["incline_deg"]) is float
        assert run["impact_chain"] in ({None} if scene == "fence" else {"A", "B"})
        assert set(run["edges"]) == {"received", "matched", "missed", "spurious", "lost"}
        assert all(type(number) is int for number in run["edges"].values())
        assert run["edges"]["received"] == run["edges"]["matched"] + run["edges"]["spurious"]
        assert all(type(reason) is str for reason in run["reasons"])
    assert (latest["attempt"], earlier["attempt"]) == (2, 1)


@pytest.mark.parametrize("scene", SCENES)
def test_budgets_are_of_the_quantities_beside_them(scene):
    for run in session(scene)["runs"][:2]:
        squares: dict[str, float] = {}
        for line in run["budget"]:
            assert set(line) == {"name", "quantity", "u"}
            squares[line["quantity"]] = squares.get(line["quantity"], 0.0) + line["u"] ** 2
        assert squares == pytest.approx({name: run[name]["u"] ** 2 for name in squares}, rel=1e-9)
        assert MEASURED[scene] <= squares.keys()


@pytest.mark.parametrize("scene", SCENES)
def test_the_summary_has_the_promised_fields(scene):
    (line,) = session(scene)["summary"]
    names = COMPARED[scene]
    assert {"incline_deg", "n", "predicted", "normalized_error"} <= line.keys()
    assert (line["incline_deg"], line["n"]) == (0.0 if scene == "fence" else 40.0, 2)
    assert type(line["n"]) is int
    assert not NEVER[scene] & line.keys()
    for name, deviation in names.items():
        assert is_q(line[name])
        assert type(line[deviation]) is float
    assert line["predicted"].keys() == names.keys()
    assert all(type(value) is float for value in line["predicted"].values())
    # Of Δz where there is one; small, because the simulation is the model.
    assert type(line["normalized_error"]) is float
    assert abs(line["normalized_error"]) < 1.0


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
