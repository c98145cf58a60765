"""Kills, pulls, resets and set clocks; ./run bench faults does it hundreds of times."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from bench.invariants import broken
from bench.process_fixture import ProcessFixture
from rig.link.messages import Phase
from rig.replay import replay
from rig.session.schema import RunState
from rig.session.store import Session

HOUR_S = 3600
SET_S = [5 * HOUR_S, -7 * HOUR_S, 0, -30 * 24 * HOUR_S]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux" or not shutil.which("gcc"), reason="no gcc on Linux")
def test_a_wall_clock_that_is_set_while_chains_fall_changes_no_time(tmp_path, monkeypatch):
    clock, ahead = tmp_path / "clock.so", tmp_path / "ahead"
    source = Path(__file__).with_name("wall_clock.c")
    subprocess.run(["gcc", "-shared", "-fPIC", "-Wall", "-o", clock, source], check=True)
    ahead.write_text("0")
    monkeypatch.setenv("WALL_CLOCK_AHEAD", str(ahead))
    runs = len(SET_S) + 1
    with ProcessFixture(runs) as processes:
        with monkeypatch.context() as patch:
            patch.setenv("LD_PRELOAD", str(clock))
            processes.start_daemon()
            processes.start_runner()
        for number, seconds in enumerate(SET_S, 1):
            processes.await_phase(Phase.RECORDING, number)
            new = tmp_path / "new"
            new.write_text(str(seconds))
            new.replace(ahead)
        assert processes.waited() == 0, processes.told
        assert broken(processes.session, processes.happened(), runs) == []
        with Session.open(processes.session, readonly=True) as session:
            stepped = [round(one.stepped_ns * 1e-9) for one in session.host_breaks()]
            assert sum(stepped) == SET_S[-1], "two that come close together are seen as one"
            assert not any(one.slept_ns for one in session.host_breaks())
            assert {session.latest_state(n).state for n in range(1, runs + 1)} == {
                RunState.ACCEPTED
            }
            assert replay(session).differences == ()
