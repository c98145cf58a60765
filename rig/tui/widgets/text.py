"""Text from outside made safe for a terminal, and static text that is never parsed as markup."""

from __future__ import annotations

import re
from typing import TypeAlias

from textual.content import Content
from textual.style import Style
from textual.widgets import Static

from rig.printable import one_line

_BREAKS = re.compile(r"[\n\r\t]")
LONGEST = 400
"""Characters of one text from outside that are shown; nobody reads more on a screen."""


def plain(text: object, limit: int = LONGEST) -> str:
    """Make text harmless: one line, no control or direction characters, not endless.

    Parameters
    ----------
    text
        Anything; what it prints as is taken.
    limit
        Longest result; longer texts end in ``…``.
    """
    raw = str(text)
    # Cut first: a megabyte of note costs no more than what is shown of it.
    shown = one_line(_BREAKS.sub(" ", raw[: limit + 1]), limit + 1)
    return shown if len(raw) <= limit else shown[: limit - 1] + "…"


def duration(seconds: float) -> str:
    """Write how long something takes, as people say it."""
    minutes, rest = divmod(round(seconds), 60)
    if not minutes:
        return f"{rest} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s"


def pressed(content: Content, action: str) -> Content:
    """Have a click on content do an action."""
    return content.stylize(Style.from_meta({"@click": action}))


def checked(good: bool, text: str) -> Content:
    """Write text behind a sign for good or bad."""
    sign = ("✓ ", "bold $success") if good else ("✗ ", "bold $error")
    return Content.assemble(sign, text)


Styled: TypeAlias = "str | tuple[str, str]"
"""Text, or text with its style."""


class Words(Static):
    """Text on a page."""

    def __init__(self, *parts: Styled | Content, id: str | None = None) -> None:  # noqa: A002
        super().__init__(markup=False, id=id)
        self.auto_links = False  # what can be clicked keeps the colours that it was given
        self._said: Content | None = None
        if parts:
            self.say(*parts)

    def say(self, *parts: Styled | Content) -> None:
        """Show these parts, unless they are there already; places all anew only if it must."""
        content = Content.assemble(*parts)
        if self._said is None or not self._said.is_same(content):
            same = self._said is not None and self._fits(self._said) and self._fits(content)
            same = same and _lines(self._said) == _lines(content)
            self._said = content
            if not same:
                self._layout_updates += 1  # or a height is kept that was found since the last wish
            self.update(content, layout=not same)

    def _fits(self, content: Content) -> bool:
        """Whether no line is broken."""
        return max(map(len, content.plain.split("\n"))) < self.size.width


def _lines(content: Content | None) -> int:
    return 0 if content is None else content.plain.count("\n")
