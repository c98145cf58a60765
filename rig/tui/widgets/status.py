"""The top of every screen: what this is, whether it is simulated, and what is wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.containers import Vertical
from textual.content import Content

from rig.tui.actions import shown_key
from rig.tui.model import alarm
from rig.tui.widgets.text import Words, plain, pressed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from textual.app import ComposeResult
    from textual.geometry import Size

    from rig.tui.model import Model

_LINKS = {"up": "● link up", "opening": "◌ opening", "down": "✗ link down", "closed": "○ no link"}
PAGES = ("protocol", "device", "run", "result", "session", "history")


class StatusBar(Vertical):
    """One line, and below it what is wrong with what to do."""

    SCOPED_CSS = False  # how much is shown depends on the screen
    DEFAULT_CSS = """
    StatusBar { dock: top; height: auto; }
    StatusBar #tabs, StatusBar #headline { height: 1; padding: 0 1; background: $panel; }
    StatusBar #alarm { height: auto; max-height: 3; padding: 0 1; display: none;
                    background: $error 20%; color: $foreground; }
    StatusBar #alarm.-told { background: $primary 20%; }
    """

    def compose(self) -> ComposeResult:
        yield Words(id="headline")
        yield Words(id="tabs")
        yield Words(id="alarm")

    def show(
        self, model: Model, page: str, keys: Mapping[str, str], size: Size, message: str = ""
    ) -> None:
        """Draw what holds now; what was `message` only while nothing is wrong."""
        self.query_one("#headline", Words).say(headline(model, page, size.width - 2))
        self.query_one("#tabs", Words).say(tabs(page, keys))
        wrong = alarm(model)
        box = self.query_one("#alarm", Words)
        box.display = wrong is not None or bool(message)
        box.set_class(wrong is None, "-told")
        if wrong is None:
            box.say(plain(message, 240))
        else:
            hint = f"\n  → {plain(wrong.hint, 240)}" if wrong.hint else ""
            box.say(("✗ ", "bold $error"), (plain(wrong.message, 160), "bold"), hint)


def tabs(page: str, keys: Mapping[str, str]) -> Content:
    """Name every page with its key; each can be clicked."""
    parts: list[Content] = []
    for name in PAGES:
        text = f" {shown_key(keys[f'page_{name}'])} {name} "
        look = "bold $background on $primary" if name == page else "$foreground 80%"
        parts += [pressed(Content.styled(text, look), f"app.do('page_{name}')"), Content(" ")]
    return Content.assemble(*parts)


def headline(model: Model, page: str, width: int) -> Content:
    """One line of exactly `width`: page and title left, stamp and link right."""
    link = _LINKS.get(model.state.link, "○ no link") if model.connected else "✗ no daemon"
    if model.offline:
        link = "file only"
    right_side = [f"{plain(model.port, 24)}  {link}" if model.port else link]
    stamp = " ▲ SIMULATED " if model.simulated else ""
    blind = " BLIND " if model.blind else ""
    taken = len(right_side[0]) + len(stamp) + len(blind) + 4
    name = page.upper()
    title = plain(model.state.section("session").get("title") or
                  (model.protocol.title if model.protocol else "chainrig"))  # fmt: skip
    room = max(0, width - taken - len(name))
    if len(title) > room:
        title = title[: max(0, room - 1)] + "…" if room else ""
    gap = " " * max(1, width - taken + 1 - len(name) - len(title))
    return Content.assemble(
        (name, "bold $primary"), "  ", title, gap,
        (stamp, "bold $background on $warning"), (blind, "bold $background on $accent"),
        " ", right_side[0],
    )  # fmt: skip
