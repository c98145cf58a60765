"""``rig estimate``, ``rig design`` and the import of data loggers' tables, as users meet them."""

import re

import pytest

from rig.protocol import reader
from sim.dials import Dials
from tests.analysis.drops import SINGLE, case
from tests.cli.lab import PROTOCOLS

pytestmark = pytest.mark.usefixtures("analysed_once")
FENCE = PROTOCOLS / "picket-fence.yaml"


def test_an_estimate_says_everything_in_json(call, finished):
    found = call("estimate", finished.session, "--json").json
    assert found["simulated"] is True
    assert found["drops"] == 4
    names = {one["name"] for one in found["parameters"]}
    assert names <= {"restitution", "friction", "pile_restitution"}
    for one in found["parameters"]:
        assert set(one["least_squares"]) == {"value", "u", "U95"}
    assert {"alpha", "comparison", "curves", "end_correction", "impulses", "tests"} <= set(found)
    assert call("estimate", finished.session, "--json").json == found


def test_a_design_of_what_is_there(call):
    words = ("design", PROTOCOLS / "single-chain.yaml", "--no-search", "--json")
    found = call(*words).json
    assert found["scatter"] == "stated"
    assert "proposed" not in found
    assert found["current"]["readable"]
    (speed,) = [one for one in found["current"]["measurands"] if one["name"] == "speed_m_s"]
    # About that of a drop measured by itself.
    u = case(SINGLE, Dials.quiet()).analyze().quantities["speed_m_s"].u
    assert speed["u_run"] == pytest.approx(u, rel=0.1)
    twice = call(*words, "--repeats", "48").json
    (again,) = [one for one in twice["current"]["measurands"] if one["name"] == "speed_m_s"]
    assert again["inclines"][0]["u_mean"] < speed["inclines"][0]["u_mean"]


def test_a_design_proposes_heights_and_writes_them(call, tmp_path):
    new = tmp_path / "new.yaml"
    done = call("design", FENCE, "--lowest", "40 mm", "--spacing", "5 cm", "-o", new)
    (line,) = re.findall(r"^proposed \(mm\): (.*)$", done.out, re.MULTILINE)
    proposed = [float(one) * 1e-3 for one in line.split(", ")]
    told = float(re.findall(r"sweep \d: uncertainties × (\S+) in", done.err)[-1])
    (pair,) = re.findall(r"^g of one run .* (\S+) +(\S+)$", done.out, re.MULTILINE)
    assert told == pytest.approx(float(pair[1]) / float(pair[0]), rel=0.1)
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
    call("design", FENCE, "--no-search", "-o", new, code=2)


def test_a_design_by_the_scatter_that_a_session_taught(call, finished):
    done = call("design", finished.protocol, "--no-search", "--json", "--learned", finished.session)
    found = done.json
    assert found["scatter"] == "learned"
    stated = call("design", finished.protocol, "--no-search", "--json").json
    for one, other in zip(
        found["current"]["measurands"], stated["current"]["measurands"], strict=True
    ):
        assert one["u_run"] < other["u_run"]
    assert (
        "has another kind of scene"
        in call("design", FENCE, "--learned", finished.session, code=2).err
    )
