"""What a protocol's drops need is known before the first: which board."""

from rig.protocol.describe import describe
from rig.protocol.reader import read
from tests.cli.lab import short
from tests.tables import cases


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
