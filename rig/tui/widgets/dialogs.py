"""Dialogs over a page. STOP remains visible below every dialog, and works."""

from collections.abc import Sequence
from typing import Any, ClassVar

from textual import events
from textual.app import ComposeResult
from textual.await_complete import AwaitComplete
from textual.containers import Vertical, VerticalScroll
from textual.content import Content
from textual.fuzzy import Matcher
from textual.screen import ModalScreen
from textual.widget import Widget
from textual.widgets import Input, OptionList
from textual.widgets.option_list import Option

from rig.tui.widgets.text import Words


class Dialog(ModalScreen[Any]):
    """A dialog that must be answered or read before the page continues.

    Parameters
    ----------
    parts
        Content of the dialog.
    keys
        Description of its keys.
    """

    BINDINGS: ClassVar = [("up", "move(-1)"), ("down", "move(1)")]

    def __init__(self, *parts: Widget, keys: str = " ", large: bool = False) -> None:
        super().__init__(classes="-large" * large)
        self._parts = [*parts, Words((keys, "bold $primary"), id="how")]

    def compose(self) -> ComposeResult:
        with Vertical():
            yield from self._parts
        yield Words(id="stop")

    def dismiss(self, result: Any = None) -> AwaitComplete:
        """Close with an answer, once: keys in quick succession may repeat it."""
        return super().dismiss(result) if self.is_active else AwaitComplete()


class Confirm(Dialog):
    """Ask for confirmation: Enter confirms, any other key cancels.

    A click never confirms, as it may be the second half of a double click on the page.
    """

    def __init__(self, title: str, question: str, yes: str) -> None:
        words = Words((f"{title}\n", "bold $warning"), question, id="question")
        super().__init__(words, keys=f"Enter: {yes}   any other key: stay")


class TextDialog(Dialog):
    """A long text; any key but the arrows closes it."""

    def __init__(self, text: Content) -> None:
        super().__init__(VerticalScroll(Words(text, id="table"), can_focus=False), large=True)

    def action_move(self, by: int) -> None:
        """Scroll."""
        self.query_one(VerticalScroll).scroll_relative(y=3 * by, animate=False)


class _Choices(OptionList):
    """A list that changes while typing: a clicked item may be gone when the click is handled."""

    can_focus = False

    async def _on_click(self, event: events.Click) -> None:
        at = event.style.meta.get("option")
        if at is not None and at >= self.option_count:
            event.prevent_default()


class Ask(Dialog):
    """Ask for a line of text; Enter accepts, Escape cancels.

    Parameters
    ----------
    text
        Initial text.
    choices
        Choices instead of typing.
    chosen
        The choice that is highlighted first: the text then searches the choices, and the answer is
        the number of a choice. If `None`, other (not empty) text may be typed.
    """

    BINDINGS: ClassVar = [("escape", "dismiss")]

    def __init__(
        self,
        question: str,
        text: str = "",
        choices: Sequence[str] = (),
        *,
        yes: str = "save",
        chosen: int | None = None,
    ) -> None:
        free = chosen is None
        hint = "type to search" if not free else "type, or choose below with ↑ ↓" if choices else ""
        line = Input(text, max_length=200, select_on_focus=False, placeholder=hint)
        self._choices, self._free, self._first = choices, free, chosen
        self._list = _Choices(*self._matching(""), markup=False)
        keys = f"{'↑ ↓ ' * bool(choices)}Enter: {yes}   Esc: cancel"
        words = Words((question, "bold"), id="question")
        super().__init__(words, line, self._list, keys=keys, large=bool(choices))

    def on_mount(self) -> None:
        self._list.highlighted = self._first

    def _matching(self, query: str) -> list[Option]:
        """Return the choices that match, each with its number."""
        matcher, choices = Matcher(query), enumerate(self._choices)
        return [Option(text, str(at)) for at, text in choices if not query or matcher.match(text)]

    def on_input_changed(self, event: Input.Changed) -> None:
        """Show the choices that match."""
        if not self._free:
            self._list.set_options(self._matching(event.value))
            self._list.action_first()

    def action_move(self, by: int) -> None:
        """Select the previous or next choice."""
        (self._list.action_cursor_down if by > 0 else self._list.action_cursor_up)()
        if self._free and self._list.highlighted is not None:
            self.query_one(Input).value = self._choices[self._list.highlighted]

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Take a choice that was clicked."""
        if self._free:
            self.query_one(Input).value = self._choices[event.option_index]
        else:
            self.on_input_submitted()

    def on_input_submitted(self) -> None:
        """Answer with the text, or the number of the choice."""
        typed, option = self.query_one(Input).value, self._list.highlighted_option
        if not self._free:
            self.dismiss(int(option.id) if option is not None and option.id else None)
        elif typed.strip() or not self._choices:
            self.dismiss(typed)
        else:
            self.query_one("#how", Words).say("✗ type or choose a reason first")
