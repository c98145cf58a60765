"""What is foretold of a layout comes true."""

from __future__ import annotations

import json

import pytest

from bench.__main__ import main


def test_a_session_states_what_was_foretold_of_its_layout(tmp_path, capsys):
    words = ["foretold", "--only", "single", "-o", str(tmp_path), "--json"]
    assert main(words) == 0
    found = json.loads(capsys.readouterr().out)["foretold"]
    assert {one["quantity"] for one in found} >= {"speed_m_s", "restitution"}
    for one in found:
        assert one["found"] == pytest.approx(one["by_learned"], rel=0.15), one
        assert one["by_stated"] > one["by_learned"], "more scatter is stated than this rig has"
    page = (tmp_path / "foretold.md").read_text("utf-8")
    assert "found / foretold" in page
    assert (tmp_path / "foretold.csv").is_file()
