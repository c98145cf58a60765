"""Static text that is never parsed as markup and repainted only when it changed."""

from __future__ import annotations

from typing import TypeAlias

from textual.content import Content
from textual.widgets import Static

Styled: TypeAlias = "str | tuple[str, str]"
"""Text, or text with its style."""


class Words(Static):
    """Text on a page."""

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002
        super().__init__(markup=False, id=id, classes=classes)
        self.auto_links = False  # what can be clicked keeps the colours that it was given
        self._said: Content | None = None

    @property
    def said(self) -> str:
        """What stands here."""
        return self._said.plain if self._said is not None else ""

    def say(self, *parts: Styled) -> None:
        """Show these parts, one after the other."""
        self.say_content(Content.assemble(*parts))

    def say_content(self, content: Content) -> None:
        """Show content, unless it is there already; places everything anew only if it must."""
        if self._said is None or not self._said.is_same(content):
            same = self._said is not None and self._fits(self._said) and self._fits(content)
            same = same and _lines(self._said) == _lines(content)
            self._said = content
            self.update(content, layout=not same)

    def _fits(self, content: Content) -> bool:
        """Whether no line is broken."""
        return max(map(len, content.plain.split("\n"))) < self.size.width


def _lines(content: Content | None) -> int:
    return 0 if content is None else content.plain.count("\n")
