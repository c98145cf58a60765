"""Framing, errors as data, control, the state and its replica: what needs no port and no clock."""

import copy
import json
import random
import socket
import threading
from concurrent.futures import Future, ThreadPoolExecutor
from sys import intern
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig import errors
from rig.daemon import rpc
from rig.daemon.client import Client, Line
from rig.daemon.lease import Lease
from rig.daemon.listener import Door
from rig.daemon.replica import Replica
from rig.daemon.worker import Worker
from rig.link import messages as wire
from rig.link.assembly import Assembly
from rig.link.messages import HOST_SILENCE_MS, DisarmReason, RefusalReason
from rig.link.refusals import DeviceRefusedError
from rig.link.transcript import Incoming
from rig.reasons import rig_error
from rig.recorder.feed import StateFeed
from rig.recorder.interrupts import Interrupts
from rig.recorder.published import PublishedState
from rig.recorder.recorder import NullSink
from rig.records import Job
from rig.session.schema import RunState
from tests.refusals import refused
from tests.tables import cases, read_table
from tests.waiting import PATIENCE_S

ERRORS = [
    DeviceRefusedError(RefusalReason.GATE_BLOCKED, 0b101),
    DeviceRefusedError(RefusalReason.NOT_ARMED, 0, DisarmReason.HOST_SILENT),
    rig_error("stopped", text="stopped by Ada"),
    *(getattr(errors, kind)(*words) for kind, *words in read_table(__file__, "errors")),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_comes_out_as_it_went_in(error):
    line = rpc.failure(7, error)
    again = rpc.error_of(json.loads(line)["error"])
    assert type(again) is type(error)
    assert str(again) == str(error)
    for name in ("exit_code", "reason", "detail", "disarmed", "reasons"):
        assert getattr(again, name, None) == getattr(error, name, None)


def test_a_refusal_has_its_code_and_values_as_results_have_them():
    data = rpc.error_to_data(DeviceRefusedError(RefusalReason.GATE_BLOCKED, 0b1010))
    (reason,) = data["reason_codes"]
    assert (reason["code"], reason["values"]) == ("refused_gate_blocked", {"channels": [1, 3]})
    assert data["message"] == "gates 1, 3 are blocked"
    assert not rpc.error_to_data(errors.InputError("no"))["reason_codes"]


def test_an_error_of_a_kind_nobody_listed_becomes_the_one_above_it():
    again = rpc.error_of({"data": rpc.error_to_data(errors.DomainError("singular"))})
    assert type(again) is errors.InputError


def test_an_error_of_a_kind_only_the_daemon_knows_is_an_error_all_the_same():
    again = rpc.error_of({"data": {"kind": "New", "message": "m", "hint": "h", "exit_code": 3}})
    assert (type(again), str(again), again.exit_code) == (errors.RigError, "m\n  hint: h", 3)


@given(st.binary(max_size=200))
def test_any_line_is_a_request_or_is_refused_with_a_code(line):
    read = rpc.read_line(line)
    assert read.code if isinstance(read, rpc.RpcError) else read.method is not None


@cases
def test_what_is_no_request_gets_its_code(line, code, number):
    read = rpc.read_line(line.encode())
    assert (read.code, read.id) == (getattr(rpc, code), number)


def test_a_line_nested_without_end_is_no_request():
    assert rpc.read_line(b"[" * 5000).code == rpc.PARSE


@cases
def test_who_is_no_daemon_is_told_so(tmp_path, told, why):
    tmp_path.chmod(0o700)
    with socket.socket(socket.AF_UNIX) as other, ThreadPoolExecutor(1) as pool:
        other.bind(str(tmp_path / "rig.sock"))
        other.listen()
        client = pool.submit(Line, tmp_path / "rig.sock", "t")
        line, _ = other.accept()
        with line:
            line.recv(1 << 10)
            line.sendall(told.encode("latin-1"))
        refused(errors.DeviceError, why, client.result)


def test_a_line_gives_each_request_its_answer_and_all_that_is_open_one_end(tmp_path):
    """Answers in any order, to nobody and to who waits no more; nothing stays of it at the end."""
    tmp_path.chmod(0o700)
    told, now, place = [], {"n": 1, "state": {}}, tmp_path / "rig.sock"
    with socket.socket(socket.AF_UNIX) as other, ThreadPoolExecutor(1) as pool:
        other.bind(str(place))
        other.listen()
        note = lambda *what: told.append(what)  # noqa: E731
        client = pool.submit(Line, place, "t", note, note)
        near, _ = other.accept()
        with near, near.makefile("rb") as lines:
            hello = {"jsonrpc": "2.0", "method": "hello", "params": {"api": 1, "client": "t"}}
            assert json.loads(lines.readline()) == hello | {"id": 1}
            near.sendall(rpc.answer(1, {"pid": 7}))
            line = client.result(PATIENCE_S)
            assert line.daemon == {"pid": 7}
            first, left, second, unanswered = (line.ask("stop", reason="r") for _ in range(4))
            refused(errors.DeviceError, "", Client(line).call, "wait", patience=0.1)
            assert all(lines.readline() for _ in range(5))
            left.cancel()
            answers = rpc.answer(4, now), rpc.answer(99, {}), rpc.answer(3, {})
            change, no = rpc.request("change", {"n": 2}, None), rpc.failure(2, ERRORS[0])
            near.sendall(b"".join((*answers, change, no)))
            refused(DeviceRefusedError, "gates 0, 2 are blocked", first.result, PATIENCE_S)
            assert (second.result(0.0), told) == (now, [("snapshot", now), ("change", {"n": 2})])
            near.shutdown(socket.SHUT_WR)
            assert lines.read() == b"", "it hangs up too"
            for answer in (unanswered, line.ask("renew")):
                refused(errors.DeviceError, "it hung up", answer.result, PATIENCE_S)
            line.close()
    assert told[2:] == [()]


def test_one_client_has_control_until_it_is_not_heard():
    time = SimpleNamespace(now=0.0)
    lease = Lease(lambda: time.now)
    for time.now, deed, *words, outcome in read_table(__file__, "lease"):
        try:
            came = lease.holder if deed == "holder" else getattr(lease, deed)(*map(intern, words))
        except errors.ControlError as error:
            came = error.message
        assert came == outcome, (time.now, deed, *words)


def test_a_door_that_was_lost_is_never_this_daemons_again(tmp_path, monkeypatch):
    """The next daemon's file may have the number that this one's had."""
    place = tmp_path / "rig.sock"
    tmp_path.chmod(0o700)
    door = Door(place)
    same = door._ours
    place.unlink()
    assert not door.there()
    place.touch()
    monkeypatch.setattr("rig.daemon.listener._identity", lambda _: same)
    assert not door.there()
    door.close()
    assert place.exists()


def planned(runs):
    return [{"run": n, "state": "planned"} for n in range(runs)]


def test_a_replica_shows_what_is_published_whenever_it_is_looked_at():
    """Random changes, taken at random moments, by one who joins at a random moment."""
    for seed in range(20):
        chance, published, replica = random.Random(seed), PublishedState(), None
        below = chance.randrange
        published.plan(planned(5))
        for _ in range(200):
            match below(6):
                case 0:
                    published.set(gates={"blocked": below(3)}, clients=below(3))
                case 1:
                    published.run(below(7), state=chance.choice(["armed", "fired"]))
                case 2:
                    published.edges([(below(99), 1, 0) for _ in range(below(3))])
                case 3 if chance.random() < 0.3:
                    published.replace_edges([(below(9), 0, 1)])
                case 4 if chance.random() < 0.1:
                    published.plan(planned(below(5)))
                case _:
                    change = published.take()
                    whole = json.loads(json.dumps(published.snapshot()))
                    if replica is None:
                        replica = Replica()
                        replica.follow("snapshot", copy.deepcopy(whole))
                    elif change is not None:
                        replica.follow("change", json.loads(json.dumps(change)))
                    assert (replica.n, replica.state) == (whole["n"], whole["state"])


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
    for first in range(0, 1 << 17, 1 << 12):
        published.edges((tick, 0, 1) for tick in range(first, first + (1 << 12)))
    assert len(published.snapshot()["state"]["edges"]) == 1 << 16


def test_a_replica_does_not_swallow_a_gap():
    replica = Replica()
    replica.follow("snapshot", {"n": 3, "state": {"edges": []}})
    refused(ValueError, "change 5 behind 3", replica.follow, "change", {"n": 5})


@pytest.mark.parametrize(("worker_comes", "times"), [(False, 5), (True, 1)])
def test_stop_is_sent_five_times_unless_the_worker_takes_over(monkeypatch, worker_comes, times):
    worker = Worker("a port", PublishedState(), Lease())  # never started: nobody attends to it
    sent, paused, over = [], [], threading.Event()
    monkeypatch.setattr(worker, "_abort_past", lambda: sent.append(1) or True)
    pause = lambda seconds: paused.append(seconds) or worker_comes  # noqa: E731
    monkeypatch.setattr(worker._attended, "wait", pause)
    send = worker._send_aborts
    monkeypatch.setattr(worker, "_send_aborts", lambda: (send(), over.set()))
    worker._attended.set()  # of the time before
    worker.stop("enough")
    assert over.wait(PATIENCE_S)
    assert not worker._attended.is_set()
    assert len(sent) == times
    # The board switches itself off by then, and a later one could end what somebody armed anew.
    assert 0.0 < sum(paused) < HOST_SILENCE_MS * 1e-3


@pytest.mark.parametrize(("url", "recorder"), [("a port", None), ("sim://", Mock())])
def test_no_abort_goes_past_where_no_board_is_or_it_lives_in_the_workers_thread(url, recorder):
    worker = Worker(url, PublishedState(), Lease())
    worker.controller.recorder = recorder
    assert not worker._abort_past()
    assert recorder is None or not recorder.mock_calls


def test_a_signal_waits_only_while_something_falls():
    """The daemon records what fell; to stop it then would cut the recording short."""
    answer, interrupts, client = Future(), Interrupts(), Client.__new__(Client)
    answer.set_result({})
    client._interrupts, client.line = interrupts, Mock(ask=lambda *_, **__: answer)
    for method in ("wait", "fire"):  # until the release is on, nothing shall fall
        interrupts._note()
        assert client.call("collect") == {}
        refused(KeyboardInterrupt, "", client.call, method)
    interrupts._note()
    interrupts._note()
    refused(KeyboardInterrupt, "", interrupts._note)


PIECES = st.lists(
    st.tuples(
        st.lists(st.tuples(st.integers(0, 999), st.integers(0, 15)), min_size=1, max_size=3),
        st.booleans(),
    ),
    max_size=6,
)
"""Of a fall: the events of each frame, and whether it arrives."""


@given(st.integers(0, 2**32 - 1), st.lists(PIECES, min_size=2, max_size=2))
def test_what_is_shown_of_a_fall_is_what_its_record_will_have(fire_tick, falls):
    """As far as frames arrive; one that comes again shows nothing again."""
    published = PublishedState()
    feed = StateFeed(published)
    for attempt, pieces in enumerate(falls, 1):
        job, label, first, seen = Job(1, attempt), wire.pack_label(1, attempt), 0, 0
        record = Assembly(label)
        record.fire_tick = fire_tick
        feed.state(job, RunState.ARMED, ())
        feed.know(Incoming(0, 0, wire.Fired(fire_tick)))
        for events, arrives in pieces:
            ticks = [((fire_tick + tick) % 2**32, state) for tick, state in events]
            frame = wire.EventsFrame(label, first, wire.pack_events(ticks))
            first += len(events)
            if arrives:
                record.add(frame)
                feed.know(Incoming(0, 0, frame))
                feed.know(Incoming(0, 0, frame))
                seen = first
        drop = record.drop(1000)
        edges = [(tick, channel, int(blocked)) for tick, channel, blocked in drop.edges]
        state = published.snapshot()["state"]
        shown = {**job._asdict(), "state": "fired", "tick_hz": 0, "fire_tick": fire_tick}
        assert (state["edges"], state["drop"]) == (edges, shown | {"events": seen})
        feed.show_drop(drop)
        assert published.snapshot()["state"]["edges"] == edges


def test_what_has_no_session_keeps_nothing_and_can_arm_nothing():
    sink = NullSink()
    assert sink.log_bytes("rx", 0, b"x") is None
    refused(AttributeError, "add_state", getattr, sink, "add_state")


ARMED = ("arm", 1, 1)
DEEDS = {(): 1, (ARMED,): 0, (ARMED, ("fire", 1)): 1, (ARMED, ("stop", "enough")): 1}


@pytest.mark.parametrize(("deeds", "signs"), DEEDS.items())
def test_a_client_gives_signs_of_life_by_itself_unless_it_is_armed(deeds, signs):
    answer = Future()
    answer.set_result({"token": 1})
    client = Client(Mock(ask=Mock(return_value=answer)))
    client._closed = Mock(wait=Mock(side_effect=[False, True]))  # after one beat
    for method, *values in deeds:
        getattr(client, method)(*values)
    client._renew()
    assert [asked.args[0] for asked in client.line.ask.mock_calls].count("renew") == signs
