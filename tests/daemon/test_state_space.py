"""Every state that arming, firing, stopping, acknowledging and going on can lead to, one by one.

Breadth first: each action, undisturbed and with each trouble at each of its moments, is tried in
each state that was found before. Nothing falls that nobody armed and asked for, no drop is lost
that the board was told to forget, nothing waits for ever, and from everywhere the plan comes to its
end.
"""

import shutil
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import Mock

import pytest

from rig.errors import ControlError, SessionError, StoppedError
from rig.link.messages import TEST_RUN, Phase, RefusalReason, pack_label
from rig.recorder.controller import Controller
from rig.recorder.published import PublishedState
from tests.daemon.rig_in_a_box import LONGEST_S, Box, Trouble
from tests.link.talk import arm
from tests.session.altering import alter
from tests.tables import read_table

TABLE = read_table(__file__, "states")
ACTIONS = [(name, None) for name in TABLE["actions"]]
MOMENTS = 8  # more writes than any action has
TROUBLES = [
    (action, Trouble(what, point, n))
    for action in TABLE["troubled"]
    for n in range(1, MOMENTS + 1)
    for what, points in TABLE["troubles"].items()
    for point in points
]


@contextmanager
def rigged(folder, monkeypatch):
    """Have a new rig, of which nothing runs any more at the end."""
    box = Box(folder, monkeypatch)
    try:
        yield box
    finally:
        if box.worker is not None:
            box.kill()


