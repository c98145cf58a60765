"""An asyncio client of the daemon, for faces that show what is going on."""

from __future__ import annotations

import asyncio
import threading
from typing import TYPE_CHECKING, Any, Self

from rig.daemon import rpc
from rig.daemon.client_protocol import (
    HELLO_PATIENCE_S,
    ClientProtocol,
    Replica,
    gone,
    hello,
    silent,
    turned_away,
)
from rig.daemon.socket_path import reach
from rig.errors import DeviceError

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable
    from pathlib import Path

    from rig.errors import RigError

_CHUNK = 1 << 16
_HUNG_UP = "it hung up"


async def _reached(path: Path) -> tuple[socket.socket, str]:
    """Connect in a thread; who is cancelled meanwhile leaves no open socket behind."""
    given_up = threading.Event()
    found: list[tuple[socket.socket, str]] = []

    def hang_up() -> None:
        for line, _ in found:
            line.close()

    def connect() -> tuple[socket.socket, str]:
        found.append(reach(path))
        if given_up.is_set():
            hang_up()
        return found[0]

    try:
        return await asyncio.to_thread(connect)
    except asyncio.CancelledError:
        given_up.set()
        hang_up()
        raise


class AsyncClient:
    """One connection; `replica` follows the daemon's state once it is subscribed.

    Parameters
    ----------
    reader, writer
        Of the connection; `connect` makes them.

    Attributes
    ----------
    replica
        The state.
    changed
        Called whenever it has changed. It should only take a note: it is called often.
    lost
        Set when the connection has ended.
    """

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.replica = Replica()
        self.changed: Callable[[], None] = lambda: None
        self.lost = asyncio.Event()
        self._writer = writer
        self._protocol = ClientProtocol()
        self._turned_away: dict[str, Any] | None = None
        self._open: dict[int, asyncio.Future[Any]] = {}
        self._listening = asyncio.get_running_loop().create_task(self._listen(reader))

    @classmethod
    async def connect(cls, path: Path, name: str) -> Self:
        """Connect and shake hands.

        Parameters
        ----------
        path
            The daemon's Unix socket; beside it the file that stands for TCP.
        name
            What others are told of this client.

        Raises
        ------
        DeviceError
            No daemon there.
        VersionError
            It speaks another version.
        """
        line, token = await _reached(path)
        line.setblocking(False)
        client = cls(*await asyncio.open_connection(sock=line))
        try:
            async with asyncio.timeout(HELLO_PATIENCE_S):
                await client.call("hello", **hello(name, token))
        except TimeoutError:
            await client.close()
            raise silent(path) from None
        except BaseException:
            await client.close()
            raise
        return client

    async def call(self, method: str, **params: Any) -> Any:
        """Ask for anything in the interface, see API.md.

        Raises
        ------
        RigError
            As the daemon raised it, or it is gone.
        """
        if self.lost.is_set():
            raise gone(_HUNG_UP)
        number, line = self._protocol.ask(method, params)
        answer: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._open[number] = answer
        self._writer.write(line)
        return await answer

    async def subscribe(self) -> None:
        """Follow the state."""
        # The answer is taken in `_listen`: changes may be in the same packet behind it.
        await self.call("subscribe")

    async def close(self) -> None:
        """Hang up."""
        self._writer.close()
        self._listening.cancel()
        await asyncio.gather(self._listening, return_exceptions=True)
        self._end()

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        try:
            while True:
                for message in self._protocol.feed(await reader.read(_CHUNK)):
                    if "method" in message:
                        self.replica.notified(message["method"], message["params"])
                        self.changed()
                    else:
                        self._answered(message)
        except (OSError, DeviceError):
            pass  # gone
        finally:
            self._end()

    def _answered(self, message: dict[str, Any]) -> None:
        if turned_away(message):
            self._turned_away = message
            raise gone(_HUNG_UP)
        answer = self._open.pop(message["id"], None)
        result = message.get("result")
        if isinstance(result, dict) and "state" in result:
            self.replica.snapshot(result)
            self.changed()
        if answer is None or answer.done():
            return
        try:
            answer.set_result(rpc.result_of(message))
        except Exception as error:
            answer.set_exception(error)

    def _end(self) -> None:
        self.lost.set()
        why: RigError = gone(_HUNG_UP)
        if self._turned_away is not None:
            why = rpc.error_of(self._turned_away)
        for answer in self._open.values():
            if not answer.done():
                answer.set_exception(why)
        self._open.clear()
        self.changed()
