"""Questions: a line to type, yes or no, one of a list. STOP works in all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual import on
from textual.containers import Vertical
from textual.content import Content
from textual.screen import ModalScreen
from textual.style import Style
from textual.widgets import Input, OptionList

from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from textual.app import ComposeResult

_CSS = """
NAME { align: center middle; background: $background 60%; }
NAME > Vertical { width: 64; max-width: 96%; height: auto; max-height: 90%; border: heavy $primary;
                  background: $surface; padding: 0 1; }
NAME Words { height: auto; }
NAME #how { margin: 1 0 0 0; }
"""


class Ask(ModalScreen[str | None]):
    """Ask for one line; Enter gives it, Escape leaves it."""

    DEFAULT_CSS = _CSS.replace("NAME", "Ask") + "Ask Input { margin: 1 0 0 0; }"

    def __init__(self, question: str, stop_key: str) -> None:
        super().__init__()
        self._question = question
        self._stop_key = stop_key

    def compose(self) -> ComposeResult:
        with Vertical():
            yield Words(id="question")
            yield Input(max_length=200)
            yield Words(id="how")

    def on_mount(self) -> None:
        self.query_one("#question", Words).say((self._question, "bold"))
        self.query_one("#how", Words).say_content(
            _how(("Enter", "say so", "screen.say"), ("Esc", "leave it", "screen.leave"),
                 stop=self._stop_key)
        )  # fmt: skip
        self.query_one(Input).focus()

    @on(Input.Submitted)
    def action_say(self) -> None:
        """Give what was typed."""
        self.dismiss(self.query_one(Input).value)

    def action_leave(self) -> None:
        """Give nothing."""
        self.dismiss(None)


class Confirm(ModalScreen[bool | None]):
    """Ask whether something is really wanted; Enter means it, any other key leaves it."""

    DEFAULT_CSS = _CSS.replace("NAME", "Confirm") + "Confirm > Vertical { border: heavy $warning; }"

    def __init__(self, title: str, question: str, yes: str, stop_key: str) -> None:
        super().__init__()
        self._said = title, question
        self._yes = yes
        self._stop_key = stop_key

    def compose(self) -> ComposeResult:
        with Vertical():
            yield Words(id="question")
            yield Words(id="how")

    def on_mount(self) -> None:
        title, question = self._said
        self.query_one("#question", Words).say((f"{title}\n", "bold $warning"), question)
        self.query_one("#how", Words).say_content(
            _how(("Enter", self._yes, "screen.answer(True)"),
                 ("any other key", "leave it", "screen.answer(False)"), stop=self._stop_key)
        )  # fmt: skip

    def action_answer(self, yes: bool) -> None:
        """Answer by mouse."""
        self.dismiss(yes)


class Pick(ModalScreen[int | None]):
    """Ask for one of several lines; keys and mouse as in any list."""

    DEFAULT_CSS = (
        _CSS.replace("NAME", "Pick")
        + """
    Pick > Vertical { width: 110; }
    Pick OptionList, Pick OptionList:focus { height: auto; max-height: 24; border: none;
        padding: 0; background: $surface; text-wrap: nowrap; text-overflow: ellipsis; }
    """
    )

    def __init__(self, question: str, lines: Sequence[Content], chosen: int, stop_key: str) -> None:
        super().__init__()
        self._question = question
        self._lines = lines
        self._chosen = chosen
        self._stop_key = stop_key

    def compose(self) -> ComposeResult:
        with Vertical():
            yield Words(id="question")
            yield OptionList(*self._lines, markup=False)
            yield Words(id="how")

    def on_mount(self) -> None:
        self.query_one("#question", Words).say((self._question, "bold"))
        self.query_one("#how", Words).say_content(
            _how(("Enter", "take it", "screen.take"), ("Backspace", "leave", "screen.leave"),
                 stop=self._stop_key)
        )  # fmt: skip
        chooser = self.query_one(OptionList)
        chooser.highlighted = self._chosen
        chooser.focus()

    @on(OptionList.OptionSelected)
    def action_take(self) -> None:
        """Give the highlighted line."""
        self.dismiss(self.query_one(OptionList).highlighted)

    def action_leave(self) -> None:
        """Give nothing."""
        self.dismiss(None)


def _how(*ways: tuple[str, str, str], stop: str) -> Content:
    """Write what a dialog's keys do; each can be clicked."""
    parts: list[Content] = []
    for key, text, action in (*ways, (stop, "STOP", "app.do('stop')")):
        press = Style.from_meta({"@click": action})
        color = "bold $error" if text == "STOP" else "bold $primary"
        parts.append(Content.assemble((key, color), f" {text}").stylize(press))
        parts.append(Content("   "))
    return Content.assemble(*parts)
