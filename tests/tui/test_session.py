"""A session driven by keys, against the daemon with a simulated rig."""

from dataclasses import replace

from rig.campaign.machine import Stage
from rig.session.schema import RunState
from rig.session.store import Session
from rig.tui.commands import REASONS
from tests.tui.lab import text_of


async def test_a_drop_is_rejected_with_a_cause_and_noted(lab):
    rung = []

    async with lab.ready() as op:
        op.app.options = replace(op.app.options, bell=True)
        op.app.bell = lambda: rung.append(op.app.model.flow.stage)
        await op.arm(Stage.RESULT)
        await op.until(lambda: op.app.model.flow.logged and rung)
        await op.play("a drop is noted")
        assert rung == [Stage.RESULT]
        await op.play("it is rejected with a cause, and taken back")
        await op.play("other attempts count instead")
    with Session.open(lab.session, readonly=True) as session:
        told = [
            (entry.state, tuple(reason.text for reason in entry.reasons))
            for entry in session.states()
            if entry.attempt == 1
        ]
    note = "note: [/b] hm"
    assert told[-6:] == [
        (RunState.ACCEPTED, ()),
        (RunState.ACCEPTED, ("note: [/b] hn",)),
        (RunState.ACCEPTED, (note,)),
        (RunState.REJECTED, ("draught", note)),
        (RunState.ACCEPTED, (note,)),
        (RunState.REJECTED, (REASONS[0], note)),
    ]


async def test_a_blind_session_shows_its_numbers_when_it_is_unblinded(lab):
    lab.protocol.write_text(lab.protocol.read_text("utf-8") + "blind: true\n", "utf-8")

    async with lab.ready() as op:
        await op.arm(Stage.RESULT)
        await op.see("BLIND: results are hidden", "ACCEPTED")
        assert op.app.model.state.edges == ()
        for page in "4356":
            await op.press(page)
            await op.until(lambda page=page: op.app.action_of[page] == f"page_{op.app.model.page}")
            assert "± 0" not in text_of(op.app)
            assert not op.app.model.view.drops[op.app.model.view.jobs[0]].edges
        await op.keep()
        await op.play("it is unblinded")


async def test_a_second_screen_watches_and_can_only_stop(lab):
    async with lab.ready(countdown_s=600.0) as op, lab.operator(name="the other") as other:
        await other.until(lambda: other.app.model.view)
        assert not other.app.client.driving
        await op.arm(Stage.COUNTDOWN)
        await other.play("a second screen watches")
        assert op.app.model.flow.stage is Stage.COUNTDOWN
        await other.press("f9")
        await op.until(lambda: op.app.model.state.line(1).state == "interrupted")
        await op.play("the first gives control back")
        await other.until(lambda: other.app.model.state.holder is None)
        await other.press("c")
        await other.drive()
        other.app.driver.asked = op.app.driver.asked
        lab.protocol.write_text("protocol: 1\n", "utf-8")  # so it cannot be opened again
        lab.stop()
        await other.see("HOME", "fence.yaml:1:1: chains: missing")
        await op.at(Stage.PROTOCOL)
