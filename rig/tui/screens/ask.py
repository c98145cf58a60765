"""Questions: a line to type, yes or no, one of a list. STOP works in all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual import on
from textual.widgets import Input, OptionList

from rig.tui.screens.dialog import Dialog, how, said
from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from textual.app import ComposeResult
    from textual.content import Content


class Ask(Dialog[str | None]):
    """Ask for one line; Enter gives it, Escape leaves it."""

    DEFAULT_CSS = "Ask Input { margin: 1 0 0 0; }"

    def __init__(self, question: str, text: str = "") -> None:
        super().__init__()
        self._question = question
        self._text = text

    def contents(self) -> ComposeResult:
        keys = how(("Enter", "save", "screen.say"), ("Esc", "cancel", "screen.leave"))
        yield said("question", (self._question, "bold"))
        yield Input(self._text, max_length=200, select_on_focus=False)
        yield said("how", keys)

    def on_mount(self) -> None:
        self.query(Input).focus()

    @on(Input.Submitted)
    def action_say(self) -> None:
        """Give what was typed."""
        self.dismiss(self.query_one(Input).value)


class AskReason(Dialog[str | None]):
    """Ask for a reason: one of a list, or one that is typed; without one it stays open."""

    DEFAULT_CSS = """
    AskReason > Vertical { width: 76; }
    AskReason OptionList { height: auto; border: none; padding: 0; background: $surface; }
    """

    def __init__(self, question: str, reasons: Sequence[str]) -> None:
        super().__init__()
        self._question = question
        self._reasons = reasons

    def contents(self) -> ComposeResult:
        self._keys = Words(id="how")
        options = OptionList(*self._reasons, markup=False)
        options.can_focus = False
        self._tell("Enter", "reject")
        yield said("question", (self._question, "bold"))
        yield Input(max_length=200, placeholder="type a reason, or choose below with ↑ ↓")
        yield options
        yield self._keys

    def on_mount(self) -> None:
        for options in self.query(OptionList):
            options.highlighted = None
        self.query(Input).focus()

    def _tell(self, key: str, text: str) -> None:
        self._keys.say_content(how((key, text, "screen.say"), ("Esc", "cancel", "screen.leave")))

    def move(self, by: int) -> None:
        """Go to the previous or next of the list."""
        options = self.query_one(OptionList)
        (options.action_cursor_down if by > 0 else options.action_cursor_up)()
        if options.highlighted is not None:
            self.query_one(Input).value = self._reasons[options.highlighted]

    @on(OptionList.OptionSelected)
    def _clicked(self, event: OptionList.OptionSelected) -> None:
        self.query_one(Input).value = self._reasons[event.option_index]

    @on(Input.Submitted)
    def action_say(self) -> None:
        """Give the reason, if there is one."""
        reason = self.query_one(Input).value.strip()
        if reason:
            self.dismiss(reason)
        else:
            self._tell("✗", "type or choose a reason first")


class Confirm(Dialog[bool | None]):
    """Ask for confirmation: Enter confirms, any other key cancels.

    A click never confirms: it is the second step of something, and the first may have been one.
    """

    DEFAULT_CSS = "Confirm > Vertical { border: heavy $warning; }"

    def __init__(self, title: str, question: str, yes: str) -> None:
        super().__init__()
        self._said = title, question
        self._yes = yes

    def contents(self) -> ComposeResult:
        title, question = self._said
        yield said("question", (f"{title}\n", "bold $warning"), question)
        yield said("how", how(("Enter", self._yes, ""), ("any other key", "stay", "screen.leave")))


class Pick(Dialog[int | None]):
    """Ask for one of several lines; keys and mouse as in any list."""

    DEFAULT_CSS = """
    Pick > Vertical { width: 110; }
    Pick OptionList, Pick OptionList:focus { height: auto; max-height: 24; border: none;
        padding: 0; background: $surface; text-wrap: nowrap; text-overflow: ellipsis; }
    """

    def __init__(self, question: str, lines: Sequence[Content], chosen: int) -> None:
        super().__init__()
        self._question = question
        self._lines = lines
        self._chosen = chosen

    def contents(self) -> ComposeResult:
        keys = how(("Enter", "choose", "screen.take"), ("Backspace", "cancel", "screen.leave"))
        yield said("question", (self._question, "bold"))
        yield OptionList(*self._lines, markup=False)
        yield said("how", keys)

    def on_mount(self) -> None:
        for chooser in self.query(OptionList):
            chooser.highlighted = self._chosen
            chooser.focus()

    @on(OptionList.OptionSelected)
    def action_take(self) -> None:
        """Give the highlighted line."""
        self.dismiss(self.query_one(OptionList).highlighted)
