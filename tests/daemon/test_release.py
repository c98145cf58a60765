"""The release tried with nothing hung: really driven, stopped like a drop, and no run of a plan."""

import threading

from rig.errors import ControlError, InputError, StoppedError
from rig.link.messages import Phase, RefusalReason
from rig.link.refusals import DeviceRefusedError
from rig.replay import replay
from rig.session.schema import RunState
from rig.session.store import Session
from tests.refusals import refused
from tests.waiting import until


def section(client):
    return client.call("subscribe")["state"]["release_test"]


def driven(processes):
    """When the release went on and off: not yet at the first time, and by the second, s."""
    changes, on = [], False
    for one in processes.happened():
        if "outputs" in one and bool(one["outputs"] & 1) != on:
            on = not on
            changes.append((one["after_s"], one["at_s"]))
    return changes


def armed(driver):
    """Arm as soon as the release has rested three times as long as it was on."""
    try:
        return driver.arm(1, 1)
    except DeviceRefusedError as error:
        if error.reason is not RefusalReason.COOLING:
            raise
        return 0


def test_it_is_driven_for_the_protocols_pulse_and_is_no_run(processes, driver):
    found = driver.call("test_release")
    assert found == section(driver)
    assert (found["pulse_s"], found["edges"], found["faults"]) == (0.08, 0, [])
    on, off = driven(processes)
    assert off[0] - on[1] < 0.08 < off[1] - on[0]
    assert driver.call("subscribe")["state"]["phase"] == "idle"
    token = driver.arm(1, 1)
    driver.fire(token)
    driver.collect(1, 1)
    driver.close_session()
    assert section(driver) == found
    with Session.open(processes.session, readonly=True) as session:
        assert [(drop.run, drop.attempt) for drop in session.drops()] == [(1, 1)]
        assert {entry.run for entry in session.states()} == {1}
        assert "DIFFERENT" not in replay(session).lines[0]


def test_it_needs_control_a_session_nothing_armed_and_a_closed_emergency_stop(processes, client):
    one, other = client("one"), client("other")
    one.take_control()
    refused(InputError, "not the moment", one.call, "test_release")
    one.open_session(str(processes.protocol), str(processes.session))
    refused(ControlError, "", other.call, "test_release")
    one.arm(1, 1)
    refused(InputError, "not the moment", one.call, "test_release")
    processes.hand("stop 1")
    until(lambda: one.session.latest_state(1).state is RunState.INTERRUPTED)
    error = refused(DeviceRefusedError, "", one.call, "test_release")
    assert error.reason is RefusalReason.STOPPED
    assert not driven(processes)


def test_stop_ends_it(processes, driver, client):
    watcher, raised = client("a watcher"), []

    def test():
        try:
            driver.call("test_release")
        except StoppedError as error:
            raised.append(error)

    testing = threading.Thread(target=test)
    testing.start()
    processes.await_phase(Phase.RECORDING)
    watcher.stop("enough")
    testing.join()
    assert raised
    assert section(driver) is None
    processes.await_phase(Phase.IDLE)
    until(lambda: armed(driver))  # nothing is left behind that forbids it
