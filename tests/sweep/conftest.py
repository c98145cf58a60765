"""``rig sweep`` called inside this process, and a scene whose grid shows every kind of note."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from rig.cli import main
from tests.tables import protocol_text

SCENE = protocol_text("few-rods")
VARY = ("restitution=-1..1:5", "inertia=0.00025..0.05:6", "friction=0..1:6")
"""With the scene's inclines: points on the pile, not sliding, with α above ½ and without one."""


class Done(NamedTuple):
    """How a call ended."""

    code: int
    err: str


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE, "utf-8")
    return path


@pytest.fixture
def sweep(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """Sweep the scene (or another) into a file of the temporary folder."""

    def call(output: str, *vary: str, protocol: Path = scene, more: tuple[str, ...] = ()) -> Done:
        arguments = [str(protocol), "-o", str(tmp_path / output), *more]
        arguments += [part for text in vary for part in ("--vary", text)]
        code = main(["sweep", *arguments])
        out, err = capsys.readouterr()
        assert out == ""
        return Done(code, err)

    return call
