"""What the command line says, and what commands may use of the app that they do not know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from rig.campaign.machine import COUNTDOWN_S
from rig.tui.stillness import STILL_S

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Mapping
    from pathlib import Path

    from rig.tui.actions import Action
    from rig.tui.client import ReconnectingClient
    from rig.tui.driver import Driver
    from rig.tui.follow import Follower
    from rig.tui.model import Model
    from rig.tui.screens.dialogs import Dialog
    from rig.tui.screens.history import HistoryPage
    from rig.tui.screens.page import Page
    from rig.tui.screens.protocol import ProtocolPage


def ascii_only(environment: Mapping[str, str]) -> bool:
    """Whether a terminal shows ASCII only, by its type or its locale."""
    if environment.get("TERM", "") in {"linux", "vt100", "vt220", "ansi", "dumb"}:
        return True
    names = ("LC_ALL", "LC_CTYPE", "LANG")
    locale = next((found for name in names if (found := environment.get(name))), "UTF-8")
    return "utf8" not in locale.casefold().replace("-", "")


@dataclass(frozen=True, slots=True)
class Options:
    """What the command line says.

    Attributes
    ----------
    files
        Protocols to choose from.
    port
        Empty to watch a daemon that runs already.
    session
        The file to be made or continued.
    offline
        Only look at `session`: no daemon is asked for.
    still_s
        How long the screen stands still before Enter can arm.
    last
        The session that was recorded last in this folder, if any.
    bell
        Whether it rings at a verdict.
    ascii
        Whether only ASCII can be shown.
    """

    files: tuple[Path, ...] = ()
    port: str = ""
    session: Path | None = None
    seed: int | None = None
    socket: Path | None = None
    offline: bool = False
    countdown_s: float = COUNTDOWN_S
    still_s: float = STILL_S
    last: Path | None = None
    bell: bool = False
    ascii: bool = False


class CommandContext(Protocol):
    """The screens, and what is behind them. `rig.tui.app.RigApp` says what each of these is."""

    options: Options
    keys: Mapping[str, str]
    client: ReconnectingClient | None
    follower: Follower
    driver: Driver
    page: str
    pages: dict[str, Page]

    @property
    def model(self) -> Model: ...

    @property
    def history(self) -> HistoryPage: ...

    @property
    def protocols(self) -> ProtocolPage: ...

    def turn(self, page: str) -> None: ...

    def begin(self, work: Coroutine[Any, Any, None]) -> object: ...

    def ask(self, question: Dialog, act: Callable[[Any], object] | None = None) -> None: ...

    def hindrance(self, action: Action) -> str: ...

    def action_do(self, name: str) -> None: ...

    def tell(self, text: str) -> None: ...

    def next_theme(self) -> None: ...

    def exit(self) -> None: ...
