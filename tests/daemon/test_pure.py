"""Framing, errors as data, control, the state and its replica: what needs no port and no clock."""

import json
import random
from unittest.mock import Mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.process_fixture import FENCE
from rig.daemon import rpc
from rig.daemon.admission import CLIENTS, Admission
from rig.daemon.client import MessageReader
from rig.daemon.lease import LEASE_S, ControlError, Lease
from rig.daemon.listener import Door
from rig.daemon.replica import Replica
from rig.daemon.stopper import Stopper
from rig.errors import (
    DeviceError,
    DeviceTimeoutError,
    DomainError,
    InputError,
    RigError,
    SessionError,
)
from rig.files import identity_of
from rig.link.messages import HOST_SILENCE_MS, DisarmReason, RefusalReason
from rig.link.refusals import DeviceRefusedError
from rig.reasons import make_error
from rig.recorder.controller import Controller
from rig.recorder.interrupts import StoppedError
from rig.recorder.published import EDGES_LIMIT, PublishedState

ERRORS = [
    RigError("something"),
    InputError("a typo", "line 3"),
    SessionError("the disk is full", "free some space"),
    DeviceError("connection lost", "check the cable"),
    DeviceTimeoutError("silent"),
    DeviceRefusedError(RefusalReason.GATE_BLOCKED, 0b101),
    DeviceRefusedError(RefusalReason.NOT_ARMED, 0, DisarmReason.HOST_SILENT),
    ControlError("taken"),
    make_error(StoppedError, "stopped", text="stopped by Ada"),
    make_error(ControlError, "control_lost", silence_s=3.25, holder="Ada"),
    rpc.VersionError("old"),
]

MESSAGES = st.lists(st.dictionaries(st.text(max_size=4), st.text(max_size=9), max_size=3))


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_comes_out_as_it_went_in(error):
    line = rpc.failure(7, error)
    again = rpc.error_of(json.loads(line))
    assert type(again) is type(error)
    assert str(again) == str(error)
    for name in ("exit_code", "reason", "detail", "disarmed", "reasons"):
        assert getattr(again, name, None) == getattr(error, name, None)


def test_a_refusal_has_its_code_and_values_as_results_have_them():
    data = rpc.error_to_data(DeviceRefusedError(RefusalReason.GATE_BLOCKED, 0b1010))
    (reason,) = data["reason_codes"]
    assert (reason["code"], reason["values"]) == ("refused_gate_blocked", {"channels": [1, 3]})
    assert data["message"] == "gates 1, 3 are blocked"
    assert rpc.error_to_data(InputError("no"))["reason_codes"] == []


def test_an_error_of_a_kind_nobody_listed_becomes_the_one_above_it():
    again = rpc.error_from_data(rpc.error_to_data(DomainError("Eq. 13 is singular")))
    assert type(again) is InputError


def test_an_error_of_a_kind_only_the_daemon_knows_is_an_error_all_the_same():
    again = rpc.error_from_data({"kind": "NewerError", "message": "m", "hint": "h", "exit_code": 3})
    assert (type(again), str(again), again.exit_code) == (RigError, "m\n  hint: h", 3)


@given(st.binary(max_size=200))
def test_any_line_is_a_request_or_is_refused_with_a_code(line):
    read = rpc.read_line(line)
    for one in read if isinstance(read, list) else [read]:
        assert one.code if isinstance(one, rpc.RpcError) else one.method is not None


@pytest.mark.parametrize(
    ("line", "code"),
    [
        (b"{", rpc.PARSE),
        (b"[" * 5000, rpc.PARSE),
        (b"[]", rpc.INVALID),
        (b'{"jsonrpc":"1.0","id":1,"method":"a"}', rpc.INVALID),
        (b'{"jsonrpc":"2.0","id":true,"method":"a"}', rpc.INVALID),
        (b'{"jsonrpc":"2.0","id":1,"method":2}', rpc.INVALID),
        (b'{"jsonrpc":"2.0","id":1,"method":"a","params":[1]}', rpc.BAD_PARAMS),
    ],
)
def test_what_is_no_request_gets_its_code(line, code):
    assert rpc.read_line(line).code == code


