"""What all pages have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from textual.containers import Vertical

from rig.tui.widgets.figure import Figure
from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from collections.abc import Callable

    from textual.content import Content

    from rig.tui.context import Options
    from rig.tui.model import Model
    from rig.tui.plotting import Picture
    from rig.tui.widgets.text import Styled

T = TypeVar("T")


class Page(Vertical):
    """One page of the session.

    Pages set `SCOPED_CSS` off where their rules ask how large the screen is.

    Parameters
    ----------
    options
        What the command line says.
    """

    DEFAULT_CSS = """
    Page { height: 1fr; }
    Page Words { padding: 0 1; }
    Page VerticalScroll Words { padding: 0; }
    """

    def __init__(self, options: Options) -> None:
        super().__init__()
        self.options = options
        self._latest: dict[str, tuple[object, Any]] = {}

    def latest(self, name: str, key: object, work: Callable[[], T]) -> T:
        """Return what `work` gives, worked out anew only where `key` differs from the last time.

        Pages are drawn many times a second, and what they show may take long.
        """
        if name not in self._latest or self._latest[name][0] != key:
            self._latest[name] = key, work()
        value: T = self._latest[name][1]
        return value

    def say(self, name: str, *parts: Styled | Content) -> None:
        """Write one of the page's texts."""
        self.query_one(f"#{name}", Words).say(*parts)

    def show(self, model: Model) -> None:
        """Draw what holds now; called on the app's tick when something changed."""
        raise NotImplementedError

    def move(self, by: int) -> None:
        """Go to the previous or next of whatever this page lists."""

    def other_chart(self) -> None:
        """Show another quantity where there is a choice."""

    def draw(
        self, key: object, pictures: Callable[[], tuple[Picture | None, Picture | None]]
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
