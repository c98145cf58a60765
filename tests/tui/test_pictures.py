"""Pictures of the screens: the same session gives the same pictures, and they need no server."""

from __future__ import annotations

import re

from rig.tui.pictures import draw
from tests.cli.lab import rig
from tests.tui.lab import KEYS


def test_the_same_session_gives_the_same_pictures(tmp_path, fence):
    protocol, session = tmp_path / "fence.yaml", tmp_path / "fence.session"
    protocol.write_text(fence.replace("TITLE", "A fence"), "utf-8")
    done = rig("run", protocol, "--port", "sim://", "--session", session, "--yes")
    assert done.returncode == 0, done.stderr
    how = (protocol,), [(80, 24)], ["light"]
    first = draw(session, tmp_path / "one", KEYS, *how)
    assert [path.stem.removesuffix("-80x24-light") for path in first] == [
        "protocol", "device", "run", "live", "result", "session", "history"
    ]  # fmt: skip
    for path, other in zip(first, draw(session, tmp_path / "two", KEYS, *how), strict=True):
        text = path.read_text("utf-8")
        assert text == other.read_text("utf-8"), path.stem
        assert "SIMULATED" in text
        assert "A&#160;fence" in text
        assert not re.search(r"url\(['\"]?http", text)
