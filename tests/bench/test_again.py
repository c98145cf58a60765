"""``./run bench again``: which run failed and what it said, and no busy loop is left behind."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.waiting import PATIENCE_S

RUN = Path(__file__).parents[2] / "run"


def _again(folder: Path, runs: object, tests: str) -> tuple[int, str]:
    """Run the function that is in ``run`` over tests that are a line of shell."""
    lines = re.findall(
        r"^(?:(?:say|die)\(\).*|again\(\) \((?:\n.*)*?\n\))$", RUN.read_text(), re.MULTILINE
    )
    assert len(lines) == 3
    (folder / "python").symlink_to(sys.executable)
    (folder / "run").write_text(f"#!/bin/sh\n{tests}\n")
    (folder / "run").chmod(0o755)
    script = "\n".join(["set -euo pipefail", "bin=.", *lines, f"again {runs}", "say whole"])
    with subprocess.Popen(
        ["bash", "-c", script],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            # A loop that stays holds the pipe open.
            told = process.communicate(timeout=PATIENCE_S)[0]
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            raise
    return process.returncode, told


def test_the_second_half_has_busy_loops_and_nothing_stays(tmp_path):
    code, told = _again(tmp_path, 4, "exit 0")
    assert code == 0
    assert [line.split(", ")[1] for line in told.splitlines()[:4]] == [
        f"{loops} busy loops beside it" for loops in (0, 0, 2, 2)
    ]
    assert told.endswith("run: whole\n")


@pytest.mark.parametrize("run", [1, 3])
def test_the_first_that_fails_is_told_with_what_it_said(tmp_path, run):
    code, told = _again(tmp_path, 4, f"echo >> n; echo its words; test $(wc -l < n) -ne {run}")
    assert code == 1
    assert f"its words\nrun: run {run} of 4 failed" in told
    assert told.count("its words") == 1


@pytest.mark.parametrize("runs", ["x", 0, -1])
def test_what_is_no_number_of_runs_is_refused(tmp_path, runs):
    code, told = _again(tmp_path, runs, "exit 0")
    assert code == 2
    assert f"found {runs}, where a number of runs is wanted" in told
    assert "whole" not in told
