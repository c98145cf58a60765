"""Sessions whose plan varies a key of the scene: one rig, one fit, a line for each setting."""

import json

import pytest

from rig.cli import main
from tests.cli.lab import PROTOCOLS, record, short, truth_of, without

HEIGHTS = (0.9, 1.2, 1.6)


def ball(heights):
    text = (PROTOCOLS / "falling-ball.yaml").read_text("utf-8")
    values = ", ".join(f"{height * 1e3:g} mm ± 1 mm" for height in heights)
    plan = f"{{vary: {{drop: [{values}]}}, repeats: 4}}"
    return without("drop", text).replace("{repeats: 10, settle: 5 s}", plan)


def analysed(call, session):
    return json.loads(call("analyze", str(session), "--json").out)


@pytest.mark.parametrize("seed", range(3))
def test_gravity_is_one_mean_of_all_heights_and_gates_are_of_each(seed, tmp_path, call):
    result = analysed(call, record(tmp_path, ball(HEIGHTS), f"sim://?stated=1&seed={seed}"))
    (line,) = result["summary"]
    assert line["n"] == 12
    assert abs(line["gravity_m_s2"]["value"] - 9.81) < line["gravity_m_s2"]["U95"]
    settings = {f"drop {height * 1e3:g} mm ± 1 mm" for height in HEIGHTS}
    assert {gate["setting"] for gate in line["gates"]} == settings
    assert {run["setting"] for run in result["runs"]} == settings
    heights = [row for row in result["learned"]["unknowns"] if row["name"].startswith("drop")]
    assert len(heights) == len(HEIGHTS), "each height has an error of its own"


@pytest.fixture(scope="module")
def chains(tmp_path_factory):
    """Two chains at 40°, from two heights a rod's distance apart."""
    text = without("drop", short("40 deg", 4))
    text = text.replace("plan: {", "plan: {vary: {drop: [180 mm, 228.5 mm]}, ")
    return record(tmp_path_factory.mktemp("chains"), text, "sim://?stated=1&seed=3")


def test_each_setting_is_compared_with_its_own_prediction(chains, call):
    result = analysed(call, chains)
    lines = result["summary"]
    assert [(line["setting"], line["n"]) for line in lines] == [
        ("drop 180 mm", 4), ("drop 228.5 mm", 4),
    ]  # fmt: skip
    low, high = (line["predicted"]["speed_m_s"] for line in lines)
    assert high > low + 0.1
    for line in lines:
        for name in ("separation_m", "speed_m_s"):
            assert abs(line["normalized_error" + "_speed" * (name == "speed_m_s")]) < 1.0
    true = {truth["run"]: truth for truth in truth_of(chains)}
    held = [
        abs(run["separation_m"]["value"] - true[run["run"]]["separation_m"])
        < run["separation_m"]["U95"]
        for run in result["runs"]
    ]
    assert sum(held) >= 7


def test_pages_tables_and_coefficients_tell_the_settings_apart(chains, call, tmp_path):
    assert "drop 228.5 mm" in call("predict", str(chains.with_name("s.yaml"))).out
    page = tmp_path / "page.html"
    call("report", str(chains), "-o", str(page))
    assert page.read_text("utf-8").count("drop 228.5 mm") > 4
    call("export", str(chains), "--csv", str(tmp_path / "csv"))
    assert "drop 180 mm" in (tmp_path / "csv" / "runs.csv").read_text("utf-8")
    found = json.loads(call("estimate", str(chains), "--json").out)
    settings = [line["setting"] for line in found["alpha"]["inclines"]]
    assert settings == ["drop 180 mm", "drop 228.5 mm"]
    call("replay", str(chains))


def test_coefficients_are_those_of_one_surface(tmp_path, call):
    text = short("40 deg", 2).replace("  friction: 0.20 ± 0.02\n", "")
    text = text.replace("plan: {", "plan: {vary: {surface.friction: [0.1, 0.3]}, ")
    session = record(tmp_path, text)
    assert main(["analyze", str(session)]) == 0
    assert "varies surface.friction 0.1" in call("estimate", str(session), code=2).err
