"""Work on several processors: the same results in the same order, and an end that is one."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest

from rig.analysis import processes
from rig.analysis.session import analyze
from tests.analysis.drops import FENCE, case
from tests.analysis.sessions import MILD
from tests.cli.lab import ROOT
from tests.waiting import PATIENCE_S

ENDLESS = """
import sys, time
from rig.analysis.processes import do_in_order

def work(number):
    print("begun", flush=True)
    time.sleep(0.1 if number < 4 else 600.0)

if __name__ == "__main__":
    try:
        list(do_in_order(work, range(50), 50, 2))
    except KeyboardInterrupt:
        sys.exit(130)
"""


@pytest.fixture
def eager(monkeypatch):
    """Other processes are worth it for any work."""
    monkeypatch.setattr(processes, "_WORTH_S", -1.0)


def halve(number):
    return os.getpid(), 6 // number


def test_results_come_in_order_from_other_processes(eager):
    numbers = [6, 3, 2, 1, 6, 3, 2, 1, 3]
    taken = [*processes.do_in_order(halve, numbers, 9, 2)]
    assert [(number, half) for number, (_, half) in taken] == [(n, 6 // n) for n in numbers]
    here = [process == os.getpid() for _, (process, _) in taken]
    assert here == [True] * 4 + [False] * 5


def test_what_fails_in_another_process_fails_here(eager):
    with pytest.raises(ZeroDivisionError):
        list(processes.do_in_order(halve, [1, 1, 1, 1, 1, 0, 1], 7, 2))
    assert not multiprocessing.active_children()


def test_who_takes_no_more_results_leaves_no_processes_behind(eager):
    results = processes.do_in_order(halve, [1] * 99, 99, 2)
    assert [next(results) for _ in range(6)]
    results.close()
    assert not multiprocessing.active_children()


def test_a_session_says_the_same_by_however_many_processors(eager):
    drops = [case(FENCE, MILD, run=run) for run in range(1, 9)]
    said = [
        analyze(FENCE, [one.drop for one in drops], lambda _: drops[0].scale, processes=n).json()
        for n in (1, 2)
    ]
    assert said[0] == said[1]


@pytest.mark.skipif(os.name != "posix", reason="groups of processes")
@pytest.mark.parametrize("killed", [False, True], ids=["ctrl-c", "killed"])
def test_with_the_first_process_all_others_end_at_once(killed, tmp_path):
    script = tmp_path / "endless.py"
    script.write_text(ENDLESS)
    command = [sys.executable, str(script)]
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    options["env"] = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, **options, text=True, start_new_session=True) as process:
        for _ in range(6):  # four here, and one in each of two processes
            assert process.stdout.readline() == "begun\n"
        began = time.monotonic()
        if killed:
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGINT)
        _, stderr = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == (-signal.SIGKILL if killed else 130)
    assert killed or not stderr  # Python tells of the semaphores that are left
    assert time.monotonic() - began < 0.5 * PATIENCE_S
    while time.monotonic() - began < PATIENCE_S and _is_there(process.pid):
        time.sleep(0.01)  # what is killed is not gone at once
    assert not _is_there(process.pid)


def _is_there(group):
    with suppress(ProcessLookupError):
        os.killpg(group, 0)
        return True
    return False
