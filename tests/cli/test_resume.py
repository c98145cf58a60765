"""A campaign that is stopped, killed or cut off goes on where it was, and loses nothing."""

import random
import signal
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from unittest.mock import Mock

import pytest

from rig.daemon.client import _ANSWER_S
from rig.daemon.worker import Worker
from rig.errors import DeviceError
from rig.link.client import Device
from rig.link.port import open_port
from rig.recorder.interrupts import Interrupts
from rig.replay import replay
from rig.session.schema import RunState
from rig.session.store import Session
from tests.cli import lab
from tests.refusals import refused
from tests.waiting import PATIENCE_S, until


def stopped(arguments, session, number, wait_s):
    """Start a campaign, and send it a signal some time after it has begun."""
    lock = session.with_name(session.name + ".lock")
    with subprocess.Popen(
        lab.command(*arguments), cwd=lab.ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        try:
            until(lambda: process.poll() is not None or _holds(lock, process.pid))
            until(lambda: process.poll() is not None or session.exists())
            time.sleep(wait_s)
            process.send_signal(number)
            _, err = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert "Traceback" not in err, err
    return process.returncode, err


def _holds(lock, pid):
    try:
        return lock.read_text("ascii").strip() == str(pid)
    except FileNotFoundError:
        return False


def campaign(numbers, seed, folder, longest_s, pace, text):
    """Stop a campaign by one signal after the other, then let it end; return how each time."""
    session = folder / f"{'-'.join(number.name for number in numbers)}-{seed}"
    protocol = session.with_suffix(".yaml")
    protocol.write_text(text, "utf-8")
    arguments = (
        *("run", protocol, "--port", f"sim://?pace={pace}", "--session", session),
        *("--seed", seed),
    )
    moment = random.Random(f"{numbers} {seed}")
    ends = []
    for number in numbers:
        code, err = stopped(arguments, session, number, moment.uniform(0.0, longest_s))
        assert code in {-number if number == signal.SIGKILL else 130, 0}, (code, err)
        ends.append(code)
        if code == 130:
            assert "the same command continues" in err
        with Session.open(session, readonly=True) as opened:
            assert replay(opened).differences == (), f"after {ends}"
        if number != signal.SIGKILL:
            fallen = {(line["run"], line["attempt"]) for line in lab.truth_of(session)}
            if signal.SIGKILL not in numbers:
                assert fallen == set(lab.drops_of(session)), "whatever fell is recorded"
    lab.rig(*arguments)
    lab.assert_whole(session, 3)
    return ends


INT, TERM, KILL = signal.SIGINT, signal.SIGTERM, signal.SIGKILL
FAST = lab.short_fence(3), 0.25, 0, [(TERM,), (KILL,)]
REAL_TIME = lab.short("40 deg", 3, "0.2 s"), 3.0, 1, [(INT, TERM), (KILL, KILL), (TERM, KILL, INT)]


@pytest.mark.parametrize(
    ("text", "longest_s", "pace", "cases"), [FAST, pytest.param(*REAL_TIME, marks=pytest.mark.slow)]
)
def test_signals_at_random_moments_cost_no_run(text, longest_s, pace, cases, tmp_path):
    """In virtual time nearly every moment is one of work, not of waiting."""
    with ThreadPoolExecutor(len(cases)) as pool:
        made = [
            pool.submit(campaign, numbers, seed, tmp_path, longest_s, pace, text)
            for seed, numbers in enumerate(cases)
        ]
    assert any(code in {130, -KILL} for one in made for code in one.result())


# ------------------------------------------------- moments that chance would seldom choose


@pytest.mark.parametrize(
    ("record", "which"), [("log_bytes", 2), ("add_timing", 1), ("add_identity", 1), ("add_drop", 1)]
)
def test_a_signal_between_a_byte_and_what_it_means_waits(run, tmp_path, monkeypatch, record, which):
    number, store = count(1), getattr(Session, record)

    def interrupted(session, *what, **more):
        if next(number) == which:
            signal.raise_signal(signal.SIGINT)
        store(session, *what, **more)

    monkeypatch.setattr(Session, record, interrupted)
    assert run(code=130).out == ""
    assert next(number) > which
    monkeypatch.undo()
    with Session.open(tmp_path / "s", readonly=True) as session:
        assert replay(session).differences == ()
    run()
    lab.assert_whole(tmp_path / "s", 2)


@pytest.mark.parametrize(
    ("state", "number"), [(RunState.ARMED, signal.SIGTERM), (RunState.FIRED, signal.SIGINT)]
)
def test_whoever_stops_before_the_release_sees_nothing_fall(
    run, tmp_path, monkeypatch, state, number
):
    add_state, asked = Session.add_state, threading.Event()

    def add(session, run, attempt, new, *more):
        add_state(session, run, attempt, new, *more)
        if new == state:
            # As if it came just before the main thread waits for this one: nothing wakes that.
            signal.pthread_kill(threading.get_ident(), number)
            assert asked.wait(_ANSWER_S / 2)

    for name in ("stop", "end"):
        ask = getattr(Worker, name)
        monkeypatch.setattr(Worker, name, lambda *a, ask=ask, **k: (ask(*a, **k), asked.set())[0])
    monkeypatch.setattr(Session, "add_state", add)
    run(code=130)
    assert lab.truth_of(tmp_path / "s") == []
    monkeypatch.undo()
    run()
    lab.assert_whole(tmp_path / "s", 2)
    assert (1, RunState.INTERRUPTED) in lab.log_of(tmp_path / "s")[1]
    assert (1, 1) not in lab.drops_of(tmp_path / "s")


@pytest.mark.parametrize("state", [RunState.RECORDED, RunState.ACCEPTED])
def test_a_drop_that_is_recorded_when_the_signal_comes_is_not_made_again(
    run, tmp_path, monkeypatch, state
):
    add_state = Session.add_state

    def add(session, run, attempt, new, *more):
        add_state(session, run, attempt, new, *more)
        if new == state:
            signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(Session, "add_state", add)
    run(code=130)
    monkeypatch.undo()
    assert lab.drops_of(tmp_path / "s") == [(1, 1)]
    run()
    assert lab.drops_of(tmp_path / "s") == [(1, 1), (2, 1)]
    lab.assert_whole(tmp_path / "s", 2)


# ------------------------------------------------- what keeps the signals waiting


def test_a_signal_comes_where_it_is_let_through_or_at_the_end():
    interrupts, reached = Interrupts(), []

    def work():
        with interrupts.let_through():
            reached.append("before")
        signal.raise_signal(signal.SIGTERM)
        reached.append("inside")
        with interrupts.let_through():
            reached.append("behind")

    with interrupts.caught(), pytest.raises(KeyboardInterrupt):
        work()
    assert reached == ["before", "inside"]
    interrupts.check()
    with pytest.raises(KeyboardInterrupt), interrupts.caught():
        signal.raise_signal(signal.SIGTERM)
    with interrupts.caught(), pytest.raises(KeyboardInterrupt), interrupts.let_through():
        signal.raise_signal(signal.SIGINT)


def test_the_third_signal_is_obeyed_at_once():
    interrupts, reached = Interrupts(), []

    def work():
        for number in (1, 2, 3, 4):
            reached.append(number)
            signal.raise_signal(signal.SIGINT)

    with interrupts.caught(), pytest.raises(KeyboardInterrupt):
        work()
    assert reached == [1, 2, 3]


def test_an_error_inside_a_block_goes_first():
    interrupts = Interrupts()

    def work():
        signal.raise_signal(signal.SIGINT)
        raise DeviceError("the board restarted")

    with interrupts.caught():
        refused(DeviceError, "", work)
        refused(KeyboardInterrupt, "", interrupts.check)


def test_a_process_in_the_background_goes_on_ignoring_ctrl_c():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with Interrupts().caught():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
            assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


# ------------------------------------------------- what the board is left with


def test_a_drop_of_another_session_is_neither_taken_nor_discarded(
    call, run, tmp_path, fence, monkeypatch
):
    """Of a board that opening its port restarts, and that keeps its drop."""
    boards = []

    def reopen(url):
        if not boards:
            boards.append(open_port(url))
            boards[0].reset_on_open = True
        else:
            boards[0].open()
        return boards[0]

    monkeypatch.setattr("rig.recorder.recorder.open_port", reopen)

    def other(name, **ends):
        words = ("run", fence, "--port", "sim://", "--session", tmp_path / name)
        return call(*words, "--seed", 1, **ends)

    other("older")
    with monkeypatch.context() as patch:  # just before the drop is read
        patch.setattr(Device, "collect", Mock(side_effect=DeviceError("connection lost")))
        run(code=4)
    boards[0].clock.sleep(2.0)  # the recording ends
    for name in ("newer", "older"):
        before = lab.drops_of(tmp_path / name) if name == "older" else []
        done = other(name, code=4)
        assert "session" in done.err
        assert "taking the power from the board discards the drop" in done.err
        assert lab.drops_of(tmp_path / name) == before
    assert "fetching run 1, attempt 1" in run().err
    lab.assert_whole(tmp_path / "s", 2)
