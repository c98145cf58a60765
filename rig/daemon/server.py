"""The daemon's door: clients on a local socket, served beside the worker and never in its way."""

from __future__ import annotations

import asyncio
import os
import secrets
import signal
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from rig import __version__
from rig.daemon import rpc
from rig.daemon.connection import Connection
from rig.daemon.doorway import leave, listen
from rig.daemon.hub import Hub
from rig.daemon.lease import LEASE_S, Lease
from rig.daemon.narration import Narration
from rig.daemon.place import peer_uid
from rig.daemon.worker import Worker
from rig.errors import RigError
from rig.ports import is_simulated

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

_CHANGES_S = 0.004
"""From one message to the next: in a flood a face takes many together; at 5000 edges/s, a frame in
8 ms, each goes out at once."""
_FULL = 1 << 16
"""Bytes on their way to one client; beyond, it gets a snapshot when it has read them."""
_SWITCH_S = 1e-3


class Server:
    """One daemon.

    Parameters
    ----------
    url
        The port.
    path
        The Unix socket.
    tcp
        Whether to listen on a TCP port of 127.0.0.1 instead.
    idle_s
        End when for so long no client was there, as soon as nothing is armed, falling or unsaved;
        `None` to wait for a signal.
    tell
        Is given a line for whoever started it; must return at once.
    """

    def __init__(
        self,
        url: str,
        path: Path,
        *,
        tcp: bool = False,
        idle_s: float | None = None,
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.url = url
        self.path = path
        self.token = secrets.token_hex(32) if tcp else ""
        self.hub = Hub()
        self.lease = Lease()
        self.worker = Worker(url, self.hub, self.lease)
        self.connections: set[Connection] = set()
        self._idle_s = idle_s
        self._left_at = 0.0  # when the last client went
        self._tell = tell
        self._narration = Narration()
        self._serving: set[asyncio.Task[None]] = set()
        self._over = asyncio.Event()
        self._dirty = asyncio.Event()

    async def run(self, ready: Callable[[], None]) -> None:
        """Serve until a signal comes, or until nobody needs it.

        Parameters
        ----------
        ready
            Called when clients can come.

        Raises
        ------
        InputError
            Another daemon is there, or the socket's folder cannot be trusted.
        """
        # The worker may be busy with a burst of edges: clients wait no 5 ms for their turn.
        sys.setswitchinterval(_SWITCH_S)
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            with suppress(NotImplementedError):  # Windows: there KeyboardInterrupt ends the loop
                loop.add_signal_handler(number, self.end)
        server = await listen(self.path, self._serve, self.token)

        def wake() -> None:
            loop.call_soon_threadsafe(self._dirty.set)

        self.hub.changed = wake
        self.hub.set(
            daemon={"version": __version__, "pid": os.getpid(), "api": rpc.API},
            port={"url": self.url, "simulated": is_simulated(self.url), "path": self.url},
        )
        self.worker.start()
        tasks = [loop.create_task(self._spread()), loop.create_task(self._watch_lease())]
        if self._idle_s is not None:
            tasks.append(loop.create_task(self._watch_clients(self._idle_s)))
        try:
            ready()
            await self._over.wait()
        finally:
            server.close()
            self.worker.end()
            await loop.run_in_executor(None, self.worker.join)
            self.spread()  # the last state, for whoever still looks
            for task in tasks:
                task.cancel()
            for connection in list(self.connections):
                connection.close()
            if self._serving:  # they end by themselves; to be cancelled would be told on stderr
                await asyncio.wait(self._serving, timeout=1.0)
            leave(self.path, self.token)

    def end(self) -> None:
        """End as a signal would."""
        self._over.set()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        uid = peer_uid(writer.get_extra_info("socket"))
        if uid not in {None, os.getuid() if hasattr(os, "getuid") else None}:
            writer.close()
            return
        connection = Connection(self, reader, writer)
        task = asyncio.current_task()
        assert task is not None
        self._serving.add(task)
        self.connections.add(connection)
        self.hub.set(clients=len(self.connections))
        try:
            await connection.serve()
        finally:
            self.connections.discard(connection)
            self._left_at = asyncio.get_running_loop().time()
            self.watch()
            if self.lease.release(connection):
                self.worker.lost()
            self.show_control()
            self.hub.set(clients=len(self.connections))
            connection.close()
            self._serving.discard(task)

    def show_control(self) -> None:
        """Show who is in control now."""
        holder = self.lease.holder
        self.hub.set(control=None if holder is None else {"client": self.lease.name})

    # ------------------------------------------------------------------ the state goes out

    def watch(self) -> None:
        """Take note of who looks."""
        self.hub.watched = any(one.subscribed for one in self.connections)

    def spread(self) -> None:
        """Send what changed to whoever keeps up; a snapshot to whoever does so again."""
        change = self.hub.take()
        line = None
        if change is not None:
            line = rpc.request("change", change, None)
            for words in self._narration.lines(change):
                self._tell(words)
        snapshot = None
        for connection in self.connections:
            if not connection.subscribed:
                continue
            if connection.waiting() > _FULL:
                connection.behind = True
            elif connection.behind:
                snapshot = snapshot or rpc.request("snapshot", self.hub.snapshot(), None)
                connection.behind = False
                connection.send(snapshot)
            elif line is not None:
                connection.send(line)

    async def _spread(self) -> None:
        while True:
            if not any(connection.behind for connection in self.connections):
                await self._dirty.wait()
            self._dirty.clear()
            self.spread()
            await asyncio.sleep(_CHANGES_S)

    async def _watch_lease(self) -> None:
        """See that control lapses also when its holder says nothing."""
        while True:
            await asyncio.sleep(LEASE_S / 10)
            if self.hub.get("control") is not None and self.lease.holder is None:
                self.worker.lost()
            self.show_control()

    async def _watch_clients(self, idle_s: float) -> None:
        """End when no client was there for so long and nothing would be lost."""
        now = asyncio.get_running_loop().time
        self._left_at = now()
        while not self._over.is_set():
            await asyncio.sleep(idle_s / 10)
            if self.connections or now() - self._left_at < idle_s:
                continue
            try:
                rests = await asyncio.wrap_future(self.worker.at_rest())
            except RigError:
                rests = False
            if not rests:
                self._left_at = now()
            elif not self.connections:
                self._tell(f"no client for {idle_s:g} s, and nothing armed, falling or unsaved")
                self.end()


def serve(
    url: str,
    path: Path,
    *,
    tcp: bool,
    idle_s: float | None,
    ready: Callable[[], None],
    tell: Callable[[str], None],
) -> None:
    """Run a daemon to its end; see `Server`."""

    async def run() -> None:
        await Server(url, path, tcp=tcp, idle_s=idle_s, tell=tell).run(ready)

    with suppress(KeyboardInterrupt):
        asyncio.run(run())
