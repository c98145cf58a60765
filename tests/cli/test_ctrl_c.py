"""Ctrl-C while a command loads and as it ends: 130, and no traceback."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

from bench.mutants import CSV, make_session
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


MOMENTS = 40
COMMANDS = {
    "analyze": ["SESSION"],
    "check": ["fence.yaml"],
    "doctor": [],
    "estimate": ["SESSION"],
    "export": ["SESSION", "--csv", "tables"],
    "import": ["edges.csv", "--protocol", "fence.yaml", "--session", "imported"],
    "predict": ["fence.yaml"],
    "recover": ["SESSION", "-o", "recovered"],
    "replay": ["SESSION"],
    "report": ["SESSION", "-o", "report.html"],
    "run": ["fence.yaml", "--port", "sim://", "--session", "ran", "--yes"],
}


# Before that it is Python itself that is interrupted, and nobody there to end it in another way.
BEGUN = "import rig.__main__; print('begun', flush=True); rig.__main__.start()"


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_ctrl_c_at_any_moment_of_a_command(command, tmp_path):
    session = make_session(tmp_path)
    (tmp_path / "edges.csv").write_text(CSV)
    given = [str(session) if one == "SESSION" else one for one in COMMANDS[command]]

    def ended(after_s):
        """Strike so long after the program took over; the time it had, and how it ended."""
        process = subprocess.Popen(
            [sys.executable, "-c", BEGUN, command, *given],
            cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert process.stdout.readline() == "begun\n"
        began = time.monotonic()
        if after_s is not None:
            time.sleep(after_s)
            process.send_signal(signal.SIGINT)
        _, told = process.communicate()
        for one in ("imported", "recovered", "ran"):
            (tmp_path / one).unlink(missing_ok=True)
        return time.monotonic() - began, process.returncode, told

    longest_s, usual, _ = ended(None)
    found = []
    for moment in range(1, MOMENTS + 1):
        _, code, told = ended(longest_s * moment / MOMENTS)
        if code not in {130, usual} or "Traceback" in told:
            found.append((moment, code, told[-500:]))
    assert found == []