def test_a_request_is_read_as_it_was_written():
    job = {"run": 1, "attempt": 2}
    assert rpc.read_line(rpc.request("arm", job, 5)) == rpc.Request("arm", job, 5)
    assert rpc.read_line(rpc.request("renew", {}, None)).silent


@given(MESSAGES, st.data())
def test_any_cut_gives_the_same_messages(messages, data):
    stream = b"".join(json.dumps(one).encode() + b"\n" for one in messages)
    cuts = data.draw(st.lists(st.integers(1, max(1, len(stream))), max_size=9, unique=True))
    ends = sorted({*cuts, len(stream)} - {0})
    dialogue, found = MessageReader(), []
    for begin, end in zip([0, *ends], ends, strict=False):
        if part := stream[begin:end]:
            found += dialogue.feed(part)
    assert found == messages
    with pytest.raises(DeviceError, match="hung up"):
        list(dialogue.feed(b""))


@pytest.mark.parametrize("line", [b"HTTP/1.1 400 Bad Request\n", b"\xff\xfe\n", b"[1]\n", b"\n"])
def test_who_is_no_daemon_is_told_so(line):
    with pytest.raises(DeviceError, match="not a daemon of this rig"):
        list(MessageReader().feed(line))


def test_a_line_without_an_end_is_no_daemons():
    dialogue = MessageReader()
    assert list(dialogue.feed(b"x" * rpc.MESSAGE_LIMIT)) == []
    with pytest.raises(DeviceError, match="not a daemon of this rig"):
        list(dialogue.feed(b"x"))


class Time:
    """A clock that is set by hand."""

    now = 0.0

    def __call__(self):
        return self.now


def test_one_client_has_control_until_it_is_not_heard():
    time = Time()
    lease = Lease(time)
    lease.take("one", "rig run 1")
    with pytest.raises(ControlError, match="rig run 1 has control"):
        lease.take("two", "tui 2")
    with pytest.raises(ControlError, match="rig run 1 has it"):
        lease.require("two")
    time.now = LEASE_S - 0.1
    lease.heard("two")  # says nothing of the first
    lease.heard("one")
    time.now += LEASE_S - 0.1
    lease.require("one")
    time.now += 0.2
    assert lease.holder is None
    lease.require("one")  # nobody took it meanwhile, so that it goes on
    lease.heard("one")
    assert lease.holder == "one"
    time.now += LEASE_S
    lease.take("two", "tui 2")
    lease.heard("one")
    assert lease.holder == "two"
    assert not lease.release("one")
    assert lease.release("two")
    assert lease.holder is None


def test_who_was_silent_too_long_is_told_so_until_it_gives_control_up_or_has_it_again():
    time = Time()
    lease = Lease(time)
    lease.take("one", "rig run 1")
    time.now = 5.0
    lease.take("two", "a tui")
    time.now = 7.5
    lease.heard("one")
    lost = r"control was lost: nothing was heard .* for 7\.5 s, and a tui has it"
    with pytest.raises(ControlError, match=lost):
        lease.require("one")
    assert not lease.release("one")
    with pytest.raises(ControlError, match="take control first"):
        lease.require("one")
    lease.release("two")
    lease.take("one", "rig run 1")
    lease.require("one")


def test_a_door_that_was_lost_is_never_this_daemons_again(tmp_path, monkeypatch):
    """The next daemon's file may have the number that this one's had."""
    place = tmp_path / "rig.sock"
    place.touch()
    door = Door(place)
    same = identity_of(place)
    place.unlink()
    assert not door.there()
    place.touch()
    monkeypatch.setattr("rig.daemon.listener.identity_of", lambda _: same)
    assert not door.there()
    door.remove()
    assert place.exists()


def test_a_client_in_the_reserve_has_no_more_time_than_a_stranger():
    admission, *clients = Admission(), *(Mock() for _ in range(CLIENTS + 1))
    for client in clients:
        admission.register(client)
        assert admission.late(client)
        admission.welcome(client)
    assert [client for client in clients if admission.late(client)] == clients[-1:]


