"""The release tried with nothing hung: really driven, and no run of a plan.

What it needs, and what stops it, is for `test_state_space.py`.
"""

from rig.replay import replay
from rig.session.store import Session


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


def test_it_is_driven_for_the_protocols_pulse_and_is_no_run(processes, driver):
    found = driver.call("test_release")
    assert found == section(driver)
    assert (found["pulse_s"], found["edges"], found["faults"]) == (0.08, 0, [])
    on, off = driven(processes)
    assert off[0] - on[1] < 0.08 < off[1] - on[0]
    assert driver.call("subscribe")["state"]["phase"] == "idle"
    driver.fire(driver.arm(1, 1))
    driver.collect(1, 1)
    driver.close_session()
    assert section(driver) == found
    with Session.open(processes.session, readonly=True) as session:
        assert [(drop.run, drop.attempt) for drop in session.drops()] == [(1, 1)]
        assert {entry.run for entry in session.states()} == {1}
        assert "DIFFERENT" not in replay(session).lines[0]
