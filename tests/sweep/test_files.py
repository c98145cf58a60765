"""What stands in the files."""

import csv
import hashlib
import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest

from rig import __version__
from tests.cli.lab import Terminal
from tests.sweep.conftest import SCENE, VARY
from tests.tables import cases

ONE_INCLINE = "incline=40deg"


def test_csv_and_npz_say_the_same(sweep, tmp_path):
    sweep("s.csv", *VARY)
    sweep("s.npz", *VARY)
    lines = (tmp_path / "s.csv").read_text("utf-8").splitlines()
    comments = [line[2:].split(": ", 1) for line in lines if line.startswith("# ")]
    facts = {name: json.loads(text) for name, text in comments}
    assert facts["made_by"] == f"rig {__version__} sweep"
    assert facts["protocol_sha256"] == hashlib.sha256(SCENE.encode()).hexdigest()
    assert facts["fixed"] == {"drop_m": 0.18, "gravity_m_s2": 9.81}
    assert facts["pile"] == {"below_deg": 5.0, "restitution": -0.37}
    assert facts["free_chain_longer_m"] == pytest.approx(0.05)
    rows = list(csv.DictReader(lines[len(comments) :]))
    with np.load(tmp_path / "s.npz") as found:
        assert json.loads(found["metadata"].item()) == facts
        assert found["protocol"].item() == SCENE
        axes = found["axes"].tolist()
        assert axes == ["incline_deg", "restitution", "inertia", "friction"]
        assert list(rows[0]) == [*axes, "separation_m", "speed_m_s", "in_domain", "notes"]
        grids = np.meshgrid(*(found[name] for name in axes), indexing="ij")
        for name, grid in zip(axes, grids, strict=True):
            assert [float(row[name]) for row in rows] == grid.ravel().tolist()
        for name in ("separation_m", "speed_m_s"):
            column = [float(row[name] or "nan") for row in rows]
            assert np.array_equal(column, found[name].ravel(), equal_nan=True)
            assert np.isnan(column).any()
        assert [int(row["notes"]) for row in rows] == found["notes"].ravel().tolist()
        assert [row["in_domain"] == "1" for row in rows] == found["in_domain"].ravel().tolist()


@pytest.mark.parametrize("kind", ["csv", "npz", "svg"])
def test_the_same_sweep_gives_the_same_bytes(sweep, tmp_path, kind):
    for name in ("one", "two"):
        said = sweep(f"{name}.{kind}", "restitution=-1..1:9", "friction=0..1:9", ONE_INCLINE)
        assert said == f"{tmp_path / name}.{kind}: 81 points, 18 beyond the model's domain\n"
    assert (tmp_path / f"one.{kind}").read_bytes() == (tmp_path / f"two.{kind}").read_bytes()


@cases
def test_a_picture_has_maps_or_curves_and_its_provenance(sweep, tmp_path, vary, maps):
    sweep("s.svg", *vary)
    svg = (tmp_path / "s.svg").read_text("utf-8")
    root = ElementTree.fromstring(svg)
    words = [node.text for node in root.iter("{http://www.w3.org/2000/svg}text")]
    assert sum("against" in each for each in words) == maps
    assert hashlib.sha256(SCENE.encode()).hexdigest() in svg


@cases
def test_bad_input_is_told_before_anything_is_computed(
    sweep, tmp_path, monkeypatch, output, vary, said
):
    monkeypatch.setattr("rig.commands.sweep.compute", lambda *_: pytest.fail("computed"))
    assert said in sweep(output, *vary, code=2)
    assert [path.name for path in tmp_path.iterdir()] == ["scene.yaml"]


def test_an_interrupt_while_writing_leaves_the_old_file(sweep, tmp_path, monkeypatch):
    def write(stream, *_):
        stream.write(b"half")
        raise KeyboardInterrupt

    (tmp_path / "s.csv").write_text("old")
    monkeypatch.setattr("rig.commands.sweep.write_csv", write)
    assert sweep("s.csv", "friction=0..1:3", code=130) == "rig: interrupted; nothing was written\n"
    assert (tmp_path / "s.csv").read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 2


def test_a_terminal_has_one_line_that_is_rewritten(sweep, monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    sweep("s.csv", "friction=0..1:20000", ONE_INCLINE, more=("--jobs", "1"))
    drawn, said = terminal.getvalue().rsplit("\r\x1b[K", 1)
    assert "\n" not in drawn
    assert re.search(r"\r\x1b\[K100% of 20000 points, \S+/s, 0 s left", drawn)
    assert "s.csv: 20000 points" in said