def test_a_replica_shows_what_is_published_whenever_it_is_looked_at():
    """Random changes, taken at random moments, by one who joins at a random moment."""
    for seed in range(20):
        chance, published, replica = random.Random(seed), PublishedState(), None
        published.plan({"run": n, "state": "planned"} for n in range(5))
        for _ in range(200):
            match chance.randrange(6):
                case 0:
                    published.set(
                        gates={"blocked": chance.randrange(3)}, clients=chance.randrange(3)
                    )
                case 1:
                    published.run(chance.randrange(7), state=chance.choice(["armed", "fired"]))
                case 2:
                    published.edges(
                        (chance.randrange(99), 1, 0) for _ in range(chance.randrange(3))
                    )
                case 3 if chance.random() < 0.3:
                    published.replace_edges([(chance.randrange(9), 0, 1)])
                case 4 if chance.random() < 0.1:
                    published.plan(
                        {"run": n, "state": "planned"} for n in range(chance.randrange(5))
                    )
                case _:
                    change = published.take()
                    if replica is None:
                        replica = Replica()
                        replica.follow("snapshot", json.loads(json.dumps(published.snapshot())))
                    elif change is not None:
                        replica.follow("change", json.loads(json.dumps(change)))
                    assert replica.n == published.snapshot()["n"]
                    assert json.loads(json.dumps(published.snapshot()["state"])) == replica.state


def test_a_change_that_changes_nothing_is_none():
    published, told = PublishedState(), []
    published.changed = lambda: told.append(1)
    published.set(clients=0)
    published.edges(())
    published.run(7, state="armed")
    assert published.take() is None
    assert not told
    published.set(clients=1)
    published.set(clients=2)
    assert told == [1], "once is enough until somebody has taken it"
    assert published.take() == {"n": 1, "set": {"clients": 2}}


def test_the_edges_of_an_endless_drop_do_not_fill_the_memory():
    published = PublishedState()
    for first in range(0, 2 * EDGES_LIMIT, 1 << 12):
        published.edges((tick, 0, 1) for tick in range(first, first + (1 << 12)))
    assert len(published.snapshot()["state"]["edges"]) == EDGES_LIMIT


def test_a_replica_does_not_swallow_a_gap():
    replica = Replica()
    replica.follow("snapshot", {"n": 3, "state": {"edges": []}})
    with pytest.raises(ValueError, match="change 5 behind 3"):
        replica.follow("change", {"n": 5})


@pytest.mark.parametrize(("worker_comes", "times"), [(False, 5), (True, 1)])
def test_stop_is_sent_five_times_unless_the_worker_takes_over(monkeypatch, worker_comes, times):
    sent, paused = [], []

    def send():
        sent.append(1)
        stopper._ending = True  # behind what is asked for now
        stopper._asked.set()
        return True

    stopper = Stopper(send)  # never started: this thread is its thread
    pause = lambda seconds: paused.append(seconds) or worker_comes  # noqa: E731
    monkeypatch.setattr(stopper._taken_over, "wait", pause)
    stopper.ask()
    stopper._run()
    assert len(sent) == times
    # The board switches itself off by then, and a later one could end what somebody armed anew.
    assert 0.0 < sum(paused) < HOST_SILENCE_MS * 1e-3


def test_who_asks_for_stop_again_waits_until_that_one_has_left_too():
    stopper = Stopper(lambda: True)  # never started: nothing leaves
    stopper._left.set()  # of the time before
    stopper.ask()
    assert not stopper._left.is_set()


def test_a_protocol_without_gates_is_refused_and_leaves_no_session(tmp_path):
    protocol, session = tmp_path / "g.yaml", tmp_path / "session"
    before, _, after = FENCE.partition("gates:")
    protocol.write_text(before + after[after.index("release:") :].replace("RUNS", "1"), "utf-8")
    with pytest.raises(InputError, match="has no gates, so nothing can be measured"):
        Controller("sim://").open_session(str(protocol), str(session))
    assert not session.exists()


def test_a_session_that_is_closed_is_shown_to_nobody_any_more(tmp_path):
    protocol = tmp_path / "fence.yaml"
    protocol.write_text(FENCE.replace("RUNS", "1"), "utf-8")
    rig = Controller("sim://")
    rig.open_session(str(protocol), str(tmp_path / "session"))
    assert rig.published.get("session")["path"] == str(tmp_path / "session")
    rig.close()
    assert rig.published.get("session") is None
    assert rig.published.get("link")["state"] == "closed"
