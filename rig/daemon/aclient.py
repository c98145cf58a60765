"""An asyncio client of the daemon, for faces that show what is going on."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, Self

from rig.daemon.client import Line
from rig.daemon.replica import Replica


class AsyncClient:
    """One connection; `replica` follows the daemon's state once it is subscribed.

    Attributes
    ----------
    replica
        The state.
    changed
        Called whenever it has changed. It should only take a note: it is called often.
    lost
        Set when the connection has ended.
    """

    _line: Line

    def __init__(self) -> None:
        self.replica = Replica()
        self.changed: Callable[[], None] = lambda: None
        self.lost = asyncio.Event()
        self._loop = asyncio.get_running_loop()

    @classmethod
    async def connect(cls, path: Path, name: str) -> Self:
        """Connect and shake hands.

        Parameters
        ----------
        path, name
            As for `rig.daemon.client.Line`, which says what is raised.
        """
        client = cls()
        notify, end = partial(client._soon, client._follow), partial(client._soon, client._end)
        line = client._loop.run_in_executor(None, Line, path, name, notify, end)
        try:
            client._line = await asyncio.shield(line)
        except asyncio.CancelledError:
            line.add_done_callback(_hang_up)  # no connection stays open that nobody waits for
            raise
        return client

    async def call(self, method: str, **params: Any) -> Any:
        """Ask for anything in the interface, see API.md.

        Raises
        ------
        RigError
            As the daemon raised it, or it is gone.
        """
        return await asyncio.wrap_future(self._line.ask(method, **params))

    async def subscribe(self) -> None:
        """Follow the state."""
        await self.call("subscribe")

    async def close(self) -> None:
        """Hang up."""
        self._line.close()
        self._end()

    def _soon(self, what: Callable[..., None], *values: object) -> None:
        """Have something done in the loop, in the order in which it came."""
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(what, *values)

    def _follow(self, method: str, params: dict[str, Any]) -> None:
        self.replica.follow(method, params)
        self.changed()

    def _end(self) -> None:
        self.lost.set()
        self.changed()


def _hang_up(connecting: asyncio.Future[Line]) -> None:
    if not connecting.cancelled() and connecting.exception() is None:
        connecting.result().close()
