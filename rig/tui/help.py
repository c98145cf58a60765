"""Every action with its key and the equivalent command."""

from __future__ import annotations

from itertools import groupby
from operator import attrgetter
from typing import TYPE_CHECKING

from textual.content import Content

from rig.tui.actions import ACTIONS, shown_key

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.tui.actions import Action

PAGES = {
    "protocol": "Choose what to begin with. ✗ shows what is wrong, with its line in the file.",
    "device": "Wave a hand through each beam: the page names the gate.",
    "run": "Prepare the run as shown, wait for every ✓, arm, and keep clear.",
    "result": "Read the verdict. Then continue, reject the drop with a reason, or write a note.",
    "session": "Compare the means with the model, and check the control charts.",
    "history": "Replay any drop, as slowly as you like.",
}
"""What an operator does on each page."""


def table(page: str, keys: Mapping[str, str], wide: bool) -> Content:
    """Write what can be done, one action a line."""
    lines = [
        Content.styled(PAGES.get(page, ""), "bold"),
        Content("STOP works on every screen: its key, Esc outside text fields, or the red bar."),
        Content(""),
    ]
    for head, actions in groupby(ACTIONS, attrgetter("group")):
        lines.append(Content.styled(head, "bold"))
        lines += [_line(action, keys, wide=wide) for action in actions]
        lines.append(Content(""))
    own = 'To change keys, write ~/.config/chainrig/keys.toml: reject = "r"'
    lines += [Content(own), Content("↑ ↓ scroll; any other key closes this page.")]
    return Content("\n").join(lines)


def _line(action: Action, keys: Mapping[str, str], *, wide: bool) -> Content:
    """Write one action: key, what it does, and the command that does it too."""
    command = f"  {action.command}" if wide and action.command else ""
    return Content.assemble(
        (f"{shown_key(keys[action.name]):8}", "bold $primary"),
        f"{action.text:62}" if command else action.text,
        (command, "$foreground 70%"),
    )
