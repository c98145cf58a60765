"""One client controls, all may stop, and nobody's end leaves anything on."""

import signal

import pytest

from bench.invariants import broken, longest_on
from rig.errors import ControlError, StoppedError
from rig.link.messages import Phase
from tests.cli.lab import log_of
from tests.daemon.at_work import ended
from tests.refusals import refused
from tests.waiting import PATIENCE_S, until


@pytest.fixture
def armed(driver):
    """Have a client in control that has armed the first run; give it and the token."""
    return driver, driver.arm(1, 1)


def test_two_clients_that_race_for_control_do_not_both_get_it(processes, client):
    one, two = client("one"), client("two")
    one.take_control()
    refused(ControlError, "one has control", two.take_control)
    refused(ControlError, "", two.arm, 1, 1)
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
    one, token = armed
    refused(StoppedError, "nothing was heard from the driver for", one.fire, token)


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
    assert processes.run() == 0, processes.told
    assert broken(processes.session, processes.happened(), processes.runs) == []
    assert longest_on(processes.happened()) <= 0.08
