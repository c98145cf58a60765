"""The page widget: shows as many parts of a page's content as fit the screen."""

from itertools import chain, repeat

from textual.app import ComposeResult
from textual.containers import Grid, Horizontal, Vertical, VerticalScroll
from textual.widgets import Digits

from rig.tui.desk import Desk, Face
from rig.tui.plotting import draw_picture
from rig.tui.scale import paint
from rig.tui.widgets.spans import SpanView
from rig.tui.widgets.text import Words

_FIGURES = 4
_WIDE, _NORMAL = 160, 100
"""Least columns for three parts side by side, and for two; with fewer, a single part is shown."""


class Page(Vertical):
    """Head, then drawing, plots and tables side by side, then foot."""

    def compose(self) -> ComposeResult:
        with VerticalScroll(id="top", can_focus=False):
            yield Words(id="head")
        with Horizontal(id="parts"):
            with VerticalScroll(id="menu", can_focus=False):
                yield Words(id="list")
            yield SpanView(paint, slow=False, id="drawing")
            with Grid(id="plots"):
                yield from (SpanView(draw_picture, slow=True) for _ in range(_FIGURES))
            with VerticalScroll(id="tables", can_focus=False):
                yield Words(id="words")
        yield Words(id="foot")
        yield Digits("3", id="count")

    def tables_width(self) -> int:
        """Columns of the tables in the latest layout."""
        return max(20, (self.query_one("#tables").size.width or self.app.size.width) - 3)

    def show(self, face: Face, desk: Desk) -> None:
        """Draw a page's content."""
        contents = {"head": face.head, "list": face.menu, "words": face.words, "foot": face.foot}
        for name, content in contents.items():
            self.query_one(f"#{name}", Words).say(content)
        self.query_one("#menu").display = bool(face.menu.plain)
        self._parts(face, desk)
        count = self.query_one(Digits)
        count.display = bool(face.digits)
        count.update(face.digits)

    def _parts(self, face: Face, desk: Desk) -> None:
        """Show as many parts as fit, beginning with the selected part."""
        columns, lines = self.app.size
        room = 3 if columns >= _WIDE else 2 if columns >= _NORMAL else 1
        room = max(1, room + 1 - face.beside)
        there = {"drawing": face.drawing, "plots": face.pictures, "tables": face.words.plain}
        order = ("tables", "drawing", "plots") if face.top else tuple(there)
        parts = [part for part in order if there[part]]
        turned = desk.part % len(parts) if len(parts) > room else 0
        shown = [*parts[turned:], *parts[:turned]][:room]
        for part in there:
            self.query_one(f"#{part}").display = part in shown
        if face.drawing is not None and "drawing" in shown:
            self.query_one("#drawing", SpanView).show(face.drawing)
        pairs = 2 if columns >= _WIDE and lines >= 40 else 1
        most = face.beside * pairs if columns >= _NORMAL else 1
        turn = desk.chart % max(1, len(face.pictures)) if face.beside == 1 else 0
        pictures = [*face.pictures[turn:], *face.pictures[:turn]][: most * ("plots" in shown)]
        self.query_one("#plots").set_class(most > 1 and face.beside > 1, "-pairs")
        figures = self.query("#plots SpanView").results(SpanView)
        for figure, picture in zip(figures, chain(pictures, repeat(())), strict=False):
            figure.display = bool(picture)
            if picture:
                figure.show(picture, face.moment)

    def rewind(self) -> None:
        """Scroll to the beginning."""
        for part in self.query("#top, #tables"):
            part.scroll_home(animate=False)

    def scroll_tables(self, by: int) -> None:
        """Scroll the parts that do not fit, except the menu."""
        for part in self.query("#top, #tables"):
            part.scroll_relative(y=by, animate=False)

    def show_row(self, line: int) -> None:
        """Scroll the list so that a line is visible."""
        menu = self.query_one("#menu")
        menu.scroll_to(y=line - menu.size.height // 2, animate=False)
