"""The methods of the interface, see API.md: what they take, who may call them, what they do."""

from __future__ import annotations

import asyncio
import os
from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.daemon import rpc
from rig.daemon.faults import VersionError
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from rig.daemon.connection import Connection
    from rig.daemon.desk import Desk
    from rig.daemon.server import Server

_ANY_NUMBER = (int, float)


class Service:
    """Carries out one connection's requests.

    Parameters
    ----------
    server, client
        Whose.
    """

    def __init__(self, server: Server, client: Connection) -> None:
        self._server = server
        self._client = client
        self._methods: dict[str, Callable[..., Awaitable[Any]]] = {
            "hello": self._hello,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "take_control": self._take_control,
            "release_control": self._release_control,
            "renew": self._renew,
            "stop": self._stop,
            "open_session": self._open_session,
            "close_session": self._close_session,
            "wait": self._wait,
            "arm": self._arm,
            "fire": self._fire,
            "collect": self._collect,
            "test_release": self._test_release,
            "log_state": self._log_state,
        }

    async def do(self, request: rpc.Request) -> Any:
        """Carry out one request.

        Raises
        ------
        RpcError
            It is none of the interface.
        RigError
            It failed.
        """
        method = self._methods.get(request.method)
        if method is None:
            raise rpc.RpcError(rpc.NO_METHOD, f"no method {request.method}")
        if not self._client.name and request.method != "hello":
            raise rpc.RpcError(rpc.INVALID, "hello comes first")
        try:
            work = method(**request.params)
        except TypeError as error:
            raise rpc.RpcError(rpc.BAD_PARAMS, f"{request.method}: {error}") from None
        return await work

    async def _hello(self, api: object, client: object, token: object = "") -> dict[str, Any]:
        if api != rpc.API:
            raise VersionError(
                f"this client speaks version {api} of the daemon's interface, rig {__version__}'s "
                f"daemon version {rpc.API}",
                "stop the daemon and start it again after an update; update the client",
            )
        if self._server.token and token != self._server.token:
            raise rpc.RpcError(rpc.INVALID, "wrong token")
        self._client.name = _text(client, "client")[:80] or "a client"
        return {
            "api": rpc.API,
            "version": __version__,
            "pid": os.getpid(),
            "port": self._server.url,
            "path": self._server.hub.get("port")["path"],
        }

    async def _subscribe(self) -> dict[str, Any]:
        self._server.spread()  # what the others are told first is in the snapshot
        self._client.subscribed = True
        self._server.watch()
        return self._server.hub.snapshot()

    async def _unsubscribe(self) -> dict[str, Any]:
        self._client.subscribed = self._client.behind = False
        self._server.watch()
        return {}

    async def _take_control(self) -> dict[str, Any]:
        self._server.lease.take(self._client, self._client.name)
        self._server.show_control()
        return {}

    async def _release_control(self) -> dict[str, Any]:
        if self._server.lease.release(self._client):
            self._server.worker.lost()
            self._server.show_control()
        return {}

    async def _renew(self) -> dict[str, Any]:
        return {}  # every line is a sign of life

    async def _stop(self, reason: object = "") -> dict[str, Any]:
        said = _text(reason, "reason")[:200] or f"stopped by {self._client.name}"
        await asyncio.wrap_future(self._server.worker.stop(said))
        return {}

    async def _open_session(
        self, protocol: object, session: object, seed: object = None
    ) -> dict[str, Any]:
        names = _text(protocol, "protocol"), _text(session, "session")
        chosen = None if seed is None else _whole(seed, "seed")

        def work(desk: Desk) -> dict[str, Any]:
            fetched = desk.open_session(*names, chosen)
            return {"session": self._server.hub.get("session"), "fetched": fetched}

        return await self._ask(work, writes=False)

    async def _close_session(self) -> dict[str, Any]:
        return await self._ask(lambda desk: desk.close_session(), writes=False)

    async def _wait(self, seconds: object) -> dict[str, Any]:
        if not isinstance(seconds, _ANY_NUMBER) or not 0.0 <= seconds <= 3600.0:
            raise rpc.RpcError(rpc.BAD_PARAMS, "seconds: from 0 to 3600")
        return await self._ask(lambda desk: desk.wait(float(seconds)))

    async def _arm(self, run: object, attempt: object) -> dict[str, Any]:
        which = _whole(run, "run"), _whole(attempt, "attempt")
        return await self._ask(lambda desk: {"token": desk.arm(*which)})

    async def _fire(self, token: object) -> dict[str, Any]:
        number = _whole(token, "token")
        return await self._ask(lambda desk: desk.fire(number))

    async def _collect(self, run: object, attempt: object) -> dict[str, Any]:
        which = _whole(run, "run"), _whole(attempt, "attempt")

        def work(desk: Desk) -> None:
            desk.collect(*which)

        return await self._ask(work, writes=False)

    async def _test_release(self) -> dict[str, Any]:
        return await self._ask(lambda desk: desk.test_release())

    async def _log_state(
        self, run: object, attempt: object, state: object, reasons: object
    ) -> dict[str, Any]:
        which = _whole(run, "run"), _whole(attempt, "attempt")
        if not isinstance(reasons, list):
            raise rpc.RpcError(rpc.BAD_PARAMS, "reasons: a list")
        why = tuple(_text(reason, "reasons") for reason in reasons)
        try:
            new = RunState(_text(state, "state"))
        except ValueError:
            raise rpc.RpcError(rpc.BAD_PARAMS, f"state: {state} is none") from None
        return await self._ask(lambda desk: desk.log_state(*which, new, why))

    async def _ask(self, work: Callable[[Desk], Any], *, writes: bool = True) -> dict[str, Any]:
        self._server.lease.require(self._client)
        done = self._server.worker.submit(work, self._client, writes=writes)
        result = await asyncio.wrap_future(done)
        found: dict[str, Any] = {} if result is None else result
        return found


def _whole(value: object, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise rpc.RpcError(rpc.BAD_PARAMS, f"{name}: a whole number")
    return value


def _text(value: object, name: str) -> str:
    if not isinstance(value, str):
        raise rpc.RpcError(rpc.BAD_PARAMS, f"{name}: a text")
    return value
