"""Where Python has no fcntl, termios, pwd, resource or Unix sockets, as on Windows.

Pyserial, platformdirs and Textual are loaded before: they have branches of their own for Windows.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.programs import run_program
from tests.tables import read_table

ROOT = Path(__file__).parents[1]
BARE = """
import asyncio, concurrent.futures.process, multiprocessing.popen_spawn_posix, multiprocessing.util
import os, signal, socket, subprocess, sys, tempfile, warnings
import platformdirs.unix, serial, serial.tools.list_ports, textual.app
import textual.drivers.linux_driver

for name in ("fcntl", "termios", "pwd", "grp", "resource", "tty", "pty"):
    sys.modules[name] = None
for module, names in {
    socket: ("AF_UNIX", "SO_PEERCRED", "socketpair", "send_fds"),
    os: ("fork", "forkpty", "getuid", "geteuid", "getgid", "pread", "pwrite", "O_CLOEXEC",
         "O_NONBLOCK", "set_blocking", "sched_getaffinity", "sched_setaffinity", "mkfifo"),
    signal: ("pthread_sigmask", "SIGALRM", "SIGUSR1", "SIGHUP"),
}.items():
    for name in names:
        vars(module).pop(name, None)
warnings.filterwarnings("ignore", "only soft file lock")
import rig.cli
codes = [rig.cli.main(line.split()) for line in sys.argv[1:]]
if len(codes) > 1 and any(codes):
    print(*codes)
sys.exit(max(codes))
"""


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """Run commands in a folder of its own, in a Python that lacks what Windows lacks."""
    folder = tmp_path_factory.mktemp("bare")
    environment = os.environ | {"PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(folder / "cache")}

    def call(*lines, code=0):
        done = run_program(
            sys.executable, "-c", BARE, *lines, code=None, cwd=folder, env=environment
        )
        assert "Traceback" not in done.stderr
        assert "internal error" not in done.stderr
        assert done.returncode == code, done.stderr
        return done

    call.folder = folder
    text = (ROOT / "protocols/single-chain.yaml").read_text("utf-8")
    (folder / "chains.yaml").write_text(re.sub(r"repeats: \d+", "repeats: 2", text), "utf-8")
    call("run chains --port sim:// --seed 3 --session chains.session --yes")
    return call


def test_results_are_the_same_as_anywhere(bare, call, monkeypatch):
    done = bare(
        "run chains --port sim:// --seed 2 --session my.session --yes",
        "compare chains.session my.session",
        "analyze my.session --json --fresh",
    )
    assert not (bare.folder / "my.session.lock").exists()
    here = json.loads(done.stdout[done.stdout.index("{") :])
    monkeypatch.chdir(bare.folder)
    assert here == call("analyze", "my.session", "--json", "--fresh").json


def test_commands_work(bare):
    """One after the other in one process, as none leaves anything behind in it."""
    bare(*read_table(__file__, "commands_without_unix"))


def test_one_writer_at_a_time(bare):
    lock = bare.folder / "chains.session.lock"
    program = f"from filelock import SoftFileLock as Lock; lock = Lock({str(lock)!r}); "
    program += "lock.acquire(); print(flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as holder:
        holder.stdout.readline()
        done = bare("notes chains.session --run 1 calm", code=2)
        holder.communicate(b"\n")
    assert f"is being written by process {holder.pid}" in done.stderr


def test_what_cannot_work_says_so(bare):
    lines = (
        "daemon --port sim://",
        "tui falling-ball --port sim://",
        "run falling-ball --port sim:// --session x.session --name left",
    )
    done = bare(*lines, code=2)
    said = "this computer has no Unix sockets, so no daemon runs here\n"
    assert done.stdout == "2 2 2\n"
    assert done.stderr.startswith(said)
    assert done.stderr.count(said) == len(lines)
