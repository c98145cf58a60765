"""Search all commands; those that are not available now say why."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from textual import events, on
from textual.content import Content
from textual.fuzzy import Matcher
from textual.widgets import Input, OptionList
from textual.widgets.option_list import Option

from rig.tui.screens.dialog import Dialog, how, said

if TYPE_CHECKING:
    from collections.abc import Sequence

    from textual.app import ComposeResult


class Choice(NamedTuple):
    """An action with its key; `hindrance` says why it cannot be done now."""

    name: str
    text: str
    key: str
    hindrance: str = ""


class _Choices(OptionList):
    """A list that changes as one types: what is clicked may be gone by the time it is heard of."""

    async def _on_click(self, event: events.Click) -> None:
        at = event.style.meta.get("option")
        if at is not None and at >= self.option_count:
            event.prevent_default()


class Palette(Dialog[str | None]):
    """Choose an action; gives its name."""

    DEFAULT_CSS = """
    Palette > Vertical { width: 96; }
    Palette OptionList, Palette OptionList:focus { height: auto; max-height: 16; border: none;
        padding: 0; background: $surface; text-wrap: nowrap; text-overflow: ellipsis; }
    """

    def __init__(self, choices: Sequence[Choice]) -> None:
        super().__init__()
        self._choices = sorted(choices, key=lambda one: bool(one.hindrance))

    def contents(self) -> ComposeResult:
        options = _Choices(*self._fitting(""), markup=False)
        options.can_focus = False
        keys = how(("↑ ↓ Enter", "run", "screen.take"), ("Esc", "cancel", "screen.leave"))
        yield Input(placeholder="Search commands")
        yield options
        yield said("how", keys)

    def on_mount(self) -> None:
        for options in self.query(OptionList):
            options.action_first()
        self.query(Input).focus()

    @on(Input.Changed)
    def _typed(self, event: Input.Changed) -> None:
        """Show what fits, what can be done first."""
        options = self.query_one(OptionList)
        options.clear_options()
        options.add_options(self._fitting(event.value))
        options.action_first()

    def _fitting(self, query: str) -> list[Option]:
        matcher = Matcher(query)
        return [Option(_line(one), one.name, disabled=bool(one.hindrance))
                for one in self._choices if not query or matcher.match(one.text)]  # fmt: skip

    def move(self, by: int) -> None:
        """Go to the previous or next."""
        options = self.query_one(OptionList)
        (options.action_cursor_down if by > 0 else options.action_cursor_up)()

    @on(Input.Submitted)
    @on(OptionList.OptionSelected)
    def action_take(self) -> None:
        """Give the highlighted action, if any."""
        option = self.query_one(OptionList).highlighted_option
        self.dismiss(option.id if option is not None and not option.disabled else None)


def _line(one: Choice) -> Content:
    why = (f"  {one.hindrance}", "$warning") if one.hindrance else ""
    return Content.assemble((f"{one.key:8}", "bold $primary"), one.text, why)
