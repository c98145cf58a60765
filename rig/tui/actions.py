"""All actions of the operator, from the table ``actions.txt``: keys, palette and help.

Keys are bound only here.
"""

from collections.abc import Iterable, Mapping
from itertools import groupby
from operator import attrgetter
from typing import NamedTuple

from textual.content import Content

from rig.campaign.machine import Stage
from rig.text_rows import read_rows


class Action(NamedTuple):
    """An action of the operator.

    Attributes
    ----------
    name
        Name in keys.toml and in the program.
    keys
        Keys in Textual's names, separated by commas; the operator's file may change them.
    label
        Short text for the line of keys.
    text
        Text for palette and help.
    command
        The `rig` command that does the same; empty if there is none.
    stages
        Stages in which the action is possible.
    group
        Heading in the help.
    driving
        Whether the action needs control of the rig.
    """

    name: str
    keys: str
    label: str
    text: str
    command: str
    stages: frozenset[Stage]
    group: str
    driving: bool


def _action(cells: Iterable[str]) -> Action:
    name, keys, label, text, command, stages, group = cells
    possible = frozenset(Stage if stages == "any" else map(Stage, stages.split()))
    bare = name.removesuffix("*")
    return Action(bare, keys, label, text, command, possible, group, bare != name)


ACTIONS = tuple(map(_action, read_rows(__file__)))
BY_NAME = {action.name: action for action in ACTIONS}
PAGES = read_rows(__file__, "pages.txt")
"""Pages in the order of their tabs: name, module, stages and keys, see the table."""
NEEDS_RIG = {"stop", "control", "wave"}
"""Actions that need a rig but no control."""
_SIGNS = "question_mark=? minus=− plus=+ full_stop=. left=← right=→ up=↑ down=↓ enter=Enter tab=Tab"
_KEYS = dict(pair.split("=") for pair in _SIGNS.split())
_HELP = """\
STOP works on every screen: its key, Esc outside text fields, or the red bar.
{table}
To change keys, write ~/.config/chainrig/keys.toml: reject = "r"
↑ ↓ scroll; any other key closes this page."""


def shown_key(keys: str) -> str:
    """Return the first key of an action as labelled on a keyboard."""
    first = keys.partition(",")[0]
    if first.startswith("ctrl+"):
        return "Ctrl-" + first[5:].upper()
    return _KEYS.get(first, first.upper()[:12] if len(first) > 1 else first)


def help_text(keys: Mapping[str, str], *, wide: bool) -> Content:
    """Return the help: a line for each action, with the equivalent command."""
    lines: list[str] = []
    for head, actions in groupby(ACTIONS, attrgetter("group")):
        lines += ["", head]
        for row in actions:
            lines.append(f"  {shown_key(keys[row.name]):8}{row.text:62}{row.command * wide}")
    return Content(_HELP.format(table="\n".join(map(str.rstrip, lines))))
