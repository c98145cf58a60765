"""What comes next: one answer for the page's coloured line, the footer, and what Enter does."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rig.campaign.machine import Stage
from rig.tui.widgets.gates import named
from rig.tui.widgets.text import duration, plain

if TYPE_CHECKING:
    from rig.tui.model import Model


class NextStep(NamedTuple):
    """What Enter does, in the footer; empty where it does nothing. And what to do, on the page."""

    enter: str
    text: str
    color: str = "$primary"


_HANDS = {"holding": "Hold", "placing": "Place", "hanging": "Hang"}
_PASSING = {
    Stage.TESTING: "Testing the release; any key stops.",
    Stage.ARMING: "Arming …; any key stops.",
    Stage.FIRING: "Releasing …",
    Stage.JUDGING: "Reading and analysing the drop …",
}


_ONWARD = {
    Stage.PREPARE: ("to the run", "Enter goes to the run."),
    Stage.RESULT: ("next run", "Enter prepares the next run."),
    Stage.DONE: ("next run", "Enter prepares the next run."),
    Stage.HALTED: ("try again", "Mend the cause, then Enter prepares the run again."),
    Stage.DEVICE: (
        "to the first run",
        "Wave a hand through each beam. Enter goes to the first run.",
    ),
}


def hand(model: Model) -> str:
    """Name what is done by hand before a drop, in the scene's verb."""
    return _HANDS.get(model.words.reset.split()[0], "Set up")


def at_rest(model: Model) -> str:
    """Say how what falls waits, in the scene's words."""
    return "hang still" if model.words.part == "rod" else "come to rest"


def next_step(model: Model) -> NextStep:
    """Say what comes next where the session is now, on the page that is shown."""
    stage, left = model.stage, model.next_job is not None
    if model.offline:
        return NextStep("", "")
    if stage is Stage.COUNTDOWN:
        left_s = f"ARMED: release in {max(0.0, model.flow.left_s):.1f} s. Any key stops."
        other = "ARMED by another client. Keep clear."
        return NextStep("", left_s if model.driving else other, "$warning")
    if stage is Stage.SETTLING:
        wait = f"Waiting: let everything {at_rest(model)} …; any key stops."
        return NextStep("", wait, "$warning")
    if stage is Stage.LIVE:
        return NextStep("", f"FALLING  {len(model.state.edges)} edges so far")
    if stage in _PASSING:
        return NextStep("", _PASSING[stage], "$warning")
    if not model.driving and model.connected and stage is not Stage.PROTOCOL:
        return NextStep("", "Watching. Press c to take control when it is free.")
    if stage is Stage.PREPARE and model.page == "run":
        return _prepare(model)
    if stage is Stage.RESULT and not model.flow.logged:  # what comes next depends on it
        return NextStep("after the verdict is saved", "Saving the verdict …")
    if stage is Stage.PROTOCOL:
        return NextStep("open" if model.page == "protocol" else "home", "No session is open.")
    if stage in {Stage.RESULT, Stage.DONE} and not left:
        return NextStep("end" * (stage is Stage.RESULT), "All runs of the plan are complete.")
    return NextStep(*_ONWARD[stage])


def _prepare(model: Model) -> NextStep:
    """Say what is missing before the drop; the device refuses to arm until it is there."""
    indicators = model.indicators
    if not model.connected or model.state.link != "up":
        return NextStep("arm", "The device is not connected; Enter arms when it is.", "$warning")
    if not indicators.known:
        return NextStep("arm", "Waiting for the gates; Enter arms when they answer.", "$warning")
    if indicators.blocked:
        first, *more = indicators.blocked
        blocked = f"Clear the beam of {named(model, first)}{f' and {len(more)} more' * bool(more)}"
        return NextStep("arm", f"{blocked}; Enter arms when it is clear.", "$warning")
    if indicators.restless(model.now_s):
        moving = f"A beam keeps changing. Let everything {at_rest(model)}, then Enter arms."
        return NextStep("arm", moving, "$warning")
    run = model.run
    body = model.words.body
    if run is not None and run.impact is not None:
        beside = f" on the impact side, {plain(run.free, 20)} on the free side" * bool(run.free)
        body = f"{plain(run.impact, 20)}{beside}, board at {run.incline_deg:g}°"
    settle = duration(model.settle_s)
    return NextStep(
        "arm",
        f"{hand(model)} {body}; hands away. "
        f"Enter arms: {settle} of rest, 3 s of countdown, release.",
        "$success",
    )
