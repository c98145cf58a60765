"""Everything an operator can do, in one table: key, palette text, and the command that does it too.

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
    Action("stop", "f9", "STOP", "Stop: everything off, nothing falls", "Ctrl-C in rig run"),
    Action("go_on", "enter", "go on", "Go on: open, next run; on the run page, arm",
           "rig run PROTOCOL --port URL --session FILE",
           ANY - {*BEFORE_RELEASE, Stage.LIVE, Stage.JUDGING}, driving=True),
    Action("reject", "x", "reject", "Reject this drop for a reason, or take that back", "",
           _JUDGED, driving=True),
    Action("note", "n", "note", "Write a note to this drop, or change it", "", _JUDGED,
           driving=True),
    Action("again", "a", "again", "Another attempt at this run", "",
           frozenset({Stage.RESULT, Stage.HALTED, Stage.DONE}), driving=True),
    Action("unblind", "b", "unblind", "Show a blind session's numbers from now on; once",
           "rig unblind SESSION", _AT_REST, driving=True),
    Action("control", "c", "control", "Take control of the rig, or give it back", "", _AT_REST),
    Action("close", "z", "close", "Close the session; another protocol can be chosen", "",
           frozenset({Stage.DEVICE, Stage.PREPARE, Stage.HALTED, Stage.DONE}), driving=True),
    Action("release_test", "l", "try release", "Try the release with nothing hung",
           "rig selftest --port PORT --release",
           frozenset({Stage.DEVICE, Stage.PREPARE, Stage.DONE}), driving=True),
    Action("wave", "w", "wave", "Begin the wave-your-hand test and the counters again"),
    Action("page_protocol", "1,p", "protocol", "Page: protocol, its scene and plan",
           "rig check PROTOCOL"),
    Action("page_device", "2,d", "device", "Page: device, clock and gates", "rig selftest"),
    Action("page_run", "3,u", "run", "Page: the run in hand"),
    Action("page_result", "4,v", "result", "Page: result and verdict of the latest drop",
           "rig analyze SESSION"),
    Action("page_session", "5,s", "session", "Page: the session so far",
           "rig report SESSION -o FILE.html"),
    Action("page_history", "6,h", "history", "Page: any drop again, forwards and back",
           "rig replay SESSION"),
    Action("earlier", "left", "earlier", "History: back in time; elsewhere the plots' cursor left"),
    Action("later", "right", "later", "History: on in time; elsewhere the plots' cursor right"),
    Action("slower", "minus", "slower", "History: half the speed"),
    Action("faster", "plus", "faster", "History: twice the speed"),
    Action("play", "full_stop", "play", "History: play, or stand still"),
    Action("turn_round", "i", "turn", "History: play in the other direction"),
    Action("sessions", "o", "sessions", "History: another session"),
    Action("drops", "g", "drops", "History: another drop"),
    Action("filter", "f", "filter", "History: only some drops, by incline, chain or verdict"),
    Action("compare", "k", "compare", "History: all these drops in one picture, or one alone"),
    Action("report", "m", "report", "Write the session's report beside it",
           "rig report SESSION -o FILE.html"),
    Action("export", "e", "export", "Write the session's CSV files beside it",
           "rig export SESSION --csv DIR"),
    Action("control_chart", "y", "skew/g", "Session: skew or g in the control chart",
           two_chains=True),
    Action("previous", "up", "previous", "Previous drop, protocol or line"),
    Action("next", "down", "next", "Next drop, protocol or line"),
    Action("theme", "t", "theme", "Next theme: dark, light, high contrast"),
    Action("help", "question_mark,f1", "help", "What can be done here", "rig --help"),
    Action("palette", "ctrl+p", "palette", "Find an action by its name"),
    Action("quit", "q,ctrl+q", "quit", "Leave; a run goes on without this screen"),
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
    Stage.LIVE: "while chains fall",
    Stage.JUDGING: "while the drop is analysed",
    Stage.RESULT: "before this drop is done with",
    Stage.HALTED: "while the plan stands still",
    Stage.DONE: "when the plan is done",
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
    return "this scene has one chain" if action.two_chains and two_chains is False else ""


def shown_key(keys: str) -> str:
    """Write the first of an action's keys as it stands on a keyboard."""
    first = keys.partition(",")[0]
    names = {"question_mark": "?", "minus": "−", "plus": "+", "full_stop": ".", "enter": "Enter",
             "left": "←", "right": "→", "up": "↑", "down": "↓", "space": "Space"}  # fmt: skip
    if first in names:
        return names[first]
    return (
        "Ctrl-" + first[5:].upper()
        if first.startswith("ctrl+")
        else first.upper()[:12]
        if len(first) > 1
        else first
    )
