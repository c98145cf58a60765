"""Ctrl-C while a command loads and as it ends: 130, and no traceback."""

from __future__ import annotations

import subprocess
import sys

import pytest

from rig import cli

STRUCK = "import os, signal; os.kill(os.getpid(), signal.SIGINT)"
LOADING = f"""
import rig.cli, rig.__main__
def load(name):
    {STRUCK}
rig.cli.import_module = load
rig.__main__.sys.argv[1:] = ["check", "x"]
rig.__main__.start()
"""
ENDING = f"""
import atexit, rig.cli, rig.__main__
def struck():
    {STRUCK}
atexit.register(struck)
rig.cli.main = lambda: 0
rig.__main__.start()
"""


@pytest.mark.parametrize(("program", "code"), [(LOADING, 130), (ENDING, 0)])
def test_ctrl_c_where_no_command_is_at_work(program, code):
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert done.returncode == code
    assert "Traceback" not in done.stderr


def test_ctrl_c_in_a_class_that_is_being_made(monkeypatch, capsys):
    def loaded(_name):
        raise RuntimeError("Error calling __set_name__") from KeyboardInterrupt()

    monkeypatch.setattr(cli, "import_module", loaded)
    assert cli.main(["check", "x"]) == cli.INTERRUPTED
    assert "interrupted" in capsys.readouterr().err
