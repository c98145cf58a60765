"""What is asked over a page. Below every dialog STOP goes on to be seen, and to work."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from textual import events, on
from textual.await_complete import AwaitComplete
from textual.containers import Vertical
from textual.content import Content
from textual.fuzzy import Matcher
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList
from textual.widgets.option_list import Option

from rig.tui.actions import ACTIONS, shown_key
from rig.tui.widgets.stopbar import StopLine
from rig.tui.widgets.text import Words, pressed

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from textual.app import ComposeResult
    from textual.widget import Widget

    from rig.tui.actions import Action

_CANCEL = ("Esc", "cancel", "screen.leave")


class Dialog(ModalScreen[Any]):
    """Something to be answered, or to be read, before the page goes on.

    Parameters
    ----------
    parts
        What stands in it.
    keys
        What its keys do: key, words, and what a click on them does if anything.
    """

    DEFAULT_CSS = """
    Dialog { align: center middle; background: $background 60%; }
    Dialog > Vertical { width: 64; max-width: 96%; height: auto; max-height: 90%;
        border: heavy $primary; background: $surface; padding: 0 1; }
    Dialog > Vertical Words { height: auto; }
    Dialog #how { margin: 1 0 0 0; }
    Dialog OptionList, Dialog OptionList:focus { height: auto; max-height: 24; border: none;
        padding: 0; background: $surface; text-wrap: nowrap; text-overflow: ellipsis; }
    """
    LEAVE = ""
    """The key that cancels; empty: any that means nothing else."""
    first: int | None = None
    """The line of the list, if there is one, that is highlighted at first."""

    def __init__(self, *parts: Widget, keys: Sequence[tuple[str, str, str]] = ()) -> None:
        super().__init__()
        self._parts = [*parts, Words(how(*keys), id="how")] if keys else parts

    def compose(self) -> ComposeResult:
        with Vertical():
            yield from self._parts
        yield StopLine()

    def on_mount(self) -> None:
        for options in self.query(OptionList):
            options.highlighted = self.first
        self.query("Input, OptionList").focus()

    def move(self, by: int) -> None:
        """Go to the previous or next of the list, if there is one."""
        for options in self.query(OptionList):
            (options.action_cursor_down if by > 0 else options.action_cursor_up)()

    def dismiss(self, result: Any = None) -> AwaitComplete:
        """Give an answer, once: keys that follow each other quickly may ask for it again."""
        return super().dismiss(result) if self.is_active else AwaitComplete()

    def action_leave(self) -> None:
        """Give nothing."""
        self.dismiss(None)


def how(*ways: tuple[str, str, str]) -> Content:
    """Write what a dialog's keys do."""
    parts: list[Content] = []
    for key, text, action in ways:
        label = Content.assemble((key, "bold $primary"), f" {text}")
        parts += [pressed(label, action) if action else label, Content("   ")]
    return Content.assemble(*parts)


def _heading(question: str) -> Words:
    return Words((question, "bold"), id="question")


class Ask(Dialog):
    """Ask for one line; Enter gives it, Escape leaves it."""

    DEFAULT_CSS = "Ask Input { margin: 1 0 0 0; }"
    LEAVE = "escape"

    def __init__(self, question: str, text: str = "") -> None:
        line = Input(text, max_length=200, select_on_focus=False)
        super().__init__(_heading(question), line, keys=(("Enter", "save", "screen.say"), _CANCEL))

    @on(Input.Submitted)
    def action_say(self) -> None:
        """Give what was typed."""
        self.dismiss(self.query_one(Input).value)


