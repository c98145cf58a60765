"""What all dialogs have in common: below them STOP goes on to be seen, and to work."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from textual.await_complete import AwaitComplete
from textual.containers import Vertical
from textual.content import Content
from textual.screen import ModalScreen
from textual.style import Style

from rig.tui.widgets.stopbar import StopLine
from rig.tui.widgets.text import Styled, Words

if TYPE_CHECKING:
    from textual.app import ComposeResult

Answer = TypeVar("Answer")


class Dialog(ModalScreen[Answer]):
    """Something to be answered, or to be read, before the page goes on."""

    DEFAULT_CSS = """
    Dialog { align: center middle; background: $background 60%; }
    Dialog > Vertical { width: 64; max-width: 96%; height: auto; max-height: 90%;
        border: heavy $primary; background: $surface; padding: 0 1; }
    Dialog > Vertical Words { height: auto; }
    Dialog #how { margin: 1 0 0 0; }
    """

    def compose(self) -> ComposeResult:
        with Vertical():
            yield from self.contents()
        yield StopLine()

    def contents(self) -> ComposeResult:
        """Make what stands in the dialog."""
        raise NotImplementedError

    def dismiss(self, result: Answer | None = None) -> AwaitComplete:
        """Give an answer, once: keys that follow each other quickly may ask for it again."""
        return super().dismiss(result) if self.is_active else AwaitComplete()

    def action_leave(self) -> None:
        """Give nothing."""
        self.dismiss(None)


def said(name: str, *parts: Styled | Content) -> Words:
    """Make text that stands there when it is mounted: a screen that ends mounts nothing more."""
    words = Words(id=name)
    words.say_content(Content.assemble(*parts))
    return words


def how(*ways: tuple[str, str, str]) -> Content:
    """Write what a dialog's keys do: key, words, and what a click on them does if anything."""
    parts: list[Content] = []
    for key, text, action in ways:
        said = Content.assemble((key, "bold $primary"), f" {text}")
        if action:
            said = said.stylize(Style.from_meta({"@click": action}))
        parts += [said, Content("   ")]
    return Content.assemble(*parts)
