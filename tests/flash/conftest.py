"""An avrdude that only notes how it was called."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

_SCRIPT = """#!{python}
import json, pathlib, sys
folder = pathlib.Path(__file__).parent
(folder / "argv.json").write_text(json.dumps(sys.argv[1:]))
sys.stderr.write((folder / "says").read_text())
sys.exit(int((folder / "code").read_text()))
"""


@dataclass(frozen=True)
class FakeAvrdude:
    """The program, in a folder of its own."""

    path: Path

    def will(self, says, code):
        """Choose how it will end."""
        (self.path.parent / "says").write_text(says)
        (self.path.parent / "code").write_text(str(code))

    @property
    def argv(self):
        """How it was called, or `None`."""
        file = self.path.parent / "argv.json"
        return json.loads(file.read_text()) if file.exists() else None


@pytest.fixture
def avrdude(tmp_path, monkeypatch):
    folder = tmp_path / "programs"
    folder.mkdir()
    path = folder / "avrdude"
    path.write_text(_SCRIPT.format(python=sys.executable))
    path.chmod(0o755)
    monkeypatch.setenv("PATH", str(folder))
    fake = FakeAvrdude(path)
    fake.will("Writing | ######## | 100% 1.92s\n", 0)
    return fake


@pytest.fixture
def flash(call):
    def run(*arguments, board="mega", code=0):
        done = call("flash", "--board", board, *arguments, code=code)
        assert code == 0 or done.out == ""
        return done

    return run
