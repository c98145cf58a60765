"""One client controls, all may stop, and nobody's end leaves anything on."""

from __future__ import annotations

import signal
import time

import pytest

from rig.bench.invariants import broken, longest_on
from rig.daemon import rpc
from rig.daemon.faults import ControlError, StoppedError
from rig.daemon.lease import LEASE_S
from rig.errors import DeviceError, InputError
from rig.link.messages import Phase, Reason
from rig.link.refusals import DeviceRefusedError
from rig.session.schema import RunState
from rig.session.store import Session

SOON_S = 0.25
BUSY_S = 0.25  # what a computer with other things to do may add


@pytest.fixture
def armed(stand, client):
    """Have a client in control that has armed the first run; give it and the token."""
    one = client("one")
    one.take_control()
    one.open_session(str(stand.protocol), str(stand.session))
    return one, one.arm(1, 1)


def states(stand):
    with Session.open(stand.session, readonly=True) as session:
        return [(e.run, e.attempt, str(e.state)) for e in session.states()]


def gone_on_with(stand):
    """Let `rig run` finish the session, and look at it as at any other."""
    assert stand.run() == 0, stand.told
    assert broken(stand.session, stand.happened(), stand.runs) == []


def test_two_clients_that_race_for_control_do_not_both_get_it(stand, client):
    one, two = client("one"), client("two")
    one.take_control()
    with pytest.raises(ControlError, match="one has control"):
        two.take_control()
    for forbidden in (
        lambda: two.open_session(str(stand.protocol), str(stand.session)),
        lambda: two.arm(1, 1),
        lambda: two.wait(0.1),
    ):
        with pytest.raises(ControlError):
            forbidden()
    stand.start_runner()
    _, told = stand.runner.communicate(timeout=30)
    assert stand.runner.returncode == 4
    assert "one has control" in told
    assert not stand.session.exists()
    one.close()
    two.take_control()
    two.close()
    gone_on_with(stand)


def test_what_comes_next_is_the_daemons_to_know(stand, armed):
    one, _ = armed
    with pytest.raises(InputError, match="not the moment"):
        one.arm(1, 2)
    one.stop("tried")
    for run, attempt in ((1, 1), (1, 3), (9, 1)):
        with pytest.raises(InputError, match="not what comes next"):
            one.arm(run, attempt)
    with pytest.raises(InputError, match="cannot be accepted"):
        one.log_state(1, 1, RunState.ACCEPTED)
    with pytest.raises(StoppedError, match="tried"):
        one.fire(0)
    assert states(stand) == [(1, 1, "armed"), (1, 1, "interrupted")]


def test_a_client_that_is_lost_while_armed_disarms(stand, armed):
    one, _ = armed
    stand.await_phase(Phase.ARMED)
    time.sleep(0.4)  # longer than the board bears silence: the daemon keeps it armed
    assert list(stand.happened())[-1]["phase"] == Phase.ARMED
    lost = time.monotonic()
    one._socket.close()
    assert stand.await_phase(Phase.IDLE) - lost < SOON_S + BUSY_S
    gone_on_with(stand)
    assert (1, 1, "interrupted") in states(stand)


def test_a_client_that_hangs_while_armed_disarms(stand, armed):
    """It is connected, and says nothing any more."""
    begun = stand.await_phase(Phase.ARMED)
    assert stand.await_phase(Phase.IDLE) - begun < LEASE_S * 1.1 + SOON_S + BUSY_S
    until = time.monotonic() + 5.0
    while states(stand)[-1] != (1, 1, "interrupted") and time.monotonic() < until:
        time.sleep(0.01)
    with Session.open(stand.session, readonly=True) as session:
        assert session.latest_state(1).reasons == ("the client in control was lost",)


def test_a_device_that_disarms_itself_is_noticed(stand, armed):
    one, token = armed
    stand.hand("stop 1")
    stand.await_phase(Phase.IDLE)
    with pytest.raises(DeviceRefusedError, match="the emergency stop was opened") as refused:
        one.fire(token)
    assert refused.value.reason is Reason.NOT_ARMED
    stand.hand("stop 0")
    one.close()
    gone_on_with(stand)


