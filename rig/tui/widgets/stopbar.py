"""The bottom of every screen: what can be done now, and STOP."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.containers import Vertical
from textual.content import Content

from rig.campaign.events import Stage
from rig.tui.actions import BY_NAME, OFFLINE, hindrance, shown_key
from rig.tui.widgets.text import Words, pressed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from textual.app import ComposeResult

    from rig.tui.model import Model

_ALWAYS = ("help", "palette", "quit")
_FIRST = ("go_on", "reject", "note", "again", "control", "unblind")
_GO_ON = {
    Stage.PROTOCOL: "open session",
    Stage.DEVICE: "to the first run",
    Stage.PREPARE: "arm",
    Stage.RESULT: "next run",
    Stage.HALTED: "try again",
    Stage.DONE: "next run",
}
_OF_PAGE = {
    "history": ("play", "turn_round", "earlier", "later", "slower", "faster", "drops", "filter",
                "compare", "sessions"),
    "device": ("go_on", "wave", "release_test"),
    "session": ("go_on", "control_chart", "again", "report"),
}  # fmt: skip
"""What is wanted most on some pages."""


class StopLine(Words):
    """The bar that stops everything, also by mouse, and what there is to be stopped."""

    DEFAULT_CSS = """
    StopLine { dock: bottom; height: 1; padding: 0 1; background: $error 25%; color: $foreground; }
    StopLine.-hot { background: $error; color: $background; text-style: bold; }
    """

    def show(self, model: Model, keys: Mapping[str, str]) -> None:
        """Draw what holds now."""
        self.set_class(model.hot, "-hot")
        stop = Content(f" ■ STOP  {shown_key(keys['stop'])} or Esc ")
        self.say(pressed(stop, "app.do('stop')"), f"  {_doing(model)}")


class StopBar(Vertical):
    """Keys of this page, and the bar that stops everything, also by mouse."""

    DEFAULT_CSS = """
    StopBar { dock: bottom; height: 2; }
    StopBar #hints { height: 1; padding: 0 1; background: $panel; color: $foreground; }
    """

    def compose(self) -> ComposeResult:
        yield Words(id="hints")
        yield StopLine()

    def show(self, model: Model, page: str, keys: Mapping[str, str], width: int) -> None:
        """Draw what holds now."""
        self.query_one("#hints", Words).say(hints(model, page, keys, width - 2))


def hints(model: Model, page: str, keys: Mapping[str, str], width: int) -> Content:
    """Write as many keys as fit, the most wanted first."""
    first = _OF_PAGE.get(page, ())
    flow = () if page == "history" else _FIRST
    names = dict.fromkeys((*first, *(("help",) if first else ()), *flow, *_ALWAYS))
    parts: list[Content] = []
    used = 0
    for name in names:
        action = BY_NAME[name]
        if (model.offline and name not in OFFLINE) or (name == "unblind" and not model.blind):
            continue
        if hindrance(action, model.flow.stage, driving=model.driving, two_chains=model.two_chains):
            continue
        label = _label(name, action.label, model, page)
        text = f"{shown_key(keys[name])} {label}"
        if used + len(text) + 2 > width:
            break
        used += len(text) + 2
        hint = Content.assemble((shown_key(keys[name]), "bold $primary"), f" {label}")
        parts += [pressed(hint, f"app.do('{name}')"), Content("  ")]
    return Content.assemble(*parts)


def _label(name: str, label: str, model: Model, page: str) -> str:
    if name == "go_on":
        if model.flow.stage is Stage.PREPARE and page != "run":
            return "to the run"
        if not model.flow.logged:  # what comes next depends on it
            return "after the verdict is saved"
        return _GO_ON.get(model.flow.stage, label)
    if name == "reject" and model.flow.verdict == "rejected":
        return "undo rejection"
    if name == "control":
        return "give control back" if model.driving else "take control"
    return label


_TOLD_S = 4.0
_UNANSWERED_S = 0.5


def _answer(model: Model) -> str:
    """Say what became of a STOP that was pressed just now."""
    if model.stop is None:
        return ""
    waited = model.now_s - model.stop.at_s
    unheard = model.stop.heard is False or (model.stop.heard is None and waited > _UNANSWERED_S)
    if waited > _TOLD_S and (model.connected or not unheard):
        return ""
    if unheard:
        return "STOP NOT CONFIRMED: switch the release's supply off"
    return "STOP: everything is off" if model.stop.heard else "STOP …"


def _doing(model: Model) -> str:
    words = {
        Stage.TESTING: "RELEASE TEST; any key stops",
        Stage.SETTLING: "waiting for rest; any key stops",
        Stage.ARMING: "arming; any key stops",
        Stage.COUNTDOWN: f"ARMED: release in {max(0.0, model.flow.left_s):.1f} s; any key stops"
        if model.driving
        else "ARMED by another client",
        Stage.FIRING: "releasing",
        Stage.LIVE: "FALLING, recording",
        Stage.JUDGING: "reading and analysing the drop",
    }
    if model.offline:
        return "no rig is connected: this shows a file"
    if not model.connected:
        return _answer(model) or "no daemon: nothing can be stopped from here"
    answer = _answer(model)
    if answer and not model.hot:
        return answer
    holder = model.state.holder
    watching = "" if model.driving or holder is None else f" · watching {holder[:24]}"
    return words.get(model.stage, model.state.phase) + watching + " · " * bool(answer) + answer
