"""A device that will not arm or fire costs time, and never a run."""

from itertools import count

import pytest

from rig.reasons import sentences
from rig.recorder.recorder import Recorder
from rig.runner import Operator, run_protocol
from rig.session.schema import RunState
from rig.session.store import Session
from tests.cli.lab import assert_whole, drops_of, log_of, truth_of
from tests.tables import cases

ARMED, FIRED, INTERRUPTED = RunState.ARMED, RunState.FIRED, RunState.INTERRUPTED


@pytest.fixture
def once_armed(monkeypatch):
    """Have something happen to the board right behind each of the first so many armings."""

    def have(happen, times):
        arm, number = Recorder.arm, count(1)

        def armed(recorder, *what):
            token = arm(recorder, *what)
            if next(number) <= times:
                port = recorder._port
                for deed, value in happen:
                    port.board.advance(port.clock.now_ns())
                    (port.clock.sleep if deed == "sleep" else getattr(port.board, deed))(value)
            return token

        monkeypatch.setattr(Recorder, "arm", armed)

    return have


@cases
def test_a_drop_that_is_not_let_go_is_prepared_again(run, tmp_path, once_armed, happen, why):
    once_armed(happen, times=2)
    assert run().err.count(f"not fired: {why}") == 2
    entries = log_of(tmp_path / "s")[1]
    unfired = [(n, state) for n in (1, 2) for state in (ARMED, FIRED, INTERRUPTED)]
    assert entries[:7] == [*unfired, (3, ARMED)]
    assert drops_of(tmp_path / "s") == [(1, 3), (2, 1)]
    assert len(truth_of(tmp_path / "s")) == 2
    with Session.open(tmp_path / "s", readonly=True) as session:
        assert sentences(session.states()[2].reasons) == why
    assert_whole(tmp_path / "s", 2)


@cases
def test_a_device_that_never_lets_go_is_not_asked_for_ever(run, tmp_path, once_armed, happen, why):
    once_armed(happen, times=5)
    done = run(code=4)
    assert why in done.err
    assert "hint" in done.err
    assert [n for n, state in log_of(tmp_path / "s")[1] if state == INTERRUPTED] == [1, 2, 3, 4, 5]
    assert log_of(tmp_path / "s")[1][-1] == (5, INTERRUPTED)
    run()
    assert_whole(tmp_path / "s", 2)


@pytest.mark.parametrize(("looks", "code"), [(3, 0), (9, 4)])
def test_an_open_stop_is_waited_for_a_little(run, tmp_path, monkeypatch, looks, code):
    wait, number = Recorder.wait, count(1)

    def waited(recorder, seconds, *more):
        wait(recorder, seconds, *more)
        step = next(number)
        if step in {1, looks}:
            recorder._port.board.stop(step == 1)

    monkeypatch.setattr(Recorder, "wait", waited)
    assert ("the emergency stop is open" in run(code=code).err) == (code == 4)
    assert len(drops_of(tmp_path / "s")) == (2 if code == 0 else 0)


def test_whoever_is_there_is_asked_to_close_the_stop(monkeypatch, tmp_path, fence):
    asked = []

    def ask(what):
        asked.append(what)
        recorders[0]._port.board.stop(len(asked) == 1)

    recorders, connect = [], Recorder.__init__
    monkeypatch.setattr(
        Recorder, "__init__", lambda s, *a: (connect(s, *a), recorders.append(s))[0]
    )
    operator = Operator(say=lambda _: None, ask=ask)
    run_protocol(str(fence), "sim://", str(tmp_path / "s"), operator, 1)
    assert asked[1].startswith("not armed: the emergency stop is open; ")
    assert_whole(tmp_path / "s", 2)
