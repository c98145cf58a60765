"""What a scene does not have costs nothing: modules and counts, each in a process of its own.

How long anything takes is never tested.
"""

import csv
import json

from rig.bench import scenes as bench
from rig.bench.scenes import ladder
from rig.cli import main


def test_the_command_prints_a_table_and_keeps_it(monkeypatch, capsys, tmp_path):
    steps = ladder()[:2]
    monkeypatch.setattr(bench, "ladder", lambda: steps)
    ready, kept = tmp_path / "ready", tmp_path / "kept"
    ready.mkdir()
    (ready / "mine.yaml").write_text(ladder()[3].text, "utf-8")
    assert (
        main(["bench", "scenes", "--rounds", "1", "--protocols", str(ready), "-o", str(kept)]) == 0
    )
    heading, *rows = capsys.readouterr().out.splitlines()
    assert heading.split()[:2] == ["scene", "modules"]
    names = ["free fall", "α given, level", "mine"]
    assert all(row.startswith(name) for row, name in zip(rows, names, strict=False))
    whole = json.loads((kept / "scenes.json").read_text("utf-8"))
    assert [scene["scene"] for scene in whole["scenes"]] == names
    assert whole["scenes"][0]["added"] == []
    assert "rig.model.impact" in whole["scenes"][1]["added"]
    with (kept / "scenes.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["scene"] for line in lines] == names
    assert [line["g(θ)"] for line in lines] == ["0", "0", "1"]
    assert (kept / "scenes.svg").read_text("utf-8").lstrip().startswith("<?xml")
