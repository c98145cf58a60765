"""Workers of a bench: results in order, and none left when the bench is stopped."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bench.workers import results
from tests.waiting import PATIENCE_S, until

STOPPED = """
import sys
from bench.workers import results
from tests.bench.test_workers import sleep_beside

if __name__ == "__main__":
    for _ in results([(sleep_beside, sys.argv[1])] * 2, 2):
        pass
"""


def sleep_beside(folder: str) -> None:
    """Start a process as a simulation is started, and wait for it."""
    with subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"]) as beside:
        for pid in (os.getpid(), beside.pid):
            Path(folder, str(pid)).touch()


def test_results_come_in_the_order_of_the_calls():
    assert [*results([(time.sleep, 0.2), (abs, -1), (max, 2, 3)], 2)] == [None, 1, 3]


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="looks at /proc")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_nothing_runs_on_after_the_bench_is_stopped(number, tmp_path):
    script = tmp_path / "stopped.py"
    script.write_text(STOPPED)
    folder = tmp_path / "pids"
    folder.mkdir()
    with subprocess.Popen(
        [sys.executable, script, folder],
        env=os.environ | {"PYTHONPATH": str(Path.cwd())}, stderr=subprocess.DEVNULL,
    ) as bench:  # fmt: skip
        until(lambda: len([*folder.iterdir()]) == 4)
        bench.send_signal(number)
        assert bench.wait(PATIENCE_S) != 0
    until(lambda: not any(alive(int(pid.name)) for pid in folder.iterdir()))
