"""One client of the daemon: its lines, its turn, and what it has not read yet."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from rig.daemon import rpc

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable


class Connection:
    """One client.

    Parameters
    ----------
    reader, writer
        Its line.
    do
        Carries out one of its requests.
    heard
        Called with each line it sends.

    Attributes
    ----------
    name
        What it calls itself.
    subscribed
        Whether it wants changes.
    behind
        Whether it was too slow for them.
    """

    def __init__(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        do: Callable[[Connection, rpc.Request], Awaitable[Any]],
        heard: Callable[[Connection], None],
    ) -> None:
        self.name = ""
        self.subscribed = self.behind = False
        self._reader = reader
        self._writer = writer
        self._do = do
        self._heard = heard
        self._urgent: set[asyncio.Task[None]] = set()

    def send(self, line: bytes) -> None:
        """Send one message, some time."""
        if not self._writer.is_closing():
            self._writer.write(line)

    def waiting(self) -> int:
        """Count the bytes that the client has not taken yet."""
        return self._writer.transport.get_write_buffer_size()

    def close(self) -> None:
        """Hang up, without waiting for a client that does not read."""
        self._writer.close()
        if self.waiting():
            self._writer.transport.abort()

    async def serve(self) -> None:
        """Answer until the client goes."""
        # One request is answered after the other. A stop and the sign of life go past the one
        # that is being worked on, so lines are read all the time, into a queue that is short.
        lines: asyncio.Queue[rpc.Request | rpc.RpcError] = asyncio.Queue(maxsize=8)
        answering = asyncio.get_running_loop().create_task(self._answer_all(lines))
        try:
            await self._read(lines)
        except (ConnectionError, ValueError, asyncio.IncompleteReadError):
            pass  # gone, or a line without an end
        finally:
            answering.cancel()
            for task in self._urgent:
                task.cancel()

    async def _read(self, lines: asyncio.Queue[rpc.Request | rpc.RpcError]) -> None:
        while line := await self._reader.readline():
            self._heard(self)
            try:
                request = rpc.read_request(line)
            except rpc.RpcError as error:
                await lines.put(error)
                continue
            if request.method == "renew" and request.id is None:
                continue
            if request.method in {"stop", "renew"} and self.name and len(self._urgent) < 8:
                task = asyncio.get_running_loop().create_task(self._answer(request))
                self._urgent.add(task)
                task.add_done_callback(self._urgent.discard)
            else:
                await lines.put(request)

    async def _answer_all(self, lines: asyncio.Queue[rpc.Request | rpc.RpcError]) -> None:
        while True:
            request = await lines.get()
            if isinstance(request, rpc.RpcError):
                self.send(rpc.failure(request.request_id, request))
            else:
                await self._answer(request)
            await self._writer.drain()
            if not self.name:
                self.close()
                return

    async def _answer(self, request: rpc.Request) -> None:
        try:
            line = rpc.answer(request.id, await self._do(self, request))
        except Exception as error:
            line = rpc.failure(request.id, error)
        if request.id is not None:
            self.send(line)
