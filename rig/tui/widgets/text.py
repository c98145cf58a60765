"""Sanitizing of foreign text for a terminal, and static text that is never parsed as markup."""

import re
from typing import TypeAlias

from textual.content import Content
from textual.style import Style
from textual.widgets import Static

from rig.printable import one_line

_BREAKS = re.compile(r"[\n\r\t]")
LONGEST = 400
"""Most characters shown of a foreign text."""


def plain(text: object, limit: int = LONGEST) -> str:
    """Return harmless text: a line of limited length without control or direction characters.

    Parameters
    ----------
    text
        Any object; converted by `str`.
    limit
        Longest result; longer texts end in ``…``.
    """
    raw = str(text)
    # Cut first, so that a megabyte of note costs no more than the part shown.
    shown = one_line(_BREAKS.sub(" ", raw[: limit + 1]), limit + 1)
    return shown if len(raw) <= limit else shown[: limit - 1] + "…"


def duration(seconds: float) -> str:
    """Return a duration in words."""
    minutes, rest = divmod(round(seconds), 60)
    if not minutes:
        return f"{rest} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s"


def link_action(content: Content, action: str) -> Content:
    """Return content that does an action when clicked."""
    return content.stylize(Style.from_meta({"@click": action}))


def check_line(good: bool, text: str) -> Content:
    """Return text after a sign for good or bad."""
    return Content.assemble(("✓ ", "bold $success") if good else ("✗ ", "bold $error"), text)


Styled: TypeAlias = str | tuple[str, str]
"""Text, or text with its style."""


class Words(Static):
    """Text on a page, which takes no room while it is empty."""

    def __init__(self, *parts: Styled | Content, id: str | None = None) -> None:  # noqa: A002
        super().__init__(markup=False, id=id)
        self.auto_links = False  # clickable text keeps its colours
        self._said = Content("")
        self.display = False
        self.say(*parts)

    def say(self, *parts: Styled | Content) -> None:
        """Show these parts if they have changed, with a new layout only if necessary."""
        content = Content.assemble(*parts)
        if not self._said.is_same(content):
            is_same_height = self._height(content) == self._height(self._said) is not None
            self._said, self.display = content, bool(content.plain)
            if not is_same_height:
                self._layout_updates += 1  # otherwise an outdated height is kept
            self.update(content, layout=not is_same_height)

    def _height(self, content: Content) -> int | None:
        """Return the number of lines; `None` unless all fit the width."""
        lines = content.plain.split("\n")
        return len(lines) if max(map(len, lines)) < self.size.width else None
