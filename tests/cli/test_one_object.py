"""What makes no sense of one object is said at its place; its results are for tests/analysis."""

from tests.cli.lab import PROTOCOLS
from tests.tables import cases


@cases
def test_what_makes_no_sense_is_said_at_its_place(old, new, said, call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (PROTOCOLS / "falling-ball.yaml").read_text("utf-8").replace(old, new, 1)
    (tmp_path / "p.yaml").write_text(f"{text}track: {{incline: 5 deg}}\n", "utf-8")
    assert said in call("check", "p.yaml", code=2).err
