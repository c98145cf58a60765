"""An avrdude that only notes how it was called."""

import shlex
from types import SimpleNamespace

import pytest


@pytest.fixture
def avrdude(tmp_path, monkeypatch):
    """Have it as the only program there is; it says and ends as it `will`."""
    path, noted = tmp_path / "programs" / "avrdude", tmp_path / "programs" / "noted"
    path.parent.mkdir()
    monkeypatch.setenv("PATH", str(path.parent))

    def will(says, code):
        note = f"printf '%s\\n' \"$@\" > {noted}"
        path.write_text(f"#!/bin/sh\n{note}\nprintf %s {shlex.quote(says)} >&2\nexit {code}\n")
        path.chmod(0o755)

    will("Writing | ######## | 100% 1.92s\n", 0)
    return SimpleNamespace(path=path, noted=noted, will=will)


@pytest.fixture
def flash(call):
    def run(*arguments, board="mega", code=0):
        done = call("flash", "--board", board, *arguments, code=code)
        assert code == 0 or done.out == ""
        return done

    return run