def test_any_client_stops_what_another_has_armed(stand, armed, client):
    one, token = armed
    two = client("two")
    begun = time.monotonic()
    two.stop("somebody is under it")
    assert stand.await_phase(Phase.IDLE) - begun < SOON_S + BUSY_S
    with pytest.raises(StoppedError, match="somebody is under it"):
        one.fire(token)
    with Session.open(stand.session, readonly=True) as session:
        assert session.latest_state(1).reasons == ("somebody is under it",)


def test_any_client_stops_a_recording_and_what_there_is_is_kept(stand, armed, client):
    one, token = armed
    two = client("two")
    one.fire(token)
    two.stop("enough")
    holding = stand.await_phase(Phase.HOLDING)
    assert holding - stand.await_phase(Phase.RECORDING) < 1.0, "it would have been 1.5 s"
    assert states(stand)[-1] == (1, 1, "recorded")
    one.close()
    gone_on_with(stand)


def test_a_stop_does_not_wait_for_answers_that_are_lost(stand, armed, client):
    """The board hears and is not heard: what the daemon repeats keeps it armed."""
    two = client("two")
    stand.hand("mute 1")
    time.sleep(0.4)
    assert list(stand.happened())[-1]["phase"] == Phase.ARMED
    begun = time.monotonic()
    two._send(rpc.request("stop", {"reason": "no answer"}, None))
    assert stand.await_phase(Phase.IDLE) - begun < SOON_S + BUSY_S
    stand.hand("mute 0")
    two.stop("answered now")
    assert states(stand) == [(1, 1, "armed"), (1, 1, "interrupted")]


def test_a_stop_after_a_release_that_was_not_answered_keeps_what_fell(stand, armed, client):
    one, token = armed
    two = client("two")
    stand.hand("mute fall")
    time.sleep(0.1)
    one._send(rpc.request("fire", {"token": token}, 99))
    stand.await_phase(Phase.RECORDING)
    begun = time.monotonic()
    two._send(rpc.request("stop", {"reason": "no answer"}, None))
    assert stand.await_phase(Phase.HOLDING) - begun < SOON_S + BUSY_S
    stand.await_phase(Phase.IDLE)
    assert states(stand) == [(1, 1, "armed"), (1, 1, "fired"), (1, 1, "recorded")]


def test_a_stop_ends_a_wait(stand, client):
    one, two = client("one"), client("two")
    one.take_control()
    one.open_session(str(stand.protocol), str(stand.session))
    one._send(b'{"jsonrpc":"2.0","id":99,"method":"wait","params":{"seconds":600}}\n')
    two.stop("no need")
    assert one.arm(1, 1)


def test_a_client_that_leaves_after_the_release_leaves_a_recorded_drop(stand, armed):
    one, token = armed
    one.fire(token)
    one._socket.close()
    stand.await_phase(Phase.HOLDING)
    stand.await_phase(Phase.IDLE)
    assert states(stand) == [(1, 1, "armed"), (1, 1, "fired"), (1, 1, "recorded")]
    gone_on_with(stand)
    assert (1, 1, "accepted") in states(stand), "judged by whoever came next"


def test_a_daemon_that_is_asked_to_end_disarms(stand, armed):
    stand.daemon.send_signal(signal.SIGTERM)
    _, told = stand.daemon.communicate(timeout=10)
    assert stand.daemon.returncode == 0
    assert "rig daemon: ended" in told
    assert "Traceback" not in told
    assert list(stand.happened())[-1]["phase"] == Phase.IDLE
    stand.start_daemon()
    gone_on_with(stand)


def test_a_daemon_that_is_asked_to_end_in_the_fall_records_it(stand, armed):
    one, token = armed
    one.fire(token)
    stand.daemon.send_signal(signal.SIGINT)
    stand.daemon.communicate(timeout=10)
    assert stand.daemon.returncode == 0
    assert states(stand)[-1] == (1, 1, "recorded")
    assert not stand.socket.exists()
    stand.start_daemon()
    gone_on_with(stand)
    assert longest_on(stand.happened()) < 0.08 + BUSY_S


def test_a_daemon_that_is_killed_while_armed_leaves_nothing_on(stand, armed):
    one, _ = armed
    stand.await_phase(Phase.ARMED)
    killed = time.monotonic()
    stand.kill(stand.daemon)
    assert stand.await_phase(Phase.IDLE) - killed < SOON_S + BUSY_S
    with pytest.raises(DeviceError, match="the daemon is gone"):
        one.wait(1.0)
    stand.start_daemon()
    gone_on_with(stand)
