"""Edges go out as CSV, with all else that the scene has, and come in from any timer."""

import shutil
from dataclasses import replace

import pytest

from rig.reasons import make_reason, plain_reason
from rig.session.schema import RunState
from rig.session.store import Session
from tests.cli.lab import drops_of
from tests.tables import read_csv

QUANTITIES = ("separation_m", "separation_raw_m", "speed_m_s", "release_skew_s")


@pytest.fixture(scope="module")
def exported(finished, tmp_path_factory):
    """The finished session's CSV files, as the program itself writes them."""
    from rig.cli import main

    folder = tmp_path_factory.mktemp("exported") / "csv"
    assert main(["export", str(finished.session), "--csv", str(folder)]) == 0
    return folder


@pytest.fixture
def first(exported, tmp_path):
    """Write the edges of the first run alone."""
    rows = (exported / "edges.csv").read_text("utf-8").splitlines(keepends=True)
    events = tmp_path / "first.csv"
    events.write_text("".join(row for row in rows if row[0] in "r1"), "utf-8")
    return events


@pytest.fixture
def bring(call, finished, exported, tmp_path):
    """Import an edge file, the exported one by default."""

    def run(*more, events=None, protocol=None, session="imported", **ends):
        return call(
            *("import", events or exported / "edges.csv"),
            *("--protocol", protocol or finished.protocol, "--session", tmp_path / session),
            *more,
            **ends,
        )

    return run


def test_exported_edges_give_the_same_results_again(bring, call, analysis, tmp_path):
    done = bring("--clock-uncertainty", "1 ppm", "--simulated")
    assert done.out == ""
    edges = sum(run["edges"]["received"] for run in analysis["runs"])
    assert done.err == f"{edges} edges of 4 runs → {tmp_path / 'imported'}\n"
    again = call("analyze", tmp_path / "imported", "--json").json
    for one, two in zip(analysis["runs"], again["runs"], strict=True):
        assert (one["run"], one["verdict"]) == (two["run"], two["verdict"])
        assert one["edges"] == two["edges"]
        for name in QUANTITIES:
            clock = next(
                line["u"]
                for line in one["budget"]
                if (line["name"], line["quantity"]) == ("clock", name)
            )
            # A clock that is known otherwise weighs the edges otherwise, and so a joint fit ends
            # elsewhere within its last step, which is a fiftieth of u.
            far = abs(one[name]["value"] - two[name]["value"])
            assert far <= 2.0 * clock + 1e-3 * one[name]["u"], name
    for one, two in zip(analysis["summary"], again["summary"], strict=True):
        assert one["separation_m"]["value"] == pytest.approx(two["separation_m"]["value"], abs=1e-6)
        assert one["speed_m_s"]["value"] == pytest.approx(two["speed_m_s"]["value"], abs=1e-4)
    assert again["clock"] == {"source": "times as the file gives them", "relative_u": 1e-6}


def test_what_an_import_lacks_can_be_measured_afterwards(bring, first, call, finished, tmp_path):
    bring("--simulated", "--clock-uncertainty", "10 ppm", events=first)
    session = tmp_path / "imported"
    before = call("analyze", session, "--json").json["runs"]
    done = call("run", finished.protocol, "--port", "sim://", "--session", session, "--json")
    assert drops_of(session) == [(1, 1), (2, 1), (3, 1), (4, 1)]
    # What the new drops teach about the rig changes the numbers of the old ones, but not this.
    for old, new in zip(before, done.json["runs"], strict=False):
        assert new["calibration"] == old["calibration"], "its own clock stays its own"


def test_all_files(fences, call, tmp_path):
    """Edges are those of the Python door, see `tests.cli.test_door`."""
    copy = shutil.copy(fences, tmp_path / "s")
    with Session.open(copy) as session:
        session.add_drop(replace(session.drop(2, 1), attempt=2, certificate=None))
        void = [plain_reason("lost edges"), plain_reason('say "no", twice')]
        session.add_state(1, 1, RunState.REJECTED, 9, [make_reason("record_damaged", text="")])
        session.add_state(2, 2, RunState.VOID, 10, void)
        states, pings = session.states(), session.pings()
    place = tmp_path / "deep" / "out"
    for _ in range(2):  # the second time replaces
        call("export", copy, "--csv", place)
    rows = read_csv(place / "runs.csv")
    runs = [(row["run"], row["attempt"], row["superseded"]) for row in rows]
    assert runs[:3] == [("1", "1", "0"), ("2", "1", "1"), ("2", "2", "0")]
    printed = [run["reason_codes"] for run in call("analyze", copy, "--json").json["runs"]]
    codes = ["; ".join(reason["code"] for reason in reasons) for reasons in printed]
    assert [row["reason_codes"] for row in rows if row["superseded"] == "0"] == codes
    assert any(codes)
    said = read_csv(place / "states.csv")
    assert [row["state"] for row in said] == [entry.state for entry in states]
    assert said[-1]["reasons"] == 'lost edges; say "no", twice'
    ticks = [int(row["tick"]) for row in read_csv(place / "pings.csv")]
    assert ticks == [one.tick for one in pings]
    readme = (place / "README.txt").read_text("utf-8")
    assert readme.startswith("SIMULATED DATA")
    assert "  gravity_m_s2: [m/s²] " in readme
    assert {entry.name for entry in place.iterdir()} == {
        "README.txt", "budget.csv", "edges.csv", "pings.csv", "runs.csv", "states.csv",
        "summary.csv",
    }  # fmt: skip


def test_a_table_has_the_values_of_json(fences, call, tmp_path):
    """Which columns a scene has is for `tests.cli.test_bundle`."""
    call("export", fences, "--csv", tmp_path)
    found = call("analyze", fences, "--json").json
    for table in ("runs", "summary"):
        for line, record in zip(read_csv(tmp_path / f"{table}.csv"), found[table], strict=True):
            cells = [float(line[f"gravity_m_s2{part}"]) for part in ("", "_u", "_U95")]
            assert cells == [record["gravity_m_s2"][part] for part in ("value", "u", "U95")]
            if table == "runs":
                assert line["edges_received"] == str(record["edges"]["received"])
