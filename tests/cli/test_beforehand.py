"""What a protocol's drops need is known before the first: how long to record, and which board."""

import json

import pytest

from rig.protocol.describe import describe
from rig.protocol.reader import read
from tests.cli.lab import short

GATES = """\
gates:
  impact: [{channel: 0, height: 25 mm}, {channel: 1, height: 80 mm}, {channel: 2, height: TOP}]
  free: [{channel: 8, height: 20 mm}, {channel: 9, height: 140 mm}, {channel: 10, height: TOP}]
"""


def changed(old: str, new: str, top: str = "") -> str:
    """Write a protocol of two drops, changed in one place; with a gate below the hanging chains."""
    text = short(repeats=1).replace(old, new)
    if top:
        begin, end = text.index("gates:"), text.index("  height_uncertainty")
        text = text[:begin] + GATES.replace("TOP", top) + text[end:]
    return text


@pytest.mark.parametrize(
    ("old", "new", "top", "lasts"),
    [
        ("drop: 180 mm ± 2 mm", "drop: 12 m ± 5 mm", "11.9 m", "2.808 s"),
        ("gravity: 9.81 m/s^2", "gravity: 1 m/s^2", "100 mm", "2.805 s"),
    ],
)
def test_a_long_fall_is_recorded_to_its_end(call, tmp_path, old, new, top, lasts):
    path, session = tmp_path / "long.yaml", tmp_path / "long.session"
    # Where chains fall slowly, edges tell less of when they were let go.
    text = changed(old, new, top).replace("release_skew: 5 ms", "release_skew: 20 ms")
    path.write_text(text, "utf-8")
    done = call("run", path, "--port", "sim://", "--session", session, "--yes", "--json")
    assert done.code == 0, done.err
    runs = json.loads(done.out)["runs"]
    assert [run["verdict"] for run in runs] == ["accepted", "accepted"]
    assert f"recording: {lasts};" in describe(read(path))


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("channel: 0, pulse", "channel: 5, pulse", "32:20: release.channel: found 5;"),
        ("pulse: 80 ms", "pulse: 800 ms", "32:30: release.pulse: found 800 ms;"),
    ],
)
def test_a_board_that_lacks_something_is_refused_before_anything_is_hung(
    call, tmp_path, old, new, problem
):
    path, session = tmp_path / "p.yaml", tmp_path / "p.session"
    path.write_text(changed(old, new), "utf-8")
    done = call("run", path, "--port", "sim://", "--session", session)
    assert (done.code, done.out) == (2, "")
    (line,) = done.err.splitlines()
    assert f"{path}:{problem} the board (virtual) has" in line
    assert not session.exists()
    said = describe(read(path))
    for word in ("mega", "uno"):
        assert f"note: board {word} is not suitable: {path}:" in said
