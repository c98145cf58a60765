"""One object past several gates, from the protocol to table, JSON and report."""

import json

import pytest

from tests.cli.lab import PROTOCOLS


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("name", ["falling-ball", "glider"])
def test_each_gate_says_speed_and_time(name, call, tmp_path):
    text = (PROTOCOLS / f"{name}.yaml").read_text("utf-8")
    protocol, session, page = (tmp_path / each for each in ("p.yaml", "p.session", "p.html"))
    protocol.write_text(text.replace("repeats: 10, settle: 10 s", "repeats: 10, settle: 5 s")
                        .replace("repeats: 10, settle: 5 s", "repeats: 2, settle: 1 s"),
                        "utf-8")  # fmt: skip
    ran = call("run", protocol, "--port", "sim://?missed=0", "--session", session, "--yes")
    assert ran.code == 0, ran.err
    table = call("analyze", session).out
    assert "time since previous gate ± U (ms)" in table
    found = json.loads(call("analyze", session, "--json").out)
    (line,) = found["summary"]
    first, second, *_ = line["gates"]
    assert first["n"] == second["n"] == len(found["runs"]) == 2
    assert set(first["speed_m_s"]) == {"value", "u", "U95"}
    assert "interval_s" not in first
    assert second["interval_s"]["value"] > 0.0
    assert second["interval_sd_s"] >= 0.0
    assert ("acceleration_m_s2" in line) == (name == "glider") == ("gravity_m_s2" not in line)
    assert call("export", session, "--csv", tmp_path / "csv").code == 0
    rows = (tmp_path / "csv/gates.csv").read_text("utf-8").splitlines()
    assert rows[0].startswith("run,attempt,channel,height_m,speed_m_s,speed_m_s_u,")
    assert len(rows) == 1 + sum(len(run["gates"]) for run in found["runs"])
    assert call("report", session, "-o", page).code == 0
    assert "Gate by gate" in page.read_text("utf-8")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "rods: 1",
            "rods: 1\n    length: 20 mm",
            "p.yaml:9:5: chains.ball.length: one object has no length",
        ),
        (
            "rods: 1",
            "rods: 2\n    length: 1 m",
            "track: a track is for one object without a surface",
        ),
        ("850 mm", "895 mm", "which ball blocks before the release"),
        ("850 mm", "950 mm", "ball does not pass above 900.0 mm"),
        ("drop: 900", "surface: {restitution: 0.5}\ndrop: 900", "for one object leave surface out"),
    ],
)
def test_what_makes_no_sense_is_said_at_its_place(old, new, said, call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (PROTOCOLS / "falling-ball.yaml").read_text("utf-8").replace(old, new, 1)
    (tmp_path / "p.yaml").write_text(f"{text}track: {{incline: 5 deg}}\n", "utf-8")
    done = call("check", "p.yaml")
    assert done.code == 2
    assert said in done.err
