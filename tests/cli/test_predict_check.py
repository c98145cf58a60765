"""``rig predict`` and ``rig check``: what follows from a protocol alone, before anything hangs."""

import pytest

from rig.design.trials import Trials
from tests.cli.lab import PROTOCOLS, short
from tests.tables import cases


@pytest.fixture
def untried(monkeypatch):
    """Let no trial drops fall, which take long: a story does."""
    monkeypatch.setattr("rig.design.trials.trials", lambda _: Trials(20, 20))


@pytest.mark.usefixtures("untried")
@pytest.mark.parametrize("protocol", sorted(PROTOCOLS.glob("*.yaml")), ids=lambda path: path.stem)
def test_check_says_what_is_there_and_what_was_left_out(call, protocol):
    """And README, which boards can do it."""
    done = call("check", protocol)
    assert done.err == ""
    title, blank, scene, *rest = done.out.splitlines()
    assert f"title: {title}" in protocol.read_text("utf-8")
    assert (blank, scene) == ("", "Scene")
    text = protocol.read_text("utf-8")
    assert ("\nGates\n" in done.out) == ("\ngates:" in text)
    if "\ngates:" not in text:
        assert "  no gates: prediction only, nothing is measured" in rest
    if "\nsurface:" not in text:
        assert any(line.startswith("  no surface:") for line in rest)
    assert f"`{protocol.stem}`" in (PROTOCOLS.parent / "README.md").read_text("utf-8")
    small = protocol.with_name(f"{protocol.stem}-uno.yaml").exists()  # what an Uno needs instead
    boards = "pico, mega" if small else "pico, mega, uno"
    able = [line.partition(": ")[2] for line in rest if line.startswith("  suitable boards")]
    assert able == ([boards] if "\ngates:" in text else [])


@cases
def test_a_board_that_lacks_something_is_refused_before_anything_is_hung(
    call, tmp_path, old, new, problem
):
    """That `rig check` says so of boards by name is for tests/protocol."""
    path, session = tmp_path / "p.yaml", tmp_path / "p.session"
    path.write_text(short(repeats=1).replace(old, new), "utf-8")
    done = call("run", path, "--port", "sim://", "--session", session, code=2)
    assert done.out == ""
    (line,) = done.err.splitlines()
    assert f"{path}:{problem} the board (virtual) has" in line
    assert not session.exists()
