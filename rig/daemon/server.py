"""The daemon's life: clients on a local socket, served beside the worker and never in its way."""

from __future__ import annotations

import asyncio
import logging
import os
import secrets
import signal
import sys
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.daemon import rpc
from rig.daemon.admission import HELLO_S
from rig.daemon.connection import Connection
from rig.daemon.lease import LEASE_S, Lease
from rig.daemon.listener import Door, listen
from rig.daemon.publisher import Publisher
from rig.daemon.rpc import error_to_data
from rig.daemon.service import Service
from rig.daemon.socket_path import peer_uid, token_file
from rig.daemon.worker import STALL_S, Worker
from rig.errors import InputError, RigError
from rig.files import make_folder, state_folder
from rig.ports import is_simulated
from rig.reasons import make_error
from rig.recorder.published import PublishedState

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable, Coroutine, Iterator, Sequence
    from pathlib import Path

    Onlooker = Callable[[PublishedState], Coroutine[Any, Any, None]]

log = logging.getLogger(__name__)
_SWITCH_S = 1e-3
_AGAIN_S = 0.05
_DOOR_S = 1.0  # between looks whether clients still find the socket
_DESCRIPTORS = 1024
"""Files and connections that may be open: all clients, and what port and session need."""


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
    onlookers
        What else follows the published state in the server's loop; it must not fail.
    """

    def __init__(
        self,
        url: str,
        path: Path,
        *,
        tcp: bool = False,
        idle_s: float | None = None,
        onlookers: Sequence[Onlooker] = (),
    ) -> None:
        self.url = url
        self.path = path
        self.published = PublishedState()
        self.publisher = Publisher(self.published)
        self._token = secrets.token_hex(32) if tcp else ""
        self._lease = Lease()
        self._worker = Worker(url, self.published, self._lease)
        self._service = Service(self._token, self._worker, self._lease, self.publisher)
        self._admission = self._service.admission
        self._turns = asyncio.Lock()
        self._idle_s = idle_s
        self._onlookers = onlookers
        self._left_at = 0.0  # when the last client went
        self._serving: set[asyncio.Task[None]] = set()
        self._over = asyncio.Event()
        self._failed: BaseException | None = None

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
        BaseException
            What a part of it failed by: clients that went on would see nothing any more.
        """
        # The worker may be busy with a burst of edges: clients wait no 5 ms for their turn.
        sys.setswitchinterval(_SWITCH_S)
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self.end)
        _allow_descriptors()
        listener = listen(self.path, self._token)
        door = Door(token_file(self.path) if self._token else self.path)
        self.published.set(
            daemon={"version": __version__, "pid": os.getpid(), "api": rpc.API},
            port={"url": self.url, "simulated": is_simulated(self.url), "path": self.url},
        )
        parts = [
            self._accept(listener),
            self.publisher.run(),
            self._watch_lease(),
            self._watch_worker(),
            self._watch_door(door),
            *(onlooker(self.published) for onlooker in self._onlookers),
        ]
        if self._idle_s is not None:
            parts.append(self._watch_clients(self._idle_s))
        tasks = [loop.create_task(part) for part in parts]
        for task in tasks:
            task.add_done_callback(self._on_end)

        self._worker.died = lambda error: loop.call_soon_threadsafe(self._fail, error)
        ready()  # said before whatever the worker has to say
        self._worker.start()
        try:
            await self._over.wait()
        finally:
            self._worker.end()
            await loop.run_in_executor(None, self._worker.join)
            with suppress(Exception):
                self.publisher.spread()  # the last state, for whoever still looks
            for task in tasks:
                task.cancel()
            listener.close()
            for connection in self._admission:
                connection.close()
            if self._serving:  # they end by themselves; to be cancelled would be told on stderr
                await asyncio.wait(self._serving, timeout=1.0)
            door.remove()
        if self._failed is not None:
            raise self._failed

    def end(self) -> None:
        """End as a signal would."""
        self._over.set()

    def _on_end(self, task: asyncio.Task[None]) -> None:
        """See that no part of the daemon dies in silence."""
        if not task.cancelled() and (error := task.exception()) is not None:
            self._fail(error)

    def _fail(self, error: BaseException) -> None:
        log.error("a part of the daemon failed, so it ends; start it again to go on")
        self._failed = error
        self.end()

    async def _accept(self, listener: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                line, _ = await loop.sock_accept(listener)
            except ConnectionError:
                continue
            except OSError:  # no descriptor is left
                if not self._admission.make_room():
                    await asyncio.sleep(_AGAIN_S)
            else:
                task = loop.create_task(self._serve(line))
                self._serving.add(task)
                task.add_done_callback(self._serving.discard)
            await asyncio.sleep(0)  # who came before is heard before more come

    async def _serve(self, line: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        if peer_uid(line) not in {None, os.getuid()}:
            line.close()
            return
        reader, writer = await asyncio.open_connection(sock=line, limit=rpc.REQUEST_LIMIT)
        connection = Connection(reader, writer, self._service.do, self._lease.heard, self._turns)
        self._admission.register(connection)
        late = loop.call_later(HELLO_S, self._hurry, connection)
        try:
            await connection.serve()
        finally:
            late.cancel()
            self._left_at = loop.time()
            self._service.forget(connection)
            connection.close()

    def _hurry(self, connection: Connection) -> None:
        if self._admission.late(connection):
            connection.turn_away(make_error(rpc.BusyError, "hello_late", patience_s=HELLO_S))

    async def _watch_lease(self) -> None:
        """See that control lapses also when its holder says nothing."""
        while True:
            await asyncio.sleep(LEASE_S / 10)
            if self.published.get("control") is not None and self._lease.holder is None:
                self._worker.wake()
            self._service.show_control()

    async def _watch_worker(self) -> None:
        """Tell every client when nothing is known any more, and when it is again."""
        data, before = None, "idle"
        while True:
            await asyncio.sleep(STALL_S / 10)
            stalled = self._worker.stall()
            if stalled is not None:
                if data is None:
                    log.warning("%s (%s)", stalled.message, stalled.hint)
                    before = self.published.get("phase")
                data = error_to_data(stalled)
                self.published.set(error=data, phase="trouble")
            elif data is not None:
                if self.published.get("error") == data:  # the worker has no trouble of its own
                    phase = self.published.get("phase")
                    self.published.set(error=None, phase=before if phase == "trouble" else phase)
                data = None

    async def _watch_door(self, door: Door) -> None:
        """End when no client is there and none can come; what is said then goes into a log too."""
        while door.there() or self.publisher.connections:
            await asyncio.sleep(_DOOR_S)
        folder = state_folder()
        self._failed = make_error(InputError, "socket_lost", path=door.path, folder=folder)
        # Where stderr went may be deleted with the socket.
        handler = logging.FileHandler(make_folder(folder) / "daemon.log")
        handler.setFormatter(logging.Formatter("%(asctime)s %(process)d: %(message)s"))
        with logging_to(handler):
            log.error("%s", self._failed)
            self.end()
            await asyncio.Event().wait()  # until this is cancelled, when all has ended

    async def _watch_clients(self, idle_s: float) -> None:
        """End when no client was there for so long and nothing would be lost."""
        now = asyncio.get_running_loop().time
        self._left_at = now()
        while not self._over.is_set():
            await asyncio.sleep(idle_s / 10)
            if self.publisher.connections or now() - self._left_at < idle_s:
                continue
            try:
                rests = await asyncio.wrap_future(self._worker.at_rest())
            except RigError:
                rests = False
            if not rests:
                self._left_at = now()
            elif not self.publisher.connections:
                log.info("no client for %g s, and nothing armed, falling or unsaved", idle_s)
                self.end()


@contextmanager
def logging_to(handler: logging.Handler) -> Iterator[None]:
    """Have a handler take what this program logs in a block, and close it."""
    root, ours = logging.getLogger(), logging.getLogger("rig")
    before = ours.level
    ours.setLevel(logging.INFO)
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)
        ours.setLevel(before)
        handler.close()


def _allow_descriptors() -> None:
    import resource  # noqa: PLC0415 - Windows has none, nor a daemon

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    limit = _DESCRIPTORS if hard == resource.RLIM_INFINITY else min(_DESCRIPTORS, hard)
    if soft != resource.RLIM_INFINITY and soft < limit:
        resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))
