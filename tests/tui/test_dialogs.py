"""STOP everywhere: in every dialog, while typing, and in every state that lasts."""

from textual.widgets import Input

from rig.campaign.machine import Stage
from tests.cli.lab import drops_of, log_of
from tests.tui.lab import DAEMON, listening


async def test_stop_works_on_every_page_and_in_every_dialog(lab):
    async with lab.ready() as op:
        await op.play("stop on every page and in every dialog")
        assert op.app.screen.query_one(Input).value == "warm"  # nothing typed is lost
        async with listening(op) as called:
            await op.press("escape")
            await op.close()
        assert not called  # while typing it only leaves the line
        await op.press("ctrl+p")
        await op.until(lambda: len(op.app.screen_stack) == 2)
        await op.stop("f9")


_HELD_UP = """\
import time
import rig.daemon.service
from rig.recorder.controller import Controller
rig.daemon.service._STOP_S = 0.2
stop, times = Controller.stop, []
def late(self, reason):
    times.append(time.sleep(0.0 if times else 1.0))
    stop(self, reason)
Controller.stop = late
"""
"""A daemon whose board is heard of at its first STOP only when the daemon has answered."""


async def test_stop_is_asked_for_until_it_is_known_that_all_is_off(lab, monkeypatch):
    monkeypatch.setattr("tests.tui.lab.DAEMON", _HELD_UP + DAEMON)
    lab.restart()

    async with lab.ready() as op:
        await op.press("ctrl+p")
        await op.until(lambda: len(op.app.screen_stack) == 2)
        async with listening(op) as called:
            await op.press("f9")
            await op.until(lambda: op.app.model.stop.heard is False)
            assert "stop answered" not in called
            await op.until(lambda: op.app.model.stop.heard)
        assert "stop answered" in called


async def test_stop_works_in_every_state_that_lasts(lab):
    lab.url += "&pace=1"
    lab.restart()

    async with lab.ready(countdown_s=600.0) as op:
        await op.play("stop in every state that lasts")
        await op.until(lambda: op.app.model.state.phase == "idle")
        op.app.model.flow = op.app.model.flow._replace(countdown_s=0.1)
        await op.arm(Stage.LIVE)
        await op.stop("escape")
        await op.at(Stage.RESULT)  # what there is is kept and judged
    ((run, attempt),) = drops_of(lab.session)
    assert run == 1
    assert attempt > 1
    assert log_of(lab.session)[1][:2] == [(1, "armed"), (1, "interrupted")]


async def test_the_release_is_tried_only_after_a_yes_and_is_no_run(lab):
    async with lab.ready() as op:
        async with listening(op) as called:
            await op.play("the release is not tried")
            assert not called
        await op.play("the release is tried")
        assert op.app.model.page == "device"
        await op.play("the run is still to come")
        assert {line.state for line in op.app.model.state.runs} == {"planned"}
