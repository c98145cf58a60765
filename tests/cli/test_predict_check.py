"""``rig predict`` and ``rig check``: what follows from a protocol alone, before anything hangs."""

import pytest

from rig.design.trials import Trials
from rig.protocol.describe import describe
from rig.protocol.reader import read
from tests.cli.lab import PROTOCOLS, short
from tests.tables import cases

UNIFORM = PROTOCOLS / "inclined-uniform.yaml"


@pytest.fixture
def predicted(call):
    """Give what is predicted of a protocol."""
    return lambda path: call("predict", path, "--json").json["predictions"]


def test_the_table_says_the_same(call, predicted):
    """In other units, and with U of 95 % for u."""
    lines = predicted(UNIFORM)
    heading, _, *rows = call("predict", UNIFORM).out.splitlines()
    assert "Δz ± U (cm)" in heading
    assert max(map(len, (heading, *rows))) <= 80
    for line, row in zip(lines, rows[: len(lines)], strict=True):
        incline, alpha, separation, expanded = map(float, row.replace("±", "").split()[:4])
        assert (incline, alpha) == (line["incline_deg"], pytest.approx(line["alpha"], abs=5e-5))
        assert separation == pytest.approx(100.0 * line["separation_m"], abs=0.05)
        assert expanded == pytest.approx(196.0 * line["separation_u_m"], rel=0.06)


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
    path, session = tmp_path / "p.yaml", tmp_path / "p.session"
    path.write_text(short(repeats=1).replace(old, new), "utf-8")
    done = call("run", path, "--port", "sim://", "--session", session, code=2)
    assert done.out == ""
    (line,) = done.err.splitlines()
    assert f"{path}:{problem} the board (virtual) has" in line
    assert not session.exists()
    said = describe(read(path))
    for word in ("mega", "uno"):
        assert f"note: board {word} is not suitable: {path}:" in said
