"""The export: what the scene has, in files other programs read."""

import csv
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rig.bundle.tables import csv_files
from rig.files import make_folder, write_atomic
from rig.reasons import plain_reason
from rig.records import ClockSample, Drop, Edge
from rig.session.schema import RunState
from rig.session.store import Session
from tests.timers.edges import read_edges

ANALYSIS: dict[str, Any] = {
    "runs": [
        {"run": 1, "attempt": 2, "verdict": "void", "reasons": ["skew 7 ms", 'say "no", twice']},
        {
            "run": 2,
            "attempt": 1,
            "separation_m": {"value": 0.1, "u": 0.001, "U95": 0.002},
            "edges": {"received": 50, "missed": 0},
            "verdict": "accepted",
            "reasons": [],
            "budget": [{"name": "skew", "quantity": "separation", "u": 1e-4}],
        },
    ],
    "superseded": [{"run": 1, "attempt": 1, "verdict": "void", "reasons": ["lost edges"]}],
    "summary": [{"incline_deg": 40.0, "n": 1, "predicted": {"separation_m": 0.11546810526538031}}],
}


@pytest.fixture
def session(tmp_path: Path):
    edges = (Edge(100, 0, True), Edge(300, 0, False))
    with Session.create(
        tmp_path / "s.rig", "p: 1\n", "p.yaml", simulated=True, origin="sim://"
    ) as session:
        session.add_drop(Drop(run=1, attempt=1, tick_hz=1000, edges=()))
        session.add_drop(Drop(run=1, attempt=2, tick_hz=1000, edges=edges, fire_tick=5))
        session.add_state(
            1, 1, RunState.VOID, 10, [plain_reason("lost edges"), plain_reason("twice")]
        )
        session.add_timing(ClockSample(1, 2, 3))
        yield session


def export_csv(folder: Path, *found: Any) -> None:
    """Write the tables as ``rig export`` does, of a board whose clock is one tick a second fast."""
    clock = SimpleNamespace(scale=lambda drop: SimpleNamespace(hz=drop.tick_hz + 1.0))
    place = make_folder(folder)
    for name, text in csv_files(*found, clock).items():
        write_atomic(place / name, text)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def test_all_files(tmp_path: Path, session: Session) -> None:
    place = tmp_path / "deep" / "out"
    for _ in range(2):  # the second time replaces
        export_csv(place, session, ANALYSIS)
    runs = rows(place / "runs.csv")
    assert [(row["run"], row["attempt"], row["superseded"]) for row in runs] == [
        ("1", "1", "1"),
        ("1", "2", "0"),
        ("2", "1", "0"),
    ]
    assert runs[1]["reasons"] == 'skew 7 ms; say "no", twice'
    assert runs[2]["separation_m_U95"] == "0.002"
    assert runs[2]["edges_received"] == "50"
    [line] = rows(place / "summary.csv")
    assert float(line["predicted_separation_m"]) == 0.11546810526538031
    assert rows(place / "states.csv")[0]["reasons"] == "lost edges; twice"
    assert rows(place / "pings.csv") == [{"host_send_ns": "1", "host_recv_ns": "2", "tick": "3"}]
    [drop] = read_edges(place / "edges.csv")
    assert drop.edges[1].tick == round(300 / 1001 * 10**12)
    readme = (place / "README.txt").read_text()
    assert readme.startswith("SIMULATED DATA")
    assert "  separation_m: [m] height" in readme
    assert {entry.name for entry in place.iterdir()} == {
        "README.txt", "budget.csv", "edges.csv", "pings.csv", "runs.csv", "states.csv",
        "summary.csv",
    }  # fmt: skip


@pytest.mark.parametrize("scene", ["fences", "finished"])
def test_a_table_has_the_columns_of_its_scene(scene, request, call, tmp_path):
    session = request.getfixturevalue(scene)
    assert call("export", getattr(session, "session", session), "--csv", tmp_path).code == 0
    struck = {"incline_deg", "impact_chain", "separation_m"}
    for table in ("runs", "summary"):
        columns = set(rows(tmp_path / f"{table}.csv")[0])
        assert columns & struck == (struck if scene == "finished" else set()) - (
            {"impact_chain"} if table == "summary" else set()
        )
        assert ("gravity_m_s2_U95" in columns) == (scene == "fences")
