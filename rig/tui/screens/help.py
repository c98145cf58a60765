"""Every action with its key and the command that does the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.containers import VerticalScroll
from textual.content import Content

from rig.tui.actions import ACTIONS, shown_key
from rig.tui.screens.dialog import Dialog
from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from collections.abc import Mapping

    from textual.app import ComposeResult

PAGES = {
    "protocol": "Choose what is to be dropped. ✗ shows what is wrong, with its line in the file.",
    "device": "See that every gate answers: wave a hand through each beam, and it is named.",
    "run": "Hang the chains as told, see the checks turn ✓, arm, and keep clear.",
    "result": "Read the verdict, then acknowledge it, reject the drop with a cause, or add a note.",
    "session": "Watch the means settle on the model's curve, and the skew stay within its limits.",
    "history": "Play any drop again, as slowly as you like.",
}
"""What an operator does on each page."""


class Help(Dialog[None]):
    """The table of actions; any key but the arrows closes it."""

    DEFAULT_CSS = "Help > Vertical { width: 96; max-width: 98%; height: 90%; }"

    def __init__(self, page: str, keys: Mapping[str, str]) -> None:
        super().__init__()
        self._page = page
        self._keys = keys

    def contents(self) -> ComposeResult:
        with VerticalScroll(can_focus=False):
            yield Words(id="table")

    def on_mount(self) -> None:
        self.query_one("#table", Words).say_content(
            table(self._page, self._keys, self.app.size.width >= 100)
        )

    def move(self, by: int) -> None:
        """Scroll."""
        self.query_one(VerticalScroll).scroll_relative(y=3 * by, animate=False)


def table(page: str, keys: Mapping[str, str], wide: bool) -> Content:
    """Write what can be done, one action a line."""
    lines = [
        Content.styled(PAGES.get(page, ""), "bold"),
        Content("STOP works on every screen: its key, Esc where nothing is typed, or the red bar."),
        Content(""),
    ]
    for action in ACTIONS:
        command = f"  {action.command}" if wide and action.command else ""
        lines.append(
            Content.assemble(
                (f"{shown_key(keys[action.name]):8}", "bold $primary"),
                f"{action.text:56}" if command else action.text,
                (command, "$foreground 70%"),
            )
        )
    own = 'Other keys: ~/.config/chainrig/keys.toml, such as reject = "r"'
    lines += [Content(""), Content(own), Content("↑ and ↓ scroll, any other key closes this.")]
    return Content("\n").join(lines)
