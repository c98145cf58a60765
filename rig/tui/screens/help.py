"""Every action with its key and the equivalent command."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.containers import VerticalScroll
from textual.content import Content

from rig.tui.actions import BY_NAME, shown_key
from rig.tui.screens.dialogs import Dialog
from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.tui.actions import Action

PAGES = {
    "protocol": "Choose an experiment. ✗ shows what is wrong, with its line in the file.",
    "device": "Wave a hand through each beam: the page names the gate.",
    "run": "Prepare the run as shown, wait for every ✓, arm, and keep clear.",
    "result": "Read the verdict. Then continue, reject the drop with a reason, or write a note.",
    "session": "Compare the means with the model, and check the control charts.",
    "history": "Replay any drop, as slowly as you like.",
}
"""What an operator does on each page."""


GROUPS = {
    "At the rig": ("stop", "go_on", "again", "release_test", "wave", "control", "close"),
    "Judge a drop, write files": ("reject", "note", "unblind", "report", "export"),
    "Pages": ("page_protocol", "page_device", "page_run", "page_result", "page_session",
              "page_history", "previous", "next", "control_chart"),
    "Replay": ("play", "turn_round", "earlier", "later", "slower", "faster", "drops", "filter",
                    "compare", "sessions"),
    "This program": ("help", "palette", "theme", "quit"),
}  # fmt: skip
"""Every action under a heading."""


class Help(Dialog):
    """The table of actions; any key but the arrows closes it."""

    DEFAULT_CSS = "Help > Vertical { width: 96; max-width: 98%; height: 90%; }"

    def __init__(self, page: str, keys: Mapping[str, str]) -> None:
        lines = Words(id="table")
        super().__init__(VerticalScroll(lines, can_focus=False))
        lines.say(table(page, keys, self.app.size.width >= 100))

    def move(self, by: int) -> None:
        """Scroll."""
        self.query_one(VerticalScroll).scroll_relative(y=3 * by, animate=False)


def table(page: str, keys: Mapping[str, str], wide: bool) -> Content:
    """Write what can be done, one action a line."""
    lines = [
        Content.styled(PAGES.get(page, ""), "bold"),
        Content("STOP works on every screen: its key, Esc outside text fields, or the red bar."),
        Content(""),
    ]
    for head, names in GROUPS.items():
        lines.append(Content.styled(head, "bold"))
        lines += [_line(BY_NAME[name], keys, wide=wide) for name in names]
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
