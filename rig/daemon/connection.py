"""One client of the daemon: its lines, its turn, and what it has not read yet."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from rig.daemon import rpc
from rig.reasons import make_error

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from rig.errors import RigError

    _Reply: TypeAlias = Callable[[bytes | None], None]


class Turns:
    """Has answers begin one by one, and what comes in be read between any two of them.

    Many that wait would else be worked on in a row, and a stop that came meanwhile wait for all.
    """

    def __init__(self) -> None:
        self._guard = asyncio.Lock()

    async def come(self) -> None:
        """Wait for the turn to begin an answer."""
        async with self._guard:
            await asyncio.sleep(0)


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
        Among all clients.

    Attributes
    ----------
    name
        What it calls itself.
    subscribed
        Whether it wants changes.
    behind
        Whether it was too slow for them.
    spoke
        Whether a line has come from it.
    """

    def __init__(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        do: Callable[[Connection, rpc.Request], Awaitable[Any]],
        heard: Callable[[Connection], None],
        turns: Turns,
    ) -> None:
        self.name = ""
        self.subscribed = self.behind = self.spoke = False
        self._reader = reader
        self._writer = writer
        self._do = do
        self._heard = heard
        self._turns = turns
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

    def turn_away(self, why: RigError) -> None:
        """Say why, and hang up."""
        self.send(rpc.failure(None, why))
        self.close()

    async def serve(self) -> None:
        """Answer until the client goes."""
        # One request is answered after the other. A stop and the sign of life go past the one
        # that is being worked on, so lines are read all the time.
        waiting: asyncio.Queue[_Asked] = asyncio.Queue(rpc.BATCH_LIMIT)
        answering = asyncio.get_running_loop().create_task(self._answer_all(waiting))
        try:
            await self._read(waiting)
        except (ConnectionError, ValueError, asyncio.IncompleteReadError):
            pass  # gone, or a line without an end
        finally:
            answering.cancel()
            for task in self._urgent:
                task.cancel()

    async def _read(self, waiting: asyncio.Queue[_Asked]) -> None:
        while line := await self._reader.readline():
            self.spoke = True
            self._heard(self)
            if self.waiting() > rpc.UNREAD_LIMIT:
                await self._writer.drain()
            found = rpc.read_line(line)
            if isinstance(found, list):
                reply = _Together(self.send, len(found)).add
                for one in found:
                    self._take(one, reply, waiting)
            else:
                self._take(found, self._send_any, waiting)
            await asyncio.sleep(0)  # many lines are there already: others' are read between them

    def _take(
        self, one: rpc.Request | rpc.RpcError, reply: _Reply, waiting: asyncio.Queue[_Asked]
    ) -> None:
        """Have one message answered in its turn, or at once where it overtakes."""
        asked = _Asked(one, reply)
        method = one.method if isinstance(one, rpc.Request) else ""
        if method in {"stop", "renew"} and self.name and len(self._urgent) < 8:
            task = asyncio.get_running_loop().create_task(self._answer(asked))
            self._urgent.add(task)
            task.add_done_callback(self._urgent.discard)
        elif waiting.full() and isinstance(one, rpc.Request):
            # Refused, not kept back: a stop behind it must be read.
            busy = make_error(rpc.BusyError, "requests_full", requests=rpc.BATCH_LIMIT)
            reply(None if one.notification else rpc.failure(one.id, busy))
        elif waiting.full():
            reply(None)
        else:
            waiting.put_nowait(asked)

    async def _answer_all(self, waiting: asyncio.Queue[_Asked]) -> None:
        while True:
            asked = await waiting.get()
            await self._turns.come()
            await self._answer(asked)
            await self._writer.drain()
            if not self.name:
                self.close()
                return

    async def _answer(self, asked: _Asked) -> None:
        one, reply = asked
        if isinstance(one, rpc.RpcError):
            reply(None if one.silent else rpc.failure(one.request_id, one))
            return
        try:
            line = rpc.answer(one.id, await self._do(self, one))
        except Exception as error:
            line = rpc.failure(one.id, error)
        reply(None if one.notification else line)

    def _send_any(self, line: bytes | None) -> None:
        if line is not None:
            self.send(line)


class _Asked(NamedTuple):
    """What a client sent, and where its answer goes: `None` for none."""

    message: rpc.Request | rpc.RpcError
    reply: _Reply


class _Together:
    """The answers to a batch, sent when all are there.

    Parameters
    ----------
    send
        Takes the line.
    count
        How many messages the batch has.
    """

    def __init__(self, send: Callable[[bytes], None], count: int) -> None:
        self._send = send
        self._left = count
        self._answers: list[bytes] = []

    def add(self, line: bytes | None) -> None:
        """Take the answer to one of them, `None` for a notification."""
        self._left -= 1
        if line is not None:
            self._answers.append(line.rstrip(b"\n"))
        if not self._left and self._answers:
            self._send(b"[" + b",".join(self._answers) + b"]\n")
