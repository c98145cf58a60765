"""Everything an operator can do, from the table ``actions.txt``: keys, palette and help.

Nothing else binds a key.
"""

from __future__ import annotations

from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from textual.content import Content

from rig.campaign.machine import Stage

if TYPE_CHECKING:
    from collections.abc import Mapping


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
    group
        Its heading in the help.
    driving
        Whether it needs control of the rig.
    """

    name: str
    keys: str
    label: str
    text: str
    command: str
    stages: frozenset[Stage]
    group: str
    driving: bool


def _read_row(row: str) -> Action:
    name, keys, label, text, command, stages, group = (cell.strip() for cell in row.split("|"))
    possible = frozenset(Stage if stages == "any" else map(Stage, stages.split()))
    bare = name.removesuffix("*")
    return Action(bare, keys, label, text, command, possible, group, bare != name)


_TABLE = Path(__file__).with_suffix(".txt").read_text("utf-8").splitlines()
ACTIONS = tuple(_read_row(row) for row in _TABLE if not row.startswith("#"))
BY_NAME = {action.name: action for action in ACTIONS}
NEEDS_RIG = {"stop", "control", "wave"}
"""What makes no sense with a file and no rig, beside all that needs control."""
_KEYS = {"question_mark": "?", "minus": "−", "plus": "+", "full_stop": ".", "enter": "Enter",
         "left": "←", "right": "→", "up": "↑", "down": "↓", "tab": "Tab"}  # fmt: skip
_HELP = """\
STOP works on every screen: its key, Esc outside text fields, or the red bar.
{table}
To change keys, write ~/.config/chainrig/keys.toml: reject = "r"
↑ ↓ scroll; any other key closes this page."""


def possible(action: Action, stage: Stage, *, driving: bool) -> bool:
    """Say whether an action makes sense now."""
    return stage in action.stages and (driving or not action.driving)


def shown_key(keys: str) -> str:
    """Write the first of an action's keys as it stands on a keyboard."""
    first = keys.partition(",")[0]
    if first.startswith("ctrl+"):
        return "Ctrl-" + first[5:].upper()
    return _KEYS.get(first, first.upper()[:12] if len(first) > 1 else first)


def help_text(keys: Mapping[str, str], *, wide: bool) -> Content:
    """Write what can be done, one action a line, with the command that does it too."""
    lines: list[str] = []
    for head, actions in groupby(ACTIONS, attrgetter("group")):
        lines += ["", head]
        for action in actions:
            line = f"  {shown_key(keys[action.name]):8}{action.text:62}"
            lines.append(line + action.command * wide)
    return Content(_HELP.format(table="\n".join(map(str.rstrip, lines))))
