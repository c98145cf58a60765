"""``rig estimate``, ``rig design`` and the import of data loggers' tables, as users meet them."""

from __future__ import annotations

import json
import re

import pytest

from rig.link.messages import pack_label
from rig.protocol import reader
from sim.dials import Dials
from sim.lab import ChainLab
from tests.analysis.drops import SINGLE, case
from tests.cli.lab import PROTOCOLS

pytestmark = pytest.mark.usefixtures("analysed_once")
FENCE = PROTOCOLS / "picket-fence.yaml"


@pytest.fixture(scope="module")
def estimated(analysed_once, finished, tmp_path_factory):
    from rig.cli import main

    folder = tmp_path_factory.mktemp("estimated") / "pictures"
    assert main(["estimate", str(finished.session), "-o", str(folder)]) == 0
    return folder


def test_an_estimate_says_everything_in_json(call, finished):
    found = json.loads(call("estimate", finished.session, "--json").out)
    assert found["simulated"] is True
    assert found["drops"] == 4
    names = {one["name"] for one in found["parameters"]}
    assert names <= {"restitution", "friction", "pile_restitution"}
    for one in found["parameters"]:
        assert set(one["least_squares"]) == {"value", "u", "U95"}
    assert {"alpha", "comparison", "curves", "end_correction", "impulses", "tests"} <= set(found)
    assert json.loads(call("estimate", finished.session, "--json").out) == found


def test_an_estimate_as_text_is_stamped(call, finished):
    done = call("estimate", finished.session)
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("SIMULATED DATA\n4 good drops")
    for said in ("Best single α", "end correction", "Eq. 9", "The protocol's model"):
        assert said in done.out


def test_pictures_of_an_estimate_are_stamped(estimated):
    names = {path.name for path in estimated.iterdir()}
    assert {"alpha.svg", "curves.svg", "impulses.svg"} <= names
    assert all("SIMULATED" in path.read_text("utf-8") for path in estimated.iterdir())


def test_a_report_has_the_impacts_too(page):
    html = page.read_text("utf-8")
    for heading in ("Best single α", "End correction", "Single impulses"):
        assert f"<h3>{heading}</h3>" in html


def test_a_design_of_what_is_there(call, tmp_path):
    done = call("design", PROTOCOLS / "single-chain.yaml", "--no-search", "--json")
    found = json.loads(done.out)
    assert (done.code, found["scatter"]) == (0, "stated")
    assert "proposed" not in found
    assert found["current"]["readable"]
    (speed,) = [one for one in found["current"]["measurands"] if one["name"] == "speed_m_s"]
    # About that of a drop measured by itself.
    u = case(SINGLE, Dials.quiet()).analyze().quantities["speed_m_s"].u
    assert speed["u_run"] == pytest.approx(u, rel=0.1)
    twice = json.loads(
        call(
            "design", PROTOCOLS / "single-chain.yaml", "--no-search", "--json", "--repeats", "48"
        ).out
    )
    (again,) = [one for one in twice["current"]["measurands"] if one["name"] == "speed_m_s"]
    assert again["inclines"][0]["u_mean"] < speed["inclines"][0]["u_mean"]


def test_a_design_proposes_heights_and_writes_them(call, tmp_path):
    new = tmp_path / "new.yaml"
    done = call("design", FENCE, "--lowest", "40 mm", "--spacing", "5 cm", "-o", new)
    assert done.code == 0, done.err
    (line,) = re.findall(r"^proposed \(mm\): (.*)$", done.out, re.MULTILINE)
    proposed = [float(one) * 1e-3 for one in line.split(", ")]
    assert "sweep 1" in done.err
    assert "±" not in done.out
    written, before = (
        [gate.height for gate in reader.read(path).gates.gates] for path in (new, FENCE)
    )
    assert sorted(written) == pytest.approx(sorted(proposed), abs=0.06e-3)
    assert written != before
    changed = [
        (old, now) for old, now in zip(FENCE.read_text("utf-8").splitlines(),
                                       new.read_text("utf-8").splitlines(), strict=True)
        if old != now
    ]  # fmt: skip
    assert 1 <= len(changed) <= len(proposed)
    assert all("height: " in old and "height: " in now for old, now in changed)
    assert call("design", FENCE, "--no-search", "-o", new).code == 2


def test_a_design_by_the_scatter_that_a_session_taught(call, finished):
    done = call("design", finished.protocol, "--no-search", "--json", "--learned", finished.session)
    found = json.loads(done.out)
    assert found["scatter"] == "learned"
    stated = json.loads(call("design", finished.protocol, "--no-search", "--json").out)
    for one, other in zip(
        found["current"]["measurands"], stated["current"]["measurands"], strict=True
    ):
        assert one["u_run"] < other["u_run"]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--lowest", "7 kg"], "--lowest: "),
        (["--highest", "1 mm"], "--lowest is above --highest"),
        (["--spacing", "-1 mm"], "--spacing: found '-1 mm'; accepted: a length above 0"),
    ],
)
def test_bad_limits_are_said(call, more, said):
    done = call("design", FENCE, *more)
    assert done.code == 2
    assert said in done.err
    assert "Traceback" not in done.err


