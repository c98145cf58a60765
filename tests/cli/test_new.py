"""``rig new``: answers become a protocol that is read, drawn and tried."""

from pathlib import Path

import pytest

from rig.errors import InputError
from rig.files import write_atomic
from rig.protocol.draft import SCENES, Draft, draft_text
from rig.protocol.measurable import check_recordable
from rig.protocol.reader import parse, read
from tests.cli.lab import Terminal
from tests.tables import read_table

DRAFTS = read_table(__file__, "drafts")


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("gates", [2, 3, 4, 5, 12])
def test_any_number_of_gates_finds_a_place(scene, gates):
    places, answers = DRAFTS[scene]
    draft = Draft(f'What "{scene}" says', scene, gates, repeats=8, **answers)
    protocol = parse(draft_text(draft))
    check_recordable(protocol)
    assert protocol.title == f'What "{scene}" says'
    drilled = [(gate.side, round(gate.height * 1e3, 6)) for gate in protocol.gates.gates]
    heights = {side: [mm for at, mm in drilled if at == side] for side in places[5]}
    assert sum(map(len, heights.values())) == gates
    assert heights == places.get(gates, heights)
    assert (protocol.track is not None) == (scene == "track")
    trial = parse(draft_text(draft.trial()))
    assert (len(trial.plan.inclines), trial.plan.repeats) == (1, 4)


def test_a_protocol_with_drawings_and_four_drops(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ["--scene", "object", "--gates", "3", "--board", "mega", "--yes"]
    done = call("new", "my-ball.yaml", *options, "--drop", "700 mm ± 1 mm", code={0, 3})
    protocol = read("my-ball.yaml")
    assert (protocol.title, len(protocol.gates.gates)) == ("my ball", 3)
    assert protocol.drop.value == pytest.approx(0.7)
    assert {path.name for path in tmp_path.iterdir()} == {
        "my-ball.yaml", "my-ball-mounting.svg", "my-ball-wiring.svg"
    }  # fmt: skip
    assert "Mega" in (tmp_path / "my-ball-wiring.svg").read_text("utf-8")
    assert "SIMULATED DATA" in done.out
    assert "trial drops" in done.out or "g ± U (m/s²)" in done.out
    assert done.err.count("run ") >= 4
    assert "How many drops? 12 (--repeats)" in done.err
    assert "--gates" not in done.err, "that was no usual answer"
    for here in ("my-ball.yaml", "my-ball-mounting.svg", "my-ball-wiring.svg"):
        assert f"{here} already exists" in call("new", "my-ball.yaml", "--yes", code=2).err
        Path(here).unlink()
    assert not any(tmp_path.iterdir()), "none was drawn anew while another was there"


def test_a_disk_that_is_full_half_way_is_left_as_it_was(call, tmp_path, monkeypatch):
    def full(path, content):
        if "wiring" in path.name:
            raise InputError(f"cannot write {path}: No space left on device")
        write_atomic(path, content)

    monkeypatch.setattr("rig.commands.new.write_atomic", full)
    done = call("new", tmp_path / "x.yaml", "--scene", "object", "--yes", code=2)
    assert "No space left" in done.err
    assert not any(tmp_path.iterdir())


def test_it_asks_for_what_is_not_said(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tried = []
    monkeypatch.setattr("rig.commands.new._simulate", lambda draft: tried.append(draft) or 0)
    answers = ["fence", "picket-fence", "", "2", "6", "250 mm", "", "350 mm ± 1 mm", "5"]
    monkeypatch.setattr("sys.stdin", Terminal("\n".join(answers) + "\n"))
    done = call("new", "f.yaml")
    assert done.err.startswith("What have you got?\n- one object past gates\n  - ball, card")
    assert "accepted: two-chains" in done.err
    (draft,) = tried
    assert (draft.rods, draft.length, draft.diameter) == (6, "250 mm", "25 mm")
    assert (draft.drop, draft.repeats, draft.gates) == ("350 mm ± 1 mm", 5, 2)
