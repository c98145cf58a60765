"""What all pages have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.containers import Vertical

from rig.tui.widgets.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

    from rig.tui.model import Model
    from rig.tui.plotting import Picture


class Page(Vertical):
    """One page of the session.

    Pages set `SCOPED_CSS` off where their rules ask how large the screen is.
    """

    DEFAULT_CSS = """
    Page { height: 1fr; }
    Page Words { padding: 0 1; }
    Page VerticalScroll Words { padding: 0; }
    """
    NAME = ""

    def show(self, model: Model) -> None:
        """Draw what holds now; called on the app's tick when something changed."""
        raise NotImplementedError

    def move(self, by: int) -> None:
        """Go to the previous or next of whatever this page lists."""

    def other_chart(self) -> None:
        """Show another quantity where there is a choice."""

    def draw(
        self, key: Hashable, pictures: Callable[[], tuple[Picture | None, Picture | None]]
    ) -> None:
        """Draw figures z and dz, anew where what `key` stands for has changed."""
        z, dz = self.query_one("#z", Figure), self.query_one("#dz", Figure)
        if key is None or z.wants(key):
            for figure, picture in zip((z, dz), pictures(), strict=True):
                figure.show(picture, key)

    def point(self, by: int) -> None:
        """Move the cursor of every plot."""
        for figure in self.query(Figure):
            figure.step(by)

    def choose(self, at: int) -> None:
        """Take one line of whatever this page lists."""