def test_an_estimate_of_a_fence_is_refused(call, tmp_path):
    assert call("run", FENCE, "--port", "sim://", "--session", tmp_path / "s", "--yes").code == 0
    done = call("estimate", tmp_path / "s")
    assert done.code == 2
    assert "no coefficients" in done.err


@pytest.fixture
def scene(tmp_path):
    """The picket fence, of which it is known that the air takes next to nothing."""
    path = tmp_path / "fence.yaml"
    path.write_text(FENCE.read_text("utf-8") + "priors: {drag: 0.005}\n", "utf-8")
    return path


@pytest.fixture
def table(tmp_path):
    """Three falls through the upper gate of the picket fence, as a data logger's table."""
    from rig.protocol import reader

    protocol = reader.read(FENCE)
    lab = ChainLab(protocol, Dials(rod_sd=1e-4, missed=0.0, chatter=0.0, string=0.0), 4)
    falls = [
        [(s, blocked) for s, channel, blocked in lab.drop(pack_label(n, 1)) if channel == 1]
        for n in (1, 2, 3)
    ]
    heading = ";".join(f'"Time (s) Run #{n}";"State Run #{n}"' for n in (1, 2, 3))
    rows = [
        ";".join(f"{s:.6f};{blocked:d}" for s, blocked in row) for row in zip(*falls, strict=True)
    ]
    path = tmp_path / "fence.csv"
    path.write_text("\n".join([heading, *rows]).replace(".", ","), "utf-8")
    return path


def test_a_logger_s_table_gives_gravity_with_its_uncertainty(call, table, scene, tmp_path):
    session = tmp_path / "s"
    given = ("import", table, "--protocol", scene, "--session", session, "--simulated")
    done = call(*given, "--channel", "1", "--clock-uncertainty", "20 ppm")
    assert (done.code, done.err.splitlines()[-1]) == (0, f"48 edges of 3 runs → {session}")
    assert done.err.startswith("3 runs, 16 rows: 48 edges; 0 rows without a change\n")
    found = json.loads(call("analyze", session, "--json").out)
    assert [run["verdict"] for run in found["runs"]] == ["accepted"] * 3
    (line,) = found["summary"]
    gravity = line["gravity_m_s2"]
    assert abs(gravity["value"] - 9.81) < gravity["U95"] < 0.1
    assert call("report", session, "-o", tmp_path / "r.html").code == 0


def test_a_column_of_times_of_darkening_is_enough(call, table, scene, tmp_path):
    """Some timers tell only when a beam darkens: nothing else is then expected, or missed."""
    rows = [line.split(";") for line in table.read_text("utf-8").splitlines()[1:]]
    times = [time for time, state, *_ in rows if state == "1"]
    column = tmp_path / "column.csv"
    column.write_text("\n".join(["Time (s)", *times]), "utf-8")
    session = tmp_path / "s"
    given = ("import", column, "--protocol", scene, "--session", session, "--simulated")
    done = call(*given, "--channel", "1", "--clock-uncertainty", "20 ppm")
    assert (done.code, done.err.splitlines()[-1]) == (0, f"8 edges of 1 run → {session}")
    assert "8 of 8 edges where a fall puts them" in done.err
    found = json.loads(call("analyze", session, "--json").out)
    (run,) = found["runs"]
    assert run["edges"]["missed"] == 0
    gravity = run["gravity_m_s2"]
    assert abs(gravity["value"] - 9.81) < gravity["U95"] < 0.2


def test_a_table_of_no_named_gate_is_of_that_which_fits_and_of_none_that_is_not_there(
    call, table, tmp_path
):
    """Its times are those of the upper gate, as the protocol's fall tells."""
    session = tmp_path / "s"
    given = ("import", table, "--protocol", FENCE, "--session", session, "--simulated")
    done = call(*given, "--channel", "9")
    assert done.code == 2
    assert not session.exists()
    done = call(*given)
    assert done.code == 0
    assert "read as --map 'input=1': 3 runs: 48 of 48 edges where a fall puts them" in done.err


def test_a_fault_of_a_table_has_its_place(call, table, tmp_path):
    table.write_text(table.read_text("utf-8").replace("\n", "\n0,1;x;0,1;1;0,1;1\n", 1), "utf-8")
    done = call("import", table, "--protocol", FENCE, "--session", tmp_path / "s", "--channel", "1")
    assert done.code == 2
    assert f"{table}:2:" in done.err
