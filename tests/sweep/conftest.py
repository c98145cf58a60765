"""``rig sweep`` called inside this process, and a scene whose grid shows every kind of note."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.programs import Done
from tests.tables import protocol_text

SCENE = protocol_text("few-rods")
VARY = ("restitution=-1..1:5", "inertia=0.00025..0.05:6", "friction=0..1:6")
"""With the scene's inclines: points on the pile, not sliding, with α above ½ and without one."""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE, "utf-8")
    return path


@pytest.fixture
def sweep(scene: Path, tmp_path: Path, call: Callable[..., Done]) -> Callable[..., str]:
    """Sweep the scene into a file of the temporary folder; give what is said of that."""

    def run(output: str, *vary: str, more: tuple[str, ...] = (), code: int = 0) -> str:
        varied = [part for text in vary for part in ("--vary", text)]
        done = call("sweep", scene, "-o", tmp_path / output, *more, *varied, code=code)
        assert done.out == ""
        return done.err

    return run
