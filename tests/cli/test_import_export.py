"""Edges go out as CSV and come in from any timer."""

import pytest

from tests.cli.lab import drops_of, short
from tests.tables import cases

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
            # A clock that is known otherwise weighs the edges otherwise, too, by parts in 100 000.
            far = abs(one[name]["value"] - two[name]["value"])
            assert far <= 2.0 * clock + 1e-4 * one[name]["u"], name
    for one, two in zip(analysis["summary"], again["summary"], strict=True):
        assert one["separation_m"]["value"] == pytest.approx(two["separation_m"]["value"], abs=1e-6)
        assert one["speed_m_s"]["value"] == pytest.approx(two["speed_m_s"]["value"], abs=1e-4)
    assert again["clock"] == {"source": "times as the file gives them", "relative_u": 1e-6}


@pytest.mark.usefixtures("analysed_once", "undrawn")
def test_only_what_is_simulated_is_stamped(bring, first, call, tmp_path):
    for name, more in (("simulated", ("--simulated",)), ("real", ())):
        bring(*more, session=name, events=first)
        session, page = tmp_path / name, tmp_path / f"{name}.html"
        stamped = name == "simulated"
        assert call("analyze", session, "--json").json["simulated"] is stamped
        assert call("analyze", session).out.startswith("SIMULATED DATA\n") is stamped
        call("report", session, "-o", page)
        assert ("SIMULATED DATA" in page.read_text("utf-8")) is stamped
        call("export", session, "--csv", tmp_path / f"{name}-csv")
        readme = (tmp_path / f"{name}-csv" / "README.txt").read_text("utf-8")
        assert readme.startswith("SIMULATED DATA") is stamped


def test_an_import_is_replayed_without_bytes(bring, call, tmp_path):
    bring()
    session = tmp_path / "imported"
    done = call("replay", session)
    assert done.out.splitlines() == [
        "no bytes were recorded: the edges come from a file",
        "results: 4 identical",
        "identical",
    ]


def test_what_an_import_lacks_can_be_measured_afterwards(bring, first, call, finished, tmp_path):
    bring("--simulated", "--clock-uncertainty", "10 ppm", events=first)
    session = tmp_path / "imported"
    before = call("analyze", session, "--json").json["runs"]
    done = call("run", finished.protocol, "--port", "sim://", "--session", session, "--json")
    assert drops_of(session) == [(1, 1), (2, 1), (3, 1), (4, 1)]
    # What the new drops teach about the rig changes the numbers of the old ones, but not this.
    for old, new in zip(before, done.json["runs"], strict=False):
        assert new["calibration"] == old["calibration"], "its own clock stays its own"


@pytest.fixture
def refused(bring, tmp_path):
    def lines(*more, **files):
        done = bring(*more, code=2, **files)
        assert done.out == ""
        assert not (tmp_path / "imported").exists()
        return done.err.splitlines()

    return lines


def test_runs_beyond_the_plan_are_refused(refused, exported, tmp_path):
    events = tmp_path / "events.csv"
    events.write_text(
        (exported / "edges.csv").read_text("utf-8") + "5,0,0.1,1\n7,0,0.1,1\n", "utf-8"
    )
    first, hint = refused(events=events)
    assert first.startswith(f"{events}: run 5 is not in the plan, which has ")
    assert first.endswith("which has 4 runs")
    assert hint.startswith("  hint: ")


def test_what_is_missing_is_named(refused, tmp_path):
    (line,) = refused(events=tmp_path / "none.csv")
    assert line == f"{tmp_path / 'none.csv'}: cannot read this file: No such file or directory"


@cases
def test_what_is_absurd_or_stated_again_is_refused(refused, option, value, said):
    """The project's own format says all of a file, but how good its clock was."""
    first, *_ = refused(f"{option}={value}")
    assert first.removeprefix("rig import: argument ").startswith(f"{option}: {said}")


def test_an_existing_session_is_never_imported_into(bring, tmp_path):
    bring()
    before = (tmp_path / "imported").read_bytes()
    assert f"{tmp_path / 'imported'} already exists" in bring(code=2).err
    assert (tmp_path / "imported").read_bytes() == before


def test_channels_that_are_no_gates_are_kept_and_told(bring, call, exported, tmp_path):
    """An idle input does not spoil a timer's file."""
    protocol, events = tmp_path / "seven.yaml", tmp_path / "events.csv"
    text = short().replace("    - {channel: 15, height: 1078 mm}\n", "")
    protocol.write_text(text, "utf-8")
    events.write_bytes((exported / "edges.csv").read_bytes())
    done = bring(events=events, protocol=protocol)
    assert "edges of channels 15 are kept but belong to no gate" in done.err
    call("analyze", tmp_path / "imported")