@contextmanager
def followed(path, folder, monkeypatch):
    """Do one thing after the other in a new rig; `None` when a trouble found no such moment."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    with monkeypatch.context() as patch, rigged(folder, patch) as box:
        struck = True
        for action, trouble in path:
            box.trouble = trouble
            getattr(box, action)()
            struck, box.trouble = box.trouble is None, None
            box.check()
        yield box if struck else None


def explored(steps, depth, folder, monkeypatch, begin=()):
    """Go through all states within so many steps; give the path to each."""
    found, front = {}, [begin]
    for _ in range(depth + 1):
        paths, front = front, []
        in_vain = set()  # where a trouble finds its n-th moment no more
        for path in paths:
            before, (action, trouble) = path[:-1], path[-1] if path else ("", None)
            kind = (before, action, trouble and (trouble.what, trouble.point))
            if kind in in_vain:
                continue
            try:
                with followed(path, folder, monkeypatch) as box:
                    if box is None:
                        in_vain.add(kind)
                    elif (state := box.state()) not in found:
                        found[state] = path
                        front += [(*path, step) for step in steps if box.enabled(step[0])]
                        box.ends_well()
            except AssertionError as error:
                told = " → ".join(f"{name} ({what})" if what else name for name, what in path)
                raise AssertionError(f"{told}: {error}") from error
    return found


@pytest.fixture
def folder():
    """Name a folder in memory, where there is any: hundreds of rigs are made in it."""
    memory = Path("/dev/shm")
    with TemporaryDirectory(dir=memory if memory.is_dir() else None) as temporary:
        yield Path(temporary) / "rig"


FALLEN = (("arm", None), ("fire_latest", Trouble("killed", "written", 2)))


@pytest.mark.parametrize(
    ("before", "action"), [((), "arm"), ((("arm", None),), "fire_latest"), (FALLEN, "resume")]
)
def test_whatever_goes_wrong_at_any_moment_of_a_drop_it_ends_well(
    before, action, folder, monkeypatch
):
    steps = [step for step in TROUBLES if step[0] == action]
    found = explored(steps, 1, folder, monkeypatch, before)
    # So that it cannot become a test of nothing.
    assert {path[-1][1].what for path in found.values() if path != before}


def test_nothing_falls_unarmed_is_lost_or_waits_for_ever(folder, monkeypatch):
    found = explored(ACTIONS, 3, folder, monkeypatch)
    assert any(path[-1:] == (("accept", None),) for path in found.values())


def seen_at_answer(box, work, look, *, writes=True):
    """Have a client ask for work; its outcome, and what there is to see when that is known."""
    seen = []
    outcome = box.worker.submit(work, "A", writes=writes)
    outcome.add_done_callback(lambda _: seen.append(look()))
    box.turned()
    return outcome, *seen


@pytest.fixture
def box(tmp_path, monkeypatch):
    with rigged(tmp_path, monkeypatch) as box:
        yield box


def test_whoever_looks_on_leaves_a_drop_on_the_board(box):
    box.arm()
    box.trouble = Trouble("killed", "written", 2)  # FIRE, behind the look at what it does
    box.fire_latest()
    box.clock.sleep(2.0)
    assert box.phase is Phase.HOLDING
    another = Controller("a port", PublishedState())
    another.connect()
    another.recorder.look()
    assert another.published.get("phase") == "storing"
    another.close()
    assert box.phase is Phase.HOLDING
    box.ends_well()


def test_whoever_leaves_once_it_is_let_go_has_it_recorded_whole(box):
    token = box.arm()
    box.wanted = box.tokens[token]
    box.worker.submit(lambda c: c.fire(token), "A", writes=True)
    box.worker._do(box.worker._jobs.get_nowait())
    box.lease.release("A")
    box.turned()
    drop = box.worker.controller.session.drop(1, 1)
    assert (len(drop.edges), drop.faults) == (8, ()), "two rods at two gates"
    assert drop.certificate.pulse_ticks / drop.tick_hz == pytest.approx(0.08, rel=0.01)


def test_a_test_of_the_release_needs_control_a_session_nothing_armed_and_a_closed_stop(box):
    def tried(client="A"):
        return box.asked(lambda c: c.test_release(), client)

    assert isinstance(tried("B"), ControlError)
    box.arm()
    assert "not the moment" in str(tried())
    box.board.stop(True)
    box.passed(0.1)
    assert tried().reason is RefusalReason.STOPPED
    box.board.stop(False)
    box.touched = lambda _: box.board.touch(1)
    box.trouble = Trouble("touched", "write", 2)  # FIRE
    assert tried().reason is RefusalReason.GATE_BLOCKED
    box.asked(lambda c: c.close_session())
    assert "not the moment" in str(tried())
    assert box.fell == []


def test_a_test_of_the_release_that_is_not_whole_is_shown(box):
    box.board.lab.drop = lambda _: box.board.stop(True) or []
    assert "stop" in box.asked(lambda c: c.test_release())["faults"][0]


def test_what_was_heard_of_a_port_that_is_gone_is_on_the_disk(box):
    line = box.line
    box.pull()
    box.asked(lambda c: c.recorder.look())
    link = box.worker.published.get("link")
    assert (link["state"], link["retry_s"]) == ("down", 0.25)
    assert not line.is_open
    assert box.worker.controller.session.pending == 0


def test_what_a_test_of_the_release_left_on_the_board_is_in_nobodys_way(box):
    box.board.lab.drop = lambda _label: []
    device, label = box.worker.controller.recorder.device, pack_label(TEST_RUN, 1)
    device.fire(arm(device, label, gates=3))
    box.clock.sleep(1.0)
    assert box.phase is Phase.HOLDING
    box.kill()
    box.resume()
    assert box.phase is Phase.IDLE
    assert isinstance(box.arm(), int)


def test_who_is_held_up_says_by_what_and_whether_anything_is_armed(box, monkeypatch):
    worker = box.worker

    def stalled(since_s, disk_s):
        with monkeypatch.context() as patch:
            patch.setattr(worker, "_due_s", box.now() - since_s)
            patch.setattr(worker, "disk_s", lambda: disk_s)
            trouble = worker.stall()
        return trouble and trouble.reasons[0].code

    assert [stalled(1.01, disk_s) for disk_s in (0.0, 1.0)] == ["held_up", "disk_slow"]
    assert [stalled(0.99, disk_s) for disk_s in (0.0, 1.0)] == [None, None]
    box.arm()
    assert [stalled(1.01, disk_s) for disk_s in (0.0, 1.0)] == ["held_up_armed", "disk_slow_armed"]
    box.turned()
    assert box.asked(lambda _: box.clock.sleep(1.01) or worker.stall()) is not None
    assert box.asked(lambda c: c.wait(1.9) or worker.stall()) is None, "while it goes on"
    worker.controller.close()
    assert [stalled(1.01, disk_s) for disk_s in (0.0, 1.0)] == [None, "disk_slow"]


def test_how_long_the_disk_is_at_a_write_is_known_while_it_is(box):
    seen = []
    box.looked = lambda _: seen.append(box.worker.disk_s())
    box.trouble = Trouble("looked", "commit")
    box.asked(lambda c: c.wait(0.1))
    assert LONGEST_S > seen[0] > 0.0 == box.worker.disk_s()


def test_a_worker_that_ends_disarms_and_answers_whatever_waits(box):
    def ask(_=None):
        asked.append(worker.submit(lambda _: None, "A", writes=False))

    box.arm()
    worker, asked = box.worker, []
    ask()
    box.asking, box.trouble = ask, Trouble("asking", "write")  # ABORT
    worker.end()
    worker._run()
    said = [str(answer.exception(0.0)).partition("\n")[0] for answer in asked]
    assert said == ["the daemon ended", "the daemon ends"]
    assert (box.phase, worker.over.result(0.0)) == (Phase.IDLE, None)
    assert box.on_disk("state", (1, 1)) == ["armed", "interrupted"]


def test_what_fails_is_in_the_state_before_it_is_answered(box):
    box.arm()
    fail = Mock(side_effect=SessionError("the disk is full", "make room"))
    _, error = seen_at_answer(box, fail, lambda: box.worker.published.get("error"))
    assert error["message"] == "the disk is full"
    assert box.board._controller.phase is not Phase.ARMED, "what cannot be kept must not fall"


def test_what_cannot_be_kept_is_not_asked_for_but_all_is_switched_off(box, monkeypatch):
    box.arm()
    full = Mock(side_effect=SessionError("the disk is full"))
    monkeypatch.setattr(box.worker.controller.session, "log_bytes", full)
    assert isinstance(box.asked(lambda c: c.wait(0.1)), SessionError)
    assert box.board._controller.phase is Phase.IDLE


def test_what_waits_for_the_disk_is_said_once_and_only_where_anything_does(box):
    full, session = SessionError("the disk is full"), box.worker.controller.session
    session.commit()
    box.worker._weigh(full)
    session.log_bytes("rx", 1, b"x")
    box.worker._weigh(full)
    assert len(full.reasons) == 1


def test_what_the_board_holds_otherwise_than_the_session_is_not_forgotten(box):
    box.arm()
    box.worker.controller.recorder.device.acknowledge = lambda *_: box.killed()
    box.fire_latest()
    alter(box.session, 'UPDATE "drop" SET fire_tick = fire_tick + 1')
    assert "the device holds another drop of run 1, attempt 1" in str(box.resume())
    assert box.phase is Phase.HOLDING


def test_a_stop_after_a_release_that_was_not_answered_keeps_what_fell(box):
    def silent(_):
        box.deaf_until_ns = box.clock.now_ns() + 200_000_000
        box.trouble = Trouble("stopped", "write")  # FIRE once more

    box.arm()
    box.silent, box.trouble = silent, Trouble("silent", "written", 2)
    assert isinstance(box.fire_latest(), StoppedError)
    assert not box.board.outputs()
    box.passed(6.0)
    assert box.on_disk("state", (1, 1)) == ["armed", "fired", "recorded"]


def test_a_stop_that_comes_while_all_is_switched_off_is_kept(box):
    late = []
    box.arm()
    box.lease.release("A")
    box.stopping = lambda _: late.append(box.worker.stop("a second client"))
    box.trouble = Trouble("stopping", "write")  # ABORT
    box.turned()
    box.turned()
    assert late[0].result(0.0) is None
    assert box.worker._attended.is_set(), "no ABORT follows that could end what is armed anew"


def test_a_session_that_is_opened_ends_the_trouble_of_the_one_before(box):
    names = str(box.protocol), str(box.session)
    box.worker._weigh(SessionError("the disk is full", "make room"))
    work, look = lambda c: c.open_session(*names), lambda: box.worker._trouble
    assert seen_at_answer(box, work, look, writes=False)[1] is None, "before it is answered"


def test_stop_ends_the_search_for_a_board_that_does_not_answer(box):
    box.worker.controller.disconnect()
    box.trouble = Trouble("stopped", "write", 2)
    box.deaf_until_ns = box.clock.now_ns() + 60 * 10**9
    begun_s = box.now()
    outcome, ended_s = seen_at_answer(box, lambda c: c.connect(), box.now)
    assert isinstance(outcome.exception(), StoppedError)
    assert ended_s - begun_s < 3.0
    assert not box.line.is_open


@pytest.mark.slow
def test_whatever_goes_wrong_in_any_state_it_ends_well(folder, monkeypatch):
    found = explored([*ACTIONS, *TROUBLES], 3, folder, monkeypatch)
    struck = {step[1].what for path in found.values() for step in path if step[1]}
    assert struck == {trouble.what for _, trouble in TROUBLES}
