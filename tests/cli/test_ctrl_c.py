"""Ctrl-C while a command loads and as it ends: 130, and no traceback."""

import asyncio
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from textual.app import App

from bench.mutants import CSV, make_session
from rig import cli
from rig.commands import demo, tui
from tests.programs import run_program
from tests.refusals import refused
from tests.tables import read_table

STRUCK = "import os, signal; os.kill(os.getpid(), signal.SIGINT)"
BEFORE = f"""
import sys
sys.modules.pop("signal", None)
class Finder:
    def find_spec(name, *_):
        if not name.startswith("rig"):
            {STRUCK}
sys.meta_path.insert(0, Finder)
import rig.__main__
"""
ENDING = f"""
import atexit, rig.cli, rig.__main__
def struck():
    {STRUCK}
atexit.register(struck)
rig.cli.main = lambda: 0
rig.__main__.start()
"""


@pytest.mark.parametrize(("program", "code"), [(BEFORE, 130), (ENDING, 0)])
def test_ctrl_c_where_no_command_is_at_work(program, code, unread):
    command = [sys.executable, "-c", program]
    assert "Traceback" not in run_program(*command, code=code).stderr
    assert subprocess.run(command, stderr=unread, check=False).returncode == code


def test_ctrl_c_in_a_class_that_is_being_made(monkeypatch, capsys):
    def loaded(_name):
        raise RuntimeError("Error calling __set_name__") from KeyboardInterrupt()

    monkeypatch.setattr(cli, "import_module", loaded)
    assert cli.main(["check", "x"]) == cli.INTERRUPTED
    assert "interrupted" in capsys.readouterr().err


@pytest.mark.parametrize("number", [2, 15])  # SIGINT, SIGTERM
def test_a_signal_while_the_terminal_is_at_work(number):
    class Headless(App):
        async def run_async(self):
            return await super().run_async(headless=True)

        def on_mount(self):
            signal.raise_signal(number)

    refused(KeyboardInterrupt, "", lambda: asyncio.run(tui._show(Headless())))


def test_a_demo_that_was_interrupted_says_what_goes_on_with_it(call, tmp_path, monkeypatch):
    asked = []

    def interrupted(protocol, _url, session, _operator, seed):
        asked.append((protocol, Path(protocol).read_text("utf-8"), session, seed))
        raise KeyboardInterrupt

    monkeypatch.setattr(demo, "run_protocol", interrupted)
    monkeypatch.chdir(tmp_path)
    said = call("demo", "--repeats", 3, "--seed", 7, code=130)
    words = re.search(r"rig: interrupted; \S*rig (demo .*) continues it", said.err)
    call(*shlex.split(words[1]), code=130)
    assert asked[0] == asked[1]


MOMENTS = 40
COMMANDS = read_table(__file__, "commands")["interrupted"]


# Before that it is Python itself that is interrupted, and nobody there to end it in another way.
BEGUN = "import rig.__main__; print('begun', flush=True); rig.__main__.start()"


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_ctrl_c_at_any_moment_of_a_command(command, tmp_path):
    session = make_session(tmp_path)
    (tmp_path / "edges.csv").write_text(CSV)
    (tmp_path / "avrdude").write_text("#!/bin/sh\nexec sleep 1\n")
    (tmp_path / "avrdude").chmod(0o755)
    near, far = os.openpty()  # nobody answers there
    words = {"SESSION": str(session), "PORT": os.ttyname(far)}
    given = [words.get(one, one) for one in COMMANDS[command].split()]

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
        for made in tmp_path.glob("[inr]*"):  # imported, new, ran, recovered
            made.unlink()
        shutil.rmtree(tmp_path / "demo", ignore_errors=True)
        return time.monotonic() - began, process.returncode, told

    longest_s, usual, _ = ended(None)
    found = []
    for moment in range(1, MOMENTS + 1):
        _, code, told = ended(longest_s * moment / MOMENTS)
        if code not in {130, usual} or "Traceback" in told:
            found.append((moment, code, told[-500:]))
    os.close(near)
    os.close(far)
    assert found == []
