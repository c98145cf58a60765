"""The next step: a common source for the page's coloured line, the footer, and Enter."""

from time import monotonic
from typing import NamedTuple

from rig.campaign.machine import Stage
from rig.text_rows import read_rows
from rig.tui.model import UNDER_WAY, Model
from rig.tui.widgets.gates import label
from rig.tui.widgets.text import duration, plain


class NextStep(NamedTuple):
    """Effect of Enter for the footer (empty for none), and instruction for the page."""

    enter: str
    text: str
    color: str


_HANDS = {"holding": "Hold", "placing": "Place", "hanging": "Hang"}
_PASSING = UNDER_WAY | {Stage.PROTOCOL}
_STEPS = {situation: NextStep(*cells) for situation, *cells in read_rows(__file__)}


def hand(model: Model) -> str:
    """Return the manual action before a drop, with the scene's verb."""
    return _HANDS.get(model.words.reset.split()[0], "Set up")


def next_step(model: Model) -> NextStep:
    """Return the next step for the present stage and page."""
    step = _STEPS[_situation(model)]
    text = step.text.format(
        left_s=max(0.0, model.flow.left_s),
        edges=len(model.state.edges),
        rest="hang still" if model.words.part == "rod" else "come to rest",
        beams=_blocked_beams(model),
        hand=hand(model),
        setup=_setup(model),
        settle=duration(model.settle_s),
    )
    return step._replace(text=text)


def _situation(model: Model) -> str:
    """Name the situation; the device refuses to arm before all preparations are done."""
    stage, indicators = model.stage, model.indicators
    elsewhere = model.page != "protocol" if stage is Stage.PROTOCOL else not model.client.driving
    cases = [
        (model.offline, "offline"),
        (elsewhere and stage in {Stage.PROTOCOL, Stage.COUNTDOWN}, f"{stage} elsewhere"),
        (stage in _PASSING, stage),
        (model.client.up and not model.client.driving, "watching"),
        # What comes next depends on the verdict.
        (stage is Stage.RESULT and not model.flow.logged, "unsaved"),
        (
            stage in {Stage.RESULT, Stage.DONE} and model.runs and model.next_job is None,
            f"{stage} last",
        ),
        (stage is not Stage.PREPARE or model.page != "run", stage),
        (not model.client.up or model.state.link != "up", "no device"),
        (not indicators.known, "no gates"),
        (indicators.blocked_channels, "blocked"),
        (indicators.restless(monotonic()), "moving"),
    ]
    return next((situation for holds, situation in cases if holds), "ready")


def _blocked_beams(model: Model) -> str:
    channels = model.indicators.blocked_channels
    more = f" and {len(channels) - 1} more" * (len(channels) > 1)
    return f"{label(model, channels[0])}{more}" if channels else ""


def _setup(model: Model) -> str:
    """Return what is set up before a run, in the scene's words."""
    run = model.run
    if run is None or run.impact is None:
        return model.words.body
    beside = f" on the impact side, {plain(run.free, 20)} on the free side" * bool(run.free)
    return f"{plain(run.impact, 20)}{beside}, board at {plain(run.set_up, 40)}"
