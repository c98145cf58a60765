"""What commands may use of the app: it knows them, and they know only this."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Mapping

    from textual.screen import ModalScreen

    from rig.tui.client import ReconnectingClient
    from rig.tui.driver import Driver
    from rig.tui.follow import Follower
    from rig.tui.model import Model
    from rig.tui.options import Options
    from rig.tui.screens.history import HistoryPage
    from rig.tui.screens.page import Page
    from rig.tui.screens.protocol import ProtocolPage


class CommandContext(Protocol):
    """The screens, and what is behind them. `rig.tui.app.RigApp` says what each of these is."""

    options: Options
    keys: Mapping[str, str]
    client: ReconnectingClient | None
    follower: Follower
    driver: Driver
    page: str
    pages: dict[str, Page]
    protocols: ProtocolPage

    @property
    def model(self) -> Model: ...

    @property
    def history(self) -> HistoryPage: ...

    async def go(self, page: str) -> None: ...

    def begin(self, work: Coroutine[Any, Any, None]) -> object: ...

    def ask(
        self, question: ModalScreen[Any], answered: Callable[[Any], None] | None = None
    ) -> object: ...

    def next_theme(self) -> None: ...

    def action_command_palette(self) -> None: ...

    def exit(self) -> None: ...
