"""The daemon's door: clients on a local socket, served beside the worker and never in its way."""

from __future__ import annotations

import asyncio
import json
import os
import secrets
import signal
import socket
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.daemon import rpc
from rig.daemon.hub import Hub
from rig.daemon.lease import LEASE_S, Lease
from rig.daemon.place import peer_uid, prepare_folder, token_file
from rig.daemon.service import Service
from rig.daemon.worker import Worker, known
from rig.errors import InputError
from rig.files import write_atomic
from rig.ports import is_simulated

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

_CHANGES_S = 0.01
"""From one message to the next: a face repaints less often, and takes them together."""
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
    """

    def __init__(self, url: str, path: Path, *, tcp: bool = False) -> None:
        self.url = url
        self.path = path
        self.token = secrets.token_hex(32) if tcp else ""
        self.hub = Hub()
        self.lease = Lease()
        self.worker = Worker(url, self.hub, self.lease)
        self.connections: set[Connection] = set()
        self._tcp = tcp
        self._serving: set[asyncio.Task[None]] = set()
        self._over = asyncio.Event()
        self._dirty = asyncio.Event()

    async def run(self, ready: Callable[[], None]) -> None:
        """Serve until a signal comes.

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
        server = await self._listen()

        def wake() -> None:
            loop.call_soon_threadsafe(self._dirty.set)

        self.hub.changed = wake
        self.hub.set(
            daemon={"version": __version__, "pid": os.getpid(), "api": rpc.API},
            port={"url": self.url, "simulated": is_simulated(self.url)},
        )
        self.worker.start()
        tasks = [loop.create_task(self._spread()), loop.create_task(self._watch_lease())]
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
            with suppress(OSError):
                self._address.unlink()

    def end(self) -> None:
        """End as a signal would."""
        self._over.set()

    @property
    def _address(self) -> Path:
        return token_file(self.path) if self._tcp else self.path

    async def _listen(self) -> asyncio.Server:
        prepare_folder(self.path.parent)
        if self._tcp:
            server = await asyncio.start_server(
                self._serve, "127.0.0.1", 0, limit=rpc.REQUEST_LIMIT
            )
            port = server.sockets[0].getsockname()[1]
            self._address.unlink(missing_ok=True)
            self._address.touch(mode=0o600)
            write_atomic(self._address, json.dumps({"port": port, "token": self.token}))
            self._address.chmod(0o600)
            return server
        self._clear_the_way()
        server = await asyncio.start_unix_server(
            self._serve, str(self.path), limit=rpc.REQUEST_LIMIT
        )
        self.path.chmod(0o600)
        return server

    def _clear_the_way(self) -> None:
        """Take away the socket that a killed daemon left; refuse when one is answering."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
            probe.settimeout(1.0)
            try:
                probe.connect(str(self.path))
            except (FileNotFoundError, ConnectionRefusedError):
                self.path.unlink(missing_ok=True)
                return
            except OSError as error:
                raise InputError(
                    f"cannot listen at {self.path}: {error}", "name another place with --socket"
                ) from error
        raise InputError(
            f"another daemon answers at {self.path}",
            "use that one, stop it, or name another place with --socket",
        )

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
        line = None if change is None else rpc.request("change", change, None)
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


class Connection:
    """One client.

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
        self, server: Server, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self.server = server
        self.name = ""
        self.subscribed = self.behind = False
        self._reader = reader
        self._writer = writer
        self._service = Service(server, self)
        self._stops: set[asyncio.Task[None]] = set()

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
            for task in self._stops:
                task.cancel()

    async def _read(self, lines: asyncio.Queue[rpc.Request | rpc.RpcError]) -> None:
        while line := await self._reader.readline():
            self.server.lease.heard(self)
            try:
                request = rpc.read_request(line)
            except rpc.RpcError as error:
                await lines.put(error)
                continue
            if request.method == "stop" and self.name and len(self._stops) < 8:
                task = asyncio.get_running_loop().create_task(self._answer(request))
                self._stops.add(task)
                task.add_done_callback(self._stops.discard)
            elif request.method != "renew" or request.id is not None:
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
        result: Any = None
        try:
            result = await self._service.do(request)
            line = rpc.answer(request.id, result)
        except rpc.RpcError as error:
            line = rpc.failure(request.id, error)
        except Exception as error:
            line = rpc.failure(request.id, known(error))
        if request.id is not None:
            self.send(line)


def serve(url: str, path: Path, *, tcp: bool, ready: Callable[[], None]) -> None:
    """Run a daemon until a signal ends it; see `Server`."""

    async def run() -> None:
        await Server(url, path, tcp=tcp).run(ready)

    with suppress(KeyboardInterrupt):
        asyncio.run(run())


def notify_systemd() -> None:
    """Tell systemd that clients can come, where it asked to be told (sd_notify(3))."""
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address or sys.platform == "win32":
        return
    with (
        suppress(OSError),
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as out,
    ):
        out.connect("\0" + address[1:] if address.startswith("@") else address)
        out.send(b"READY=1")
