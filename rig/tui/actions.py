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
    group
        Its heading in the help.
    """

    name: str
    keys: str
    label: str
    text: str
    command: str = ""
    stages: frozenset[Stage] = ANY
    driving: bool = False
    group: str = "This program"


_RIG, _JUDGE, _PAGES, _REPLAY = "At the rig", "Judge a drop, write files", "Pages", "Replay"
ACTIONS: tuple[Action, ...] = (
    Action("stop", "f9", "STOP", "Stop: switch everything off", "Ctrl-C in rig run", group=_RIG),
    Action("go_on", "enter", "continue", "Continue: open, next run; on the run page, arm",
           "rig run PROTOCOL --port URL --session FILE",
           ANY - {*BEFORE_RELEASE, Stage.LIVE, Stage.JUDGING}, driving=True, group=_RIG),
    Action("again", "a", "repeat", "Repeat this run", "",
           frozenset({Stage.RESULT, Stage.HALTED, Stage.DONE}), driving=True, group=_RIG),
    Action("release_test", "l", "test release", "Test the release with nothing attached",
           "rig selftest --port PORT --release",
           frozenset({Stage.DEVICE, Stage.PREPARE, Stage.DONE}), driving=True, group=_RIG),
    Action("wave", "w", "wave again", "Restart the hand test of the gates and their counters",
           group=_RIG),
    Action("control", "c", "control", "Take control of the rig, or give it back", "", _AT_REST,
           group=_RIG),
    Action("close", "z", "close", "Close the session and choose another experiment", "",
           frozenset({Stage.DEVICE, Stage.PREPARE, Stage.HALTED, Stage.DONE}), driving=True,
           group=_RIG),
    Action("reject", "x", "reject", "Reject this drop with a reason, or undo that", "",
           _JUDGED, driving=True, group=_JUDGE),
    Action("note", "n", "note", "Write or change a note on this drop", "", _JUDGED,
           driving=True, group=_JUDGE),
    Action("unblind", "b", "unblind", "Show a blind session's numbers; cannot be undone",
           "rig unblind SESSION", _AT_REST, driving=True, group=_JUDGE),
    Action("report", "m", "report", "Write the session's report beside it",
           "rig report SESSION -o FILE.html", group=_JUDGE),
    Action("export", "e", "export", "Write the session's CSV files beside it",
           "rig export SESSION --csv DIR", group=_JUDGE),
    Action("page_protocol", "1,p", "home", "Page: home, or the open session's protocol",
           "rig check PROTOCOL", group=_PAGES),
    Action("page_device", "2,d", "device", "Page: device, clock and gates", "rig selftest",
           group=_PAGES),
    Action("page_run", "3,u", "run", "Page: the current run", group=_PAGES),
    Action("page_result", "4,v", "result", "Page: result and verdict of the latest drop",
           "rig analyze SESSION", group=_PAGES),
    Action("page_session", "5,s", "session", "Page: plan, means and control charts",
           "rig report SESSION -o FILE.html", group=_PAGES),
    Action("page_history", "6,h", "history", "Page: replay any drop, forwards or backwards",
           "rig replay SESSION", group=_PAGES),
    Action("part", "tab", "more", "Turn to the rig, the plot or the tables", group=_PAGES),
    Action("control_chart", "y", "other plot", "Show another plot", group=_PAGES),
    Action("previous", "up", "up", "Previous drop or line; scroll", group=_PAGES),
    Action("next", "down", "down", "Next drop or line; scroll", group=_PAGES),
    Action("play", "full_stop", "play", "Replay: play or pause", group=_REPLAY),
    Action("turn_round", "i", "reverse", "Replay: play in the other direction", group=_REPLAY),
    Action("earlier", "left", "earlier", "Replay: back in time; other pages: plot cursor left",
           group=_REPLAY),
    Action("later", "right", "later", "Replay: forward in time; other pages: plot cursor right",
           group=_REPLAY),
    Action("slower", "minus", "slower", "Replay: half the speed", group=_REPLAY),
    Action("faster", "plus", "faster", "Replay: twice the speed", group=_REPLAY),
    Action("drops", "g", "drops", "History: choose another drop", group=_REPLAY),
    Action("filter", "f", "filter", "History: show only some drops, such as accepted",
           group=_REPLAY),
    Action("compare", "k", "compare", "History: all these drops in one picture, or only one",
           group=_REPLAY),
    Action("sessions", "o", "sessions", "History: choose another session", group=_REPLAY),
    Action("theme", "t", "theme", "Change colours: dark, light, high contrast"),
    Action("help", "question_mark,f1", "help", "Show all keys", "rig --help"),
    Action("palette", "ctrl+p", "more", "Search commands"),
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


def hindrance(action: Action, stage: Stage, *, driving: bool) -> str:
    """Say why an action makes no sense now; empty where it does."""
    if stage not in action.stages:
        return f"not {_NOT.get(stage, 'with the release armed')}"
    return "this screen only watches" if action.driving and not driving else ""


def shown_key(keys: str) -> str:
    """Write the first of an action's keys as it stands on a keyboard."""
    first = keys.partition(",")[0]
    names = {"question_mark": "?", "minus": "−", "plus": "+", "full_stop": ".", "enter": "Enter",
             "left": "←", "right": "→", "up": "↑", "down": "↓", "space": "Space",
             "tab": "Tab"}  # fmt: skip
    if first in names:
        return names[first]
    if first.startswith("ctrl+"):
        return "Ctrl-" + first[5:].upper()
    return first.upper()[:12] if len(first) > 1 else first
