"""Sessions whose plan varies a key of the scene: one rig, one fit, a line for each setting."""

import pytest

from rig.analysis.owners import suffixes
from rig.protocol.reader import parse, read
from tests.analysis.kept_results import FOLDER
from tests.cli.lab import PROTOCOLS, record, short

pytestmark = pytest.mark.usefixtures("analysed_once")
HEIGHTS = [f"drop {height} mm ± 1 mm" for height in (900, 1200, 1600)]


def vary(words: str, text: str, *keys: str) -> str:
    """Let the plan of a protocol vary keys, which are then stated nowhere else."""
    for key in keys:
        text = "\n".join(line for line in text.splitlines() if not line.lstrip().startswith(key))
    return text.replace("plan: {", f"plan: {{vary: {words}, ") + "\n"


@pytest.fixture(scope="module")
def balls(tmp_path_factory):
    """Two sessions of the same plan, of the same rig and of another."""
    folder, text = tmp_path_factory.mktemp("balls"), (PROTOCOLS / "falling-ball.yaml").read_text()
    values = ", ".join(setting.removeprefix("drop ") for setting in HEIGHTS)
    text = vary(f"{{drop: [{values}]}}", text, "drop").replace("repeats: 10", "repeats: 4")
    return [record(folder, text, f"sim://?stated=1&seed={n}", f"b{n}") for n in range(2)]


def analysed(call, *sessions):
    return call("analyze", *map(str, sessions), "--json").json


def test_gravity_is_one_mean_of_all_heights_and_gates_are_of_each(balls, call):
    for session in balls:
        result = analysed(call, session)
        (line,) = result["summary"]
        assert line["n"] == 12
        assert abs(line["gravity_m_s2"]["value"] - 9.81) < line["gravity_m_s2"]["U95"]
        assert [gate["setting"] for gate in line["gates"]] == HEIGHTS * 4
        assert {run["setting"] for run in result["runs"]} == {*HEIGHTS}
        heights = [row for row in result["learned"]["unknowns"] if row["name"].startswith("drop")]
        assert len(heights) == len(HEIGHTS), "each height has an error of its own"
    assert [line["n"] for line in analysed(call, *balls)["summary"]] == [24]


def test_another_timers_file_is_read_by_each_runs_own_scene(balls, call, tmp_path):
    call("export", str(balls[0]), "--csv", str(tmp_path))
    edges = (tmp_path / "edges.csv").read_text("utf-8").splitlines()
    file, again = tmp_path / "timer.csv", tmp_path / "again.session"
    file.write_text("\n".join(["run,gate,time (s),blocked", *edges[1:]]), "utf-8")
    words = ("--protocol", balls[0].with_suffix(".yaml"), "--session", again, "--simulated")
    call("import", file, *words, "--clock-uncertainty", "5 ppm")
    assert len(analysed(call, again)["runs"]) == 12


def test_pages_and_tables_tell_the_settings_apart(call, tmp_path):
    """That each is compared with its own prediction is kept."""
    session, setting = FOLDER / "vary.session", "drop 250 mm ± 1 mm"
    assert setting in call("predict", session.with_suffix(".yaml")).out
    page = tmp_path / "page.html"
    call("report", session, "-o", page)
    assert page.read_text("utf-8").count(setting) > 4
    call("replay", session)


def test_coefficients_are_those_of_one_surface(tmp_path, call):
    text = vary("{surface.friction: [0.1, 0.3]}", short("40 deg", 2), "friction")
    session = record(tmp_path, text)
    for words in (["estimate", session], ["design", session.with_suffix(".yaml")]):
        assert "varies surface.friction 0.1" in call(*map(str, words), code=2).err


def test_unknowns_are_shared_by_settings_that_state_the_same():
    words = "{drop: [180 mm, 228.5 mm], surface.friction: [0.1, 0.2]}"
    protocol = parse(vary(words, short("40 deg", 1), "drop", "friction"))
    first = [{}, {}, *[{"start": " (drop 228.5 mm, surface.friction 0.1)"}] * 2]
    assert [suffixes(protocol, run) for run in protocol.runs()] == first
    ball = (PROTOCOLS / "falling-ball.yaml").read_text("utf-8")
    text = vary("{drag.terminal_speed: [60 m/s, 50 m/s]}", ball, "drag")
    protocol = parse(f"{text}drag: {{}}\n")
    assert {owner for run in protocol.runs() for owner in suffixes(protocol, run)} == {"air"}
    assert suffixes(read(PROTOCOLS / "falling-ball.yaml"), protocol.runs()[0]) == {}


def test_chains_that_any_setting_makes_unlike_are_told_apart():
    text = short().replace("length: 1165 mm, ", "").replace("like: A", "like: A, length: 1165 mm")
    protocol = parse(vary("{chains.A.length: [1165 mm, 1150 mm]}", text))
    assert {protocol.condition(run).impact_chain for run in protocol.runs()} == {"A", "B"}
