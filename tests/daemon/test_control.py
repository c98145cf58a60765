"""One client controls, all may stop, and nobody's end leaves anything on."""

import re
import signal
from functools import partial

import pytest

from bench.invariants import broken, longest_on
from bench.process_fixture import ProcessFixture
from rig.errors import ControlError, RigError, StoppedError
from rig.link.client import Device
from rig.link.messages import TABLE, Abort, DropCertificate2, Fire, Phase
from rig.session.store import Session
from tests.cli.lab import frames_of, log_of
from tests.daemon.at_work import ended, working
from tests.refusals import refused
from tests.waiting import PATIENCE_S, until


@pytest.fixture
def armed(driver):
    """Have a client in control that has armed the first run; give it and the token."""
    return driver, driver.arm(1, 1)


def talked(processes, *kinds):
    """Tell which messages of these kinds went over the line, in order."""
    told = [TABLE[frame.type] for _, frame in frames_of(processes.session)]
    return [kind for kind in told if kind in kinds]


def gone_on_with(processes):
    """Let `rig run` finish the session, and look at it as at any other."""
    assert processes.run() == 0, processes.told
    assert broken(processes.session, processes.happened(), processes.runs) == []


def test_two_clients_that_race_for_control_do_not_both_get_it(processes, client):
    one, two = client("one"), client("two")
    one.take_control()
    refused(ControlError, "one has control", two.take_control)
    for forbidden in (
        lambda: two.open_session(str(processes.protocol), str(processes.session)),
        lambda: two.arm(1, 1),
        lambda: two.wait(0.1),
    ):
        refused(ControlError, "", forbidden)
    processes.start_runner()
    _, told = processes.runner.communicate(timeout=PATIENCE_S)
    assert processes.runner.returncode == 4
    assert "one has control" in told
    assert not processes.session.exists()
    one.close()
    two.take_control()


def test_a_client_that_hangs_while_armed_disarms(processes, armed):
    """It is connected, and says nothing any more. Until then the daemon keeps the board armed."""
    processes.await_phase(Phase.ARMED)
    processes.await_phase(Phase.IDLE)
    until(lambda: log_of(processes.session)[1][-1] == (1, "interrupted"))
    with Session.open(processes.session, readonly=True) as session:
        (reason,) = session.latest_state(1).reasons
    assert (reason.code, reason.values["client"]) == ("client_silent", "the driver")
    silent = r"nothing was heard from the driver for \d\.\d s, so it lost control"
    assert re.fullmatch(silent, reason.text)
    one, token = armed
    refused(StoppedError, reason.text, one.fire, token)


def test_any_client_stops_a_recording_and_what_there_is_is_kept(processes, armed, client):
    one, token = armed
    two = client("two")
    one.fire(token)
    two.stop("enough")
    processes.await_phase(Phase.HOLDING)
    until(
        lambda: log_of(processes.session)[1][-1] == (1, "recorded")
    )  # the daemon has it a little later
    one.close()
    refused(RigError, "no session is open", getattr, one, "session")
    gone_on_with(processes)
    seen = talked(processes, Fire, Abort, DropCertificate2)
    assert seen.index(Fire) < seen.index(Abort) < seen.index(DropCertificate2)


@pytest.fixture
def unheard(monkeypatch):
    """Have a board and a worker that, unless stopped, repeats a request for ever."""
    monkeypatch.setattr("rig.recorder.recorder.Device", partial(Device, tries=10**9))
    with ProcessFixture(runs=2, seed=3) as processes, working(processes) as (worker, ask):
        token = ask(lambda controller: controller.arm(1, 1))
        yield processes, worker, token
        processes.hand("mute 0")  # else a worker that no STOP reaches never ends


def line(worker):
    return worker.controller.recorder.device.statistics()


def test_a_stop_after_a_release_that_was_not_answered_keeps_what_fell(unheard):
    processes, worker, token = unheard
    processes.hand("mute fall")
    fired = worker.submit(lambda controller: controller.fire(token), "me")
    until(lambda: line(worker)["repeats"])
    processes.await_phase(Phase.RECORDING)
    worker.stop("no answer")
    processes.await_phase(Phase.HOLDING)
    refused(StoppedError, "", fired.result, PATIENCE_S)
    processes.await_phase(Phase.IDLE)
    until(lambda: log_of(processes.session)[1][-1] == (1, "recorded"))
    assert log_of(processes.session) == {1: [(1, "armed"), (1, "fired"), (1, "recorded")]}
    seen = talked(processes, Fire, Abort, DropCertificate2)
    assert seen.index(Abort) < seen.index(DropCertificate2)


def test_a_stop_ends_a_wait(driver, client):
    two, waiting = client("two"), driver.line.ask("wait", seconds=600)
    while not waiting.done():  # a stop may overtake even the request for the wait
        two.stop("no need")
    refused(StoppedError, "no need", waiting.result)
    assert driver.arm(1, 1)


def test_a_daemon_that_is_asked_to_end_in_the_fall_records_it(processes, armed):
    one, token = armed
    one.fire(token)
    processes.daemon.send_signal(signal.SIGINT)
    ended(processes)
    assert log_of(processes.session)[1][-1] == (1, "recorded")
    assert not processes.socket.exists()
    processes.start_daemon()
    gone_on_with(processes)
    assert longest_on(processes.happened()) <= 0.08
