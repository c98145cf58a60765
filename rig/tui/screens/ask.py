"""A question with a line to type the answer in; STOP works here too."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual import on
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input

from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from textual.app import ComposeResult


class Ask(ModalScreen[str | None]):
    """Ask for one line; Enter gives it, Escape leaves it."""

    DEFAULT_CSS = """
    Ask { align: center middle; background: $background 60%; }
    Ask Vertical { width: 64; max-width: 96%; height: auto; border: heavy $primary;
                   background: $surface; padding: 0 1; }
    Ask Words { height: auto; }
    Ask Input { margin: 1 0; }
    """

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
        self.query_one("#how", Words).say(
            ("Enter", "bold $primary"), " say so   ", ("Esc", "bold $primary"), " leave it   ",
            (f"{self._stop_key}", "bold $error"), " STOP",
        )  # fmt: skip
        self.query_one(Input).focus()

    @on(Input.Submitted)
    def _given(self, event: Input.Submitted) -> None:
        self.dismiss(event.value)
