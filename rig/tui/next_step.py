"""The next step: a common source for the page's coloured line, the footer, and Enter."""

from __future__ import annotations

from typing import NamedTuple

from rig.campaign.machine import Stage
from rig.tui.model import Model
from rig.tui.widgets.gates import label
from rig.tui.widgets.text import duration, plain


class NextStep(NamedTuple):
    """Effect of Enter for the footer (empty for none), and instruction for the page."""

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
    """Return the manual action before a drop, with the scene's verb."""
    return _HANDS.get(model.words.reset.split()[0], "Set up")


def at_rest(model: Model) -> str:
    """Return how chains or objects wait, in the scene's words."""
    return "hang still" if model.words.part == "rod" else "come to rest"


def next_step(model: Model) -> NextStep:
    """Return the next step for the present stage and page."""
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
    """Return the next preparation; the device refuses to arm before all are done."""
    indicators = model.indicators
    if not model.connected or model.state.link != "up":
        return NextStep("arm", "The device is not connected; Enter arms when it is.", "$warning")
    if not indicators.known:
        return NextStep("arm", "Waiting for the gates; Enter arms when they answer.", "$warning")
    if indicators.blocked_channels:
        first, *more = indicators.blocked_channels
        blocked = f"Clear the beam of {label(model, first)}{f' and {len(more)} more' * bool(more)}"
        return NextStep("arm", f"{blocked}; Enter arms when it is clear.", "$warning")
    if indicators.restless(model.now_s):
        moving = f"A beam keeps changing. Let everything {at_rest(model)}, then Enter arms."
        return NextStep("arm", moving, "$warning")
    run = model.run
    body = model.words.body
    if run is not None and run.impact is not None:
        beside = f" on the impact side, {plain(run.free, 20)} on the free side" * bool(run.free)
        body = f"{plain(run.impact, 20)}{beside}, board at {plain(run.set_up, 40)}"
    settle = duration(model.settle_s)
    return NextStep(
        "arm",
        f"{hand(model)} {body}; hands away. "
        f"Enter arms: {settle} of rest, 3 s of countdown, release.",
        "$success",
    )
