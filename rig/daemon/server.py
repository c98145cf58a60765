"""The daemon's life: clients on a local socket, served beside the worker and never in its way."""

import asyncio
import logging
import os
import signal
import socket
import sys
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rig import __version__
from rig.daemon import rpc
from rig.daemon.connection import HELLO_S, Connection
from rig.daemon.lease import LEASE_S
from rig.daemon.listener import Door
from rig.daemon.service import Service
from rig.daemon.socket_path import peer_uid
from rig.errors import InputError
from rig.files import make_folder, state_folder
from rig.ports import is_simulated
from rig.reasons import rig_error
from rig.recorder.published import PublishedState

Onlooker = Callable[[PublishedState], Coroutine[Any, Any, None]]

log = logging.getLogger(__name__)
_SWITCH_S = 1e-3
_AGAIN_S = 0.05
_LOOK_S = LEASE_S / 20
"""Between two looks whether control has lapsed, the worker goes on, and clients find the socket."""


@dataclass(eq=False, repr=False)
class Server:
    """One daemon.

    Parameters
    ----------
    url
        The port.
    path
        The Unix socket.
    idle_s
        End when for so long no client was there, as soon as nothing is armed, falling or unsaved;
        `None` to wait for a signal.
    onlookers
        What else follows the published state in the server's loop; it must not fail.
    """

    url: str
    path: Path
    idle_s: float | None = None
    onlookers: Sequence[Onlooker] = ()
    _turns: asyncio.Lock = field(default_factory=asyncio.Lock)
    _left_at: float = 0.0  # when somebody was there last, or something under way
    _stall: dict[str, Any] | None = None  # as published
    _serving: set[asyncio.Task[None]] = field(default_factory=set)
    _over: asyncio.Event = field(default_factory=asyncio.Event)

    def __post_init__(self) -> None:
        self.service = Service(self.url)
        self.published, self._worker = self.service.published, self.service.worker

    async def run(self, ready: Callable[[], None]) -> None:
        """Serve until a signal comes, or until nobody needs it.

        Parameters
        ----------
        ready
            Called when clients can come.

        Raises
        ------
        InputError
            Another daemon is there, the socket's folder cannot be trusted, or the socket was lost.
        BaseException
            What a part of it failed by: clients that went on would see nothing any more.
        """
        # The worker may be busy with a burst of edges: clients wait no 5 ms for their turn.
        sys.setswitchinterval(_SWITCH_S)
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self.end)
        door = Door(self.path)
        about = {"version": __version__, "pid": os.getpid(), "api": rpc.API}
        port = {"url": self.url, "simulated": is_simulated(self.url), "path": self.url}
        self.published.set(daemon=about, port=port)
        ready()  # said before whatever the worker has to say
        self._worker.start()
        parts: list[Awaitable[Any]] = [
            self._over.wait(),
            asyncio.wrap_future(self._worker.over),
            self._accept(door.listener),
            self.service.publisher.run(),
            self._watch(door),
            *(onlooker(self.published) for onlooker in self.onlookers),
        ]
        tasks = [asyncio.ensure_future(part) for part in parts]
        try:
            ended, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in ended:
                if isinstance(error := task.exception(), InputError):
                    # Where stderr went may be deleted with the socket.
                    handler = logging.FileHandler(make_folder(state_folder()) / "daemon.log")
                    handler.setFormatter(logging.Formatter("%(asctime)s %(process)d: %(message)s"))
                    logging.getLogger().addHandler(handler)
                    log.error("%s", error)
                elif error is not None:
                    log.error("a part of the daemon failed, so it ends; start it again to go on")
        finally:
            self._worker.end()
            await loop.run_in_executor(None, self._worker.join)
            with suppress(Exception):
                self.service.publisher.spread()  # the last state, for whoever still looks
            for task in tasks:
                task.cancel()
            for connection in self.service.connections:
                connection.close()
            if self._serving:  # they end by themselves; to be cancelled would be told on stderr
                await asyncio.wait(self._serving, timeout=1.0)
            door.close()
        for task in ended:
            task.result()

    def end(self) -> None:
        """End as a signal would."""
        self._over.set()

    async def _accept(self, listener: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                line, _ = await loop.sock_accept(listener)
            except ConnectionError:
                continue
            except OSError:  # no descriptor is left: those who say nothing are sent away soon
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
        do, heard = self.service.do, self.service.lease.heard
        connection = Connection(reader, writer, do, heard, self._turns)
        self.service.connections.add(connection)
        late = loop.call_later(HELLO_S, connection.hurry)
        try:
            await connection.serve()
        finally:
            late.cancel()
            self.service.forget(connection)
            connection.close()

    # ------------------------------------------------------------------ what is looked at

    async def _watch(self, door: Door) -> None:
        """Look again and again at what nobody reports.

        Raises
        ------
        InputError
            No client is there, and none can come any more.
        """
        self._left_at = asyncio.get_running_loop().time()
        while True:
            await asyncio.sleep(_LOOK_S)
            self.service.show_control()  # it lapses also when its holder says nothing
            self._see_worker()
            self._see_rest()
            if not (door.there() or self.published.get("clients")):
                raise rig_error("socket_lost", path=door.path, folder=state_folder())

    def _see_worker(self) -> None:
        """Tell every client when nothing is known any more, and when it is again."""
        stall, before = self._worker.stall(), self._stall
        self._stall = None if stall is None else rpc.error_to_data(stall)
        if stall is not None:
            if before is None:
                log.warning("%s (%s)", stall.message, stall.hint)
            self.published.set(error=self._stall)
        elif before is not None and self.published.get("error") == before:
            self.published.set(error=None)  # the worker has no trouble of its own

    def _see_rest(self) -> None:
        """End when no client was there for so long and nothing is armed, falling or unsaved."""
        now, state = asyncio.get_running_loop().time(), self.published.get
        drop, error = state("drop") or {}, state("error") or {}
        is_held = drop.get("state") in {"armed", "fired"} or error.get("kind") == "SessionError"
        if is_held or state("clients") or state("phase") not in {"idle", "trouble"}:
            self._left_at = now
        elif self.idle_s is not None and now - self._left_at >= self.idle_s:
            log.info("no client for %g s; nothing armed, falling or unsaved", self.idle_s)
            self.end()
