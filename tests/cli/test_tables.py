"""The export: what the scene has, in files other programs read."""

import shutil
from dataclasses import replace

from rig.reasons import plain_reason
from rig.session.schema import RunState
from rig.session.store import Session
from tests.tables import read_csv


def test_all_files(fences, call, tmp_path):
    """Edges are those of the Python door, see `tests.cli.test_door`."""
    copy = shutil.copy(fences, tmp_path / "s")
    with Session.open(copy) as session:
        session.add_drop(replace(session.drop(2, 1), attempt=2, certificate=None))
        void = [plain_reason("lost edges"), plain_reason('say "no", twice')]
        session.add_state(2, 2, RunState.VOID, 10, void)
        states, pings = session.states(), session.pings()
    place = tmp_path / "deep" / "out"
    for _ in range(2):  # the second time replaces
        call("export", copy, "--csv", place)
    runs = [(row["run"], row["attempt"], row["superseded"]) for row in read_csv(place / "runs.csv")]
    assert runs[:3] == [("1", "1", "0"), ("2", "1", "1"), ("2", "2", "0")]
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
