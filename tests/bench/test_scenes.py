"""What a scene does not have costs nothing: modules and counts, each in a process of its own.

How long anything takes is never tested.
"""

import csv
import json

from rig.bench import scenes as bench
from rig.bench.scenes import ladder
from rig.cli import main


def test_a_scene_gains_nothing_that_it_does_not_have(monkeypatch, capsys, tmp_path):
    steps = {name: ladder()[name] for name in ("free fall", "whole")}
    monkeypatch.setattr(bench, "ladder", lambda: dict(steps))
    monkeypatch.setattr(bench, "_PROBES", 2)
    ready, kept = tmp_path / "ready", tmp_path / "kept"
    ready.mkdir()
    (ready / "mine.yaml").write_text(ladder()["inclined"], "utf-8")
    command = ["bench", "scenes", "--rounds", "1", "--protocols", str(ready)]
    assert main([*command, "-o", str(kept)]) == 0
    assert "no scene gained what it does not have" in capsys.readouterr().out
    scenes = json.loads((kept / "scenes.json").read_text("utf-8"))["scenes"]
    assert [scene["scene"] for scene in scenes] == [*steps, "mine"]
    assert [scene["calls"]["g(θ)"] for scene in scenes] == [0, 30, 1]
    assert scenes[0]["calls"]["falls"] == 0
    with (kept / "scenes.csv").open(encoding="utf-8", newline="") as file:
        assert [line["scene"] for line in csv.DictReader(file)] == [*steps, "mine"]
    assert (kept / "scenes.svg").read_text("utf-8").lstrip().startswith("<?xml")


def test_what_a_scene_gains_fails(monkeypatch, capsys, tmp_path):
    parts = {**bench.PARTS, "gates": {"rig.model.chain"}}  # as if falls needed gates
    monkeypatch.setattr(bench, "PARTS", parts)
    monkeypatch.setattr(bench, "_PROBES", 1)
    monkeypatch.setattr(bench, "ladder", lambda: {"whole": ladder()["level surface"]})
    command = ["bench", "scenes", "--rounds", "1", "--protocols", "nowhere"]
    assert main([*command, "-o", str(tmp_path)]) == 1
    assert "whole gained rig.model.chain (gates)" in capsys.readouterr().out
    (level,) = json.loads((tmp_path / "scenes.json").read_text("utf-8"))["scenes"]
    assert (level["calls"]["g(θ)"], level["calls"]["falls"]) == (0, 1)
