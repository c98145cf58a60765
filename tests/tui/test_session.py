"""A session driven by keys, against the daemon with a simulated rig."""

from dataclasses import replace

from rig.campaign.machine import Stage
from rig.session.schema import RunState
from rig.session.store import Session
from rig.tui.commands import REASONS
from rig.tui.widgets.dialogs import Ask
from tests.tui.lab import flat, text_of


async def test_a_drop_is_rejected_with_a_cause_and_noted(lab):
    rung = []

    async with lab.ready() as op:
        op.app.options = replace(op.app.options, bell=True)
        op.app.bell = lambda: rung.append(op.app.flow.stage)
        await op.arms(Stage.RESULT)
        await op.until(lambda: op.app.flow.logged and rung)
        await op.press("n", *"[/b] hn", "enter")
        await kept(op, "note: [/b] hn")
        await op.press("n", "backspace", "m", "enter")  # what is there is changed
        await kept(op, "note: [/b] hm")
        assert rung == [Stage.RESULT]
        await op.press("x", "escape")
        assert op.app.flow.verdict == "accepted"
        await op.press("x")
        await op.until(lambda: isinstance(op.app.screen, Ask))
        await op.until(pressed_and_seen(op, "enter", "type or choose a reason first"))
        await op.press(*"draught", "enter")
        await kept(op, "REJECTED", "draught", "note: [/b] hm")
        await op.press("x")
        await op.means()
        await op.until(lambda: op.app.flow.verdict == "accepted" and op.app.flow.logged)
        await op.press("x", "down", "enter")
        await kept(op, "REJECTED", REASONS[0])
        await op.press("a")
        await op.means()
        await op.arms(Stage.RESULT)
        await kept(op)
        await op.press("x")
        await op.press("escape")
        await op.press("a")
        await op.sees("the new attempt will count instead")
        await op.means()
        await op.arms(Stage.RESULT)
        await kept(op)
        await op.press("x")
        await op.sees("attempt 2 was good")
        await op.press("down", "down", "enter")
        await kept(op, "attempt 2 was good, but run 1 has no result now")
        await op.press("enter")
        await op.at(Stage.PREPARE)
        await op.sees("Run 2 of 3")
        await op.press("z")
        await op.means()
        await op.at(Stage.PROTOCOL)
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


async def kept(op, *texts):
    """See that texts stand on the screen, and wait until the session has what they say."""
    await op.sees(*texts)
    await op.until(lambda: op.app.flow.logged)


def pressed_and_seen(op, key, text):
    """Press a key until a text stands on the screen."""

    async def there():
        await op.press(key)
        return text in flat(op.app)

    return there


async def test_a_blind_session_shows_its_numbers_when_it_is_unblinded(lab):
    lab.protocol.write_text(lab.protocol.read_text("utf-8") + "blind: true\n", "utf-8")

    async with lab.ready() as op:
        await op.arms(Stage.RESULT)
        await op.sees("BLIND: results are hidden", "ACCEPTED")
        assert op.app.follower.state.edges == ()
        for page in "4356":
            await op.press(page)
            await op.until(lambda page=page: op.app.action_of[page] == f"page_{op.app.page}")
            assert "± 0" not in text_of(op.app)
            assert not op.app.follower.view.drops[op.app.follower.view.jobs[0]].edges
        await kept(op)
        await op.press("4", "b")
        await op.means()
        await op.sees("ACCEPTED", "m/s²", "± 0")
        await op.press("b")
        await op.sees("this session is not blind")


async def test_a_second_screen_watches_and_can_only_stop(lab):
    async with lab.ready(countdown_s=600.0) as op, lab.operator(name="the other") as other:
        await other.until(lambda: other.app.follower.view)
        assert not other.app.client.driving
        await op.arms(Stage.COUNTDOWN)
        await other.sees("ARMED by another client", "watching rig tui")
        await other.press("k", "enter")
        await other.sees("this screen only watches")
        assert op.app.flow.stage is Stage.COUNTDOWN
        await other.press("f9")
        await op.until(lambda: op.app.follower.state.line(1).state == "interrupted")
        await op.at(Stage.PREPARE)  # only at rest is control given back
        await op.sees("stopped by the operator: nothing fell")
        await op.press("c")
        await op.means()
        await other.until(lambda: other.app.follower.state.holder is None)
        await other.press("c")
        await other.until(lambda: other.app.client.driving)
