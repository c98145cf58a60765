"""Everything an operator can do, in one table: key, palette text, and the equivalent command.

Keys, palette and help are made from it, and nothing else binds a key.
"""

from __future__ import annotations

from typing import NamedTuple

from rig.campaign.events import Stage
from rig.campaign.machine import BEFORE_RELEASE

ANY = frozenset(Stage)
_JUDGED = frozenset({Stage.RESULT})
_AT_REST = frozenset({Stage.DEVICE, Stage.PREPARE, Stage.RESULT, Stage.HALTED, Stage.DONE})


class Action(NamedTuple):
    """One thing to do.

    Attributes
    ----------
    name
        In keys.toml and in the program.
    keys
        As Textual names them, separated by commas; what the operator's file may change.
    label
        In the line of keys; short.
    text
        In palette and help.
    command
        The `rig` command that does the same; empty where only a screen can.
    stages
        Where it makes sense.
    driving
        Whether it needs control of the rig.
    two_chains
        Whether it is about what only a scene of two chains has.
    """

    name: str
    keys: str
    label: str
    text: str
    command: str = ""
    stages: frozenset[Stage] = ANY
    driving: bool = False
    two_chains: bool = False


ACTIONS: tuple[Action, ...] = (
    Action("stop", "f9", "STOP", "Stop: switch everything off", "Ctrl-C in rig run"),
    Action("go_on", "enter", "continue", "Continue: open, next run; on the run page, arm",
           "rig run PROTOCOL --port URL --session FILE",
           ANY - {*BEFORE_RELEASE, Stage.LIVE, Stage.JUDGING}, driving=True),
    Action("reject", "x", "reject", "Reject this drop with a reason, or undo that", "",
           _JUDGED, driving=True),
    Action("note", "n", "note", "Write or change a note on this drop", "", _JUDGED,
           driving=True),
    Action("again", "a", "repeat", "Repeat this run", "",
           frozenset({Stage.RESULT, Stage.HALTED, Stage.DONE}), driving=True),
    Action("unblind", "b", "unblind", "Show a blind session's numbers; cannot be undone",
           "rig unblind SESSION", _AT_REST, driving=True),
    Action("control", "c", "control", "Take control of the rig, or give it back", "", _AT_REST),
    Action("close", "z", "close", "Close the session and choose another protocol", "",
           frozenset({Stage.DEVICE, Stage.PREPARE, Stage.HALTED, Stage.DONE}), driving=True),
    Action("release_test", "l", "test release", "Test the release with nothing attached",
           "rig selftest --port PORT --release",
           frozenset({Stage.DEVICE, Stage.PREPARE, Stage.DONE}), driving=True),
    Action("wave", "w", "wave", "Restart the hand test of the gates and their counters"),
    Action("page_protocol", "1,p", "protocol", "Page: protocol, its scene and plan",
           "rig check PROTOCOL"),
    Action("page_device", "2,d", "device", "Page: device, clock and gates", "rig selftest"),
    Action("page_run", "3,u", "run", "Page: the current run"),
    Action("page_result", "4,v", "result", "Page: result and verdict of the latest drop",
           "rig analyze SESSION"),
    Action("page_session", "5,s", "session", "Page: plan, means and control charts",
           "rig report SESSION -o FILE.html"),
    Action("page_history", "6,h", "history", "Page: replay any drop, forwards or backwards",
           "rig replay SESSION"),
    Action("earlier", "left", "earlier", "History: back in time; other pages: plot cursor left"),
    Action("later", "right", "later", "History: forward in time; other pages: plot cursor right"),
    Action("slower", "minus", "slower", "History: half the speed"),
    Action("faster", "plus", "faster", "History: twice the speed"),
    Action("play", "full_stop", "play", "History: play or pause"),
    Action("turn_round", "i", "reverse", "History: play in the other direction"),
    Action("sessions", "o", "sessions", "History: choose another session"),
    Action("drops", "g", "drops", "History: choose another drop"),
    Action("filter", "f", "filter", "History: show only some drops, such as accepted"),
    Action("compare", "k", "compare", "History: all these drops in one picture, or only one"),
    Action("report", "m", "report", "Write the session's report beside it",
           "rig report SESSION -o FILE.html"),
    Action("export", "e", "export", "Write the session's CSV files beside it",
           "rig export SESSION --csv DIR"),
    Action("control_chart", "y", "skew/g", "Session: other quantity in the control chart",
           two_chains=True),
    Action("previous", "up", "previous", "Previous drop, protocol or line"),
    Action("next", "down", "next", "Next drop, protocol or line"),
    Action("theme", "t", "theme", "Change colours: dark, light, high contrast"),
    Action("help", "question_mark,f1", "help", "Show all keys", "rig --help"),
    Action("palette", "ctrl+p", "commands", "Search commands"),
    Action("quit", "q,ctrl+q", "quit", "Quit; the rig keeps running"),
)  # fmt: skip

BY_NAME = {action.name: action for action in ACTIONS}

OFFLINE = tuple(
    action.name
    for action in ACTIONS
    if not action.driving and action.name not in {"stop", "control", "wave"}
)
"""What can be done with a file and no rig."""


_NOT = {
    Stage.PROTOCOL: "before a session is open",
    Stage.DEVICE: "before the first run",
    Stage.TESTING: "during the test of the release",
    Stage.PREPARE: "before the drop",
    Stage.LIVE: "during the fall",
    Stage.JUDGING: "while the drop is analysed",
    Stage.RESULT: "before this drop is finished",
    Stage.HALTED: "while the plan is halted",
    Stage.DONE: "after the plan is complete",
}


def hindrance(
    action: Action, stage: Stage, *, driving: bool, two_chains: bool | None = None
) -> str:
    """Say why an action makes no sense now; empty where it does.

    Which scene it is may not be known yet.
    """
    if stage not in action.stages:
        return f"not {_NOT.get(stage, 'with the release armed')}"
    if action.driving and not driving:
        return "this screen only watches"
    return "not in this scene" if action.two_chains and two_chains is False else ""


def shown_key(keys: str) -> str:
    """Write the first of an action's keys as it stands on a keyboard."""
    first = keys.partition(",")[0]
    names = {"question_mark": "?", "minus": "−", "plus": "+", "full_stop": ".", "enter": "Enter",
             "left": "←", "right": "→", "up": "↑", "down": "↓", "space": "Space"}  # fmt: skip
    if first in names:
        return names[first]
    if first.startswith("ctrl+"):
        return "Ctrl-" + first[5:].upper()
    return first.upper()[:12] if len(first) > 1 else first
