"""One client of the daemon: its lines, its turn, and what it has not read yet."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from rig.daemon import rpc
from rig.reasons import rig_error

Message: TypeAlias = rpc.Request | rpc.RpcError


HELLO_S = 2.0
"""A connection on which nobody says hello for so long is ended."""
CLIENTS = 128
"""Connections beyond those may only `stop`, and no longer than `HELLO_S`."""


@dataclass(eq=False, repr=False)
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
    turns
        Of all clients: answers begin one by one, and what comes in is read between any two of
        them. Many that wait would else be worked on in a row, and a stop that came meanwhile
        wait for all.

    Attributes
    ----------
    name
        What it calls itself.
    is_client
        Whether it was let in: it has said hello, and there was room.
    subscribed
        Whether it wants changes.
    behind
        Whether it was too slow for them.
    """

    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter
    do: Callable[["Connection", Message], Awaitable[Any]]
    heard: Callable[["Connection"], None]
    turns: asyncio.Lock
    name: str = ""
    is_client: bool = False
    subscribed: bool = False
    behind: bool = False
    _urgent: set[asyncio.Task[None]] = field(default_factory=set)
    _waiting: asyncio.Queue[Message] = field(
        default_factory=lambda: asyncio.Queue(rpc.WAITING_LIMIT)
    )

    def send(self, line: bytes) -> None:
        """Send one message, some time."""
        if not self.writer.is_closing():
            self.writer.write(line)

    def waiting(self) -> int:
        """Count the bytes that the client has not taken yet."""
        return self.writer.transport.get_write_buffer_size()

    def close(self) -> None:
        """Hang up, without waiting for a client that does not read."""
        self.writer.close()
        if self.waiting():
            self.writer.transport.abort()

    def hurry(self) -> None:
        """Say to whoever was not let in that it is late, and hang up."""
        if not self.is_client:
            self.send(rpc.failure(None, rig_error("hello_late", patience_s=HELLO_S)))
            self.close()

    async def serve(self) -> None:
        """Answer until the client goes."""
        # One request is answered after the other. A stop and the sign of life go past the one
        # that is being worked on, so lines are read all the time.
        answering = asyncio.get_running_loop().create_task(self._answer_all())
        try:
            await self._read()
        except (ConnectionError, ValueError, asyncio.IncompleteReadError):
            pass  # gone, or a line without an end
        finally:
            answering.cancel()
            for task in self._urgent:
                task.cancel()

    async def _read(self) -> None:
        while line := await self.reader.readline():
            self.heard(self)
            if self.waiting() > rpc.UNREAD_LIMIT:
                await self.writer.drain()
            self._take(rpc.read_line(line))
            await asyncio.sleep(0)  # many lines are there already: others' are read between them

    def _take(self, message: Message) -> None:
        """Have one message answered in its turn, or at once where it overtakes."""
        method = message.method if isinstance(message, rpc.Request) else ""
        if method in {"stop", "renew"} and self.name and len(self._urgent) < 8:
            task = asyncio.get_running_loop().create_task(self._answer(message))
            self._urgent.add(task)
            task.add_done_callback(self._urgent.discard)
        elif self._waiting.full():
            # Refused, not kept back: a stop behind it must be read.
            busy = rig_error("requests_full", requests=rpc.WAITING_LIMIT)
            self.send(rpc.failure(message.id, busy))
        else:
            self._waiting.put_nowait(message)

    async def _answer_all(self) -> None:
        while True:
            message = await self._waiting.get()
            async with self.turns:
                await asyncio.sleep(0)
            await self._answer(message)
            await self.writer.drain()
            if not self.name:
                self.close()
                return

    async def _answer(self, message: Message) -> None:
        try:
            line = rpc.answer(message.id, await self.do(self, message))
        except Exception as error:
            line = rpc.failure(message.id, error)
        self.send(line)
