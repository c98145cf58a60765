"""The screen of an app under test as text."""

import io
from collections.abc import Iterator

from rich.console import Console
from textual.app import App


def text_of(app: App[object]) -> str:
    """Write what stands on the screen, one line a row, without blanks at the ends."""
    console = _printed(app)
    return "\n".join(line.rstrip() for line in console.export_text().splitlines())


def colours_of(app: App[object]) -> Iterator[tuple[str, tuple[int, ...], tuple[int, ...]]]:
    """Tell every piece of text on the screen with the colours of ink and paper."""
    for segment in _printed(app)._record_buffer:
        style = segment.style
        if segment.text.strip() and style and style.color and style.bgcolor:
            yield segment.text, tuple(style.color.triplet), tuple(style.bgcolor.triplet)


def _printed(app: App[object]) -> Console:
    width, height = app.size
    console = Console(width=width, height=height, file=io.StringIO(), record=True,
                      force_terminal=True, legacy_windows=False)  # fmt: skip
    stack = app._background_screens
    console.print(app.screen._compositor.render_update(full=True, screen_stack=stack))
    return console
