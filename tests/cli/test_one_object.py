"""What makes no sense of one object is said at its place; its results are for tests/analysis."""

import pytest

from tests.cli.lab import PROTOCOLS


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "rods: 1",
            "rods: 1\n    length: 20 mm",
            "p.yaml:9:5: chains.ball.length: one object has no length",
        ),
        (
            "rods: 1",
            "rods: 2\n    length: 1 m",
            "track: a track is for one object without a surface",
        ),
        ("850 mm", "895 mm", "which ball blocks before the release"),
        ("850 mm", "950 mm", "ball does not pass above 900.0 mm"),
        ("drop: 900", "surface: {restitution: 0.5}\ndrop: 900", "for one object leave surface out"),
    ],
)
def test_what_makes_no_sense_is_said_at_its_place(old, new, said, call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (PROTOCOLS / "falling-ball.yaml").read_text("utf-8").replace(old, new, 1)
    (tmp_path / "p.yaml").write_text(f"{text}track: {{incline: 5 deg}}\n", "utf-8")
    done = call("check", "p.yaml")
    assert done.code == 2
    assert said in done.err
