"""Kills, pulls, resets and set clocks; ./run bench faults does it hundreds of times."""

import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from bench.faults import NOISE, OFF_S, disturbed
from bench.invariants import broken
from bench.process_fixture import ProcessFixture
from rig.errors import SessionError
from rig.link.messages import Phase
from rig.replay import replay
from rig.session.schema import RunState
from rig.session.store import Session


def test_nothing_is_lost_when_a_daemon_is_killed_or_bytes_are():
    """Of the others: tests/daemon/test_state_space.py, test_control.py, and a full disk below."""
    with ThreadPoolExecutor(2) as pool:
        noise = pool.submit(disturbed, "daemon", 0, 5, runs=1, dials=NOISE)
        made = pool.submit(disturbed, "daemon", 1, 7, runs=1)
        for tally in (noise.result(), made.result()):
            assert tally.broken == []
            assert tally.longest_on_s <= OFF_S
        assert sum(made.result().fell_upon.values()) == 1
        assert noise.result().bad_frames > 0


def test_a_full_disk_leaves_the_drop_in_the_device_until_there_is_room(processes, driver):
    driver.fire(driver.arm(1, 1))
    processes.fill_disk()
    with pytest.raises(SessionError):
        driver.collect(1, 1)
    state = driver.call("subscribe")["state"]
    assert state["phase"] == "trouble"
    assert state["error"]["kind"] == "SessionError"
    processes.await_phase(Phase.HOLDING)
    assert list(processes.happened())[-1]["phase"] == Phase.HOLDING
    with Session.open(processes.session, readonly=True) as session:
        assert session.drop(1, 1) is None, "it is readable, and does not claim to have the drop"
    processes.free_disk()
    processes.await_phase(Phase.IDLE)  # by itself, as soon as there is room
    assert driver.collect(1, 1).faults == ()
    driver.close()
    assert processes.run() == 0, processes.told
    assert broken(processes.session, processes.happened(), processes.runs) == []


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