class AskReason(Dialog):
    """Ask for a reason: one of a list, or one that is typed; without one it stays open."""

    DEFAULT_CSS = """
    AskReason > Vertical { width: 76; }
    AskReason OptionList { text-wrap: wrap; }
    """
    LEAVE = "escape"

    def __init__(self, question: str, reasons: Sequence[str]) -> None:
        line = Input(max_length=200, placeholder="type a reason, or choose below with ↑ ↓")
        options = OptionList(*reasons, markup=False)
        options.can_focus = False
        keys = (("Enter", "reject", "screen.say"), _CANCEL)
        super().__init__(_heading(question), line, options, keys=keys)
        self._reasons = reasons

    def move(self, by: int) -> None:
        """Take the previous or next of the list."""
        super().move(by)
        highlighted = self.query_one(OptionList).highlighted
        if highlighted is not None:
            self.query_one(Input).value = self._reasons[highlighted]

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
            again = ("✗", "type or choose a reason first", "screen.say")
            self.query_one("#how", Words).say(how(again, _CANCEL))


class Confirm(Dialog):
    """Ask for confirmation: Enter confirms, any other key cancels.

    A click never confirms: it is the second step of something, and the first may have been one.
    """

    DEFAULT_CSS = "Confirm > Vertical { border: heavy $warning; }"

    def __init__(self, title: str, question: str, yes: str) -> None:
        words = Words((f"{title}\n", "bold $warning"), question, id="question")
        keys = (("Enter", yes, ""), ("any other key", "stay", "screen.leave"))
        super().__init__(words, keys=keys)


class Pick(Dialog):
    """Ask for one of several lines; keys and mouse as in any list."""

    DEFAULT_CSS = "Pick > Vertical { width: 110; }"
    LEAVE = "backspace"

    def __init__(self, question: str, lines: Sequence[Content], chosen: int) -> None:
        keys = (("Enter", "choose", "screen.take"), ("Backspace", "cancel", "screen.leave"))
        super().__init__(_heading(question), OptionList(*lines, markup=False), keys=keys)
        self.first = chosen

    @on(OptionList.OptionSelected)
    def action_take(self) -> None:
        """Give the highlighted line."""
        self.dismiss(self.query_one(OptionList).highlighted)


class _Choices(OptionList):
    """A list that changes as one types: what is clicked may be gone by the time it is heard of."""

    async def _on_click(self, event: events.Click) -> None:
        at = event.style.meta.get("option")
        if at is not None and at >= self.option_count:
            event.prevent_default()


class Palette(Dialog):
    """Search all actions; gives the name of one. Those that are not available now say why."""

    DEFAULT_CSS = """
    Palette > Vertical { width: 96; }
    Palette OptionList { max-height: 16; }
    """
    LEAVE = "escape"
    first = 0

    def __init__(self, keys: Mapping[str, str], hindrance: Callable[[Action], str]) -> None:
        rows = [(action, hindrance(action)) for action in ACTIONS if action.name != "palette"]
        self._rows = sorted(rows, key=lambda row: bool(row[1]))
        self._keys = keys
        options = _Choices(*self._fitting(""), markup=False)
        options.can_focus = False
        run = ("↑ ↓ Enter", "run", "screen.take")
        super().__init__(Input(placeholder="Search commands"), options, keys=(run, _CANCEL))

    @on(Input.Changed)
    def _typed(self, event: Input.Changed) -> None:
        """Show what fits, what can be done first."""
        options = self.query_one(OptionList)
        options.clear_options()
        options.add_options(self._fitting(event.value))
        options.action_first()

    def _fitting(self, query: str) -> list[Option]:
        matcher = Matcher(query)
        return [
            Option(self._line(action, why), action.name, disabled=bool(why))
            for action, why in self._rows
            if not query or matcher.match(action.text)
        ]

    def _line(self, action: Action, why: str) -> Content:
        key = f"{shown_key(self._keys[action.name]):8}"
        return Content.assemble(
            (key, "bold $primary"), action.text, (f"  {why}" if why else "", "$warning")
        )

    @on(Input.Submitted)
    @on(OptionList.OptionSelected)
    def action_take(self) -> None:
        """Give the highlighted action, if any."""
        option = self.query_one(OptionList).highlighted_option
        self.dismiss(option.id if option is not None and not option.disabled else None)
