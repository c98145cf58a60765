"""The methods of the interface, see API.md: what they take, who may call them, what they do."""

from __future__ import annotations

import asyncio
import logging
import os
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.daemon import rpc
from rig.errors import DeviceTimeoutError
from rig.printable import encodable, one_line
from rig.reasons import Reason, make_error, plain_reason, read_record
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from inspect import Signature

    from rig.daemon.admission import Admission
    from rig.daemon.connection import Connection
    from rig.daemon.lease import Lease
    from rig.daemon.publisher import Publisher
    from rig.daemon.worker import Worker
    from rig.recorder.controller import Controller

log = logging.getLogger(__name__)
_ANY_NUMBER = (int, float)
_STOP_S = 1.0  # for the board's answer; what is not known by then is said so


class Service:
    """Carries out what clients ask for.

    Parameters
    ----------
    url
        The port, as the user named it.
    token
        What a client must know; empty for nothing.
    worker
        Does what needs the port or the session.
    lease
        Who is in control.
    publisher
        Shows everything.
    admission
        Who is let in.
    """

    def __init__(
        self,
        url: str,
        token: str,
        worker: Worker,
        lease: Lease,
        publisher: Publisher,
        admission: Admission,
    ) -> None:
        self._url = url
        self._token = token
        self._worker = worker
        self._lease = lease
        self._publisher = publisher
        self._admission = admission
        self._published = publisher.published
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
            "unblind": self._unblind,
        }

    async def do(self, client: Connection, request: rpc.Request) -> Any:
        """Carry out one request of a client.

        Raises
        ------
        RpcError
            It is none of the interface.
        RigError
            It failed.
        """
        method = self._methods.get(request.method)
        if method is None:
            raise rpc.RpcError(rpc.NO_METHOD, f"no method {one_line(request.method, 80)}")
        if not client.name and request.method != "hello":
            raise rpc.RpcError(rpc.INVALID, "hello comes first")
        self._admission.check(client, request.method)
        _check_names(request.method, signature(method), request.params)
        return await method(client, **request.params)

    def left(self, client: Connection) -> None:
        """Note that a client is gone: what it had armed is disarmed."""
        self._admission.left(client)
        self._publisher.discard(client)
        self._release(client)

    def show_control(self) -> None:
        """Show who is in control now."""
        control = None if self._lease.holder is None else {"client": self._lease.name}
        if control != self._published.get("control"):
            log.info("in control: %s", control["client"] if control else "nobody")
        self._published.set(control=control)

    def _release(self, who: Connection) -> None:
        if self._lease.release(who):
            self._worker.lost()
            self.show_control()

    async def _hello(
        self, who: Connection, /, api: object, client: object, token: object = ""
    ) -> dict[str, Any]:
        if isinstance(api, bool) or api != rpc.API:
            versions = {"client": one_line(str(api), 40), "rig": __version__, "daemon": rpc.API}
            raise make_error(rpc.VersionError, "daemon_version", **versions)
        if self._token and token != self._token:
            raise rpc.RpcError(rpc.INVALID, "wrong token")
        name = one_line(_text(client, "client"), 80) or "a client"
        if not who.name:
            self._admission.welcome(who)
            self._publisher.add(who)
        who.name = name
        return {
            "api": rpc.API,
            "version": __version__,
            "pid": os.getpid(),
            "port": self._url,
            "path": self._published.get("port")["path"],
        }

    async def _subscribe(self, who: Connection, /) -> dict[str, Any]:
        return self._publisher.subscribe(who)

    async def _unsubscribe(self, who: Connection, /) -> dict[str, Any]:
        self._publisher.unsubscribe(who)
        return {}

    async def _take_control(self, who: Connection, /) -> dict[str, Any]:
        self._lease.take(who, who.name)
        self.show_control()
        return {}

    async def _release_control(self, who: Connection, /) -> dict[str, Any]:
        self._release(who)
        return {}

    async def _renew(self, _who: Connection, /) -> dict[str, Any]:
        return {"disk_s": self._worker.disk_s()}  # every line is a sign of life

    async def _stop(self, who: Connection, /, reason: object = "") -> dict[str, Any]:
        said = one_line(_text(reason, "reason"), 200) or f"stopped by {who.name}"
        done = asyncio.wrap_future(self._worker.stop(said))
        await asyncio.wait([done], timeout=_STOP_S)
        if not done.done():
            stalled = self._worker.stalled()
            because = f": {stalled.message}" if stalled else ""
            raise make_error(DeviceTimeoutError, "stop_unknown", because=because)
        return done.result() or {}

    async def _open_session(
        self, who: Connection, /, protocol: object, session: object, seed: object = None
    ) -> dict[str, Any]:
        names = _path(protocol, "protocol"), _path(session, "session")
        chosen = None if seed is None else _whole(seed, "seed")

        def work(controller: Controller) -> dict[str, Any]:
            fetched = controller.open_session(*names, chosen)
            return {"session": self._published.get("session"), "fetched": fetched}

        return await self._ask(who, work, writes=False)

    async def _close_session(self, who: Connection, /) -> dict[str, Any]:
        return await self._ask(who, lambda controller: controller.close_session(), writes=False)

    async def _wait(self, who: Connection, /, seconds: object) -> dict[str, Any]:
        if isinstance(seconds, bool) or not isinstance(seconds, _ANY_NUMBER):
            raise rpc.RpcError(rpc.BAD_PARAMS, "seconds: a number")
        if not 0.0 <= seconds <= 3600.0:
            raise rpc.RpcError(rpc.BAD_PARAMS, "seconds: from 0 to 3600")
        return await self._ask(who, lambda controller: controller.wait(float(seconds)))

    async def _arm(self, who: Connection, /, run: object, attempt: object) -> dict[str, Any]:
        which = _whole(run, "run"), _whole(attempt, "attempt")
        return await self._ask(who, lambda controller: {"token": controller.arm(*which)})

    async def _fire(self, who: Connection, /, token: object) -> dict[str, Any]:
        number = _whole(token, "token")
        return await self._ask(who, lambda controller: controller.fire(number))

    async def _collect(self, who: Connection, /, run: object, attempt: object) -> dict[str, Any]:
        which = _whole(run, "run"), _whole(attempt, "attempt")

        def work(controller: Controller) -> None:
            controller.collect(*which)

        return await self._ask(who, work, writes=False)

    async def _test_release(self, who: Connection, /) -> dict[str, Any]:
        return await self._ask(who, lambda controller: controller.test_release())

    async def _log_state(
        self, who: Connection, /, run: object, attempt: object, state: object, reasons: object
    ) -> dict[str, Any]:
        which = _whole(run, "run"), _whole(attempt, "attempt")
        if not isinstance(reasons, list):
            raise rpc.RpcError(rpc.BAD_PARAMS, "reasons: a list")
        why = tuple(_reason(reason) for reason in reasons)
        try:
            new = RunState(_text(state, "state"))
        except ValueError:
            raise rpc.RpcError(
                rpc.BAD_PARAMS, f"state: {one_line(str(state), 80)} is none"
            ) from None
        return await self._ask(who, lambda controller: controller.log_state(*which, new, why))

    async def _unblind(self, who: Connection, /) -> dict[str, Any]:
        return await self._ask(who, lambda controller: controller.unblind())

    async def _ask(
        self, who: Connection, work: Callable[[Controller], Any], *, writes: bool = True
    ) -> dict[str, Any]:
        self._lease.require(who)
        done = self._worker.submit(work, who, writes=writes)
        result = await asyncio.wrap_future(done)
        found: dict[str, Any] = {} if result is None else result
        return found


def _whole(value: object, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise rpc.RpcError(rpc.BAD_PARAMS, f"{name}: a whole number")
    return value


def _reason(value: object) -> Reason:
    if isinstance(value, str):
        return plain_reason(encodable(value))
    try:
        return read_record(value)
    except TypeError as error:
        raise rpc.RpcError(rpc.BAD_PARAMS, f"reasons: {one_line(str(error), 80)}") from None


def _text(value: object, name: str) -> str:
    if not isinstance(value, str):
        raise rpc.RpcError(rpc.BAD_PARAMS, f"{name}: a text")
    return value


def _path(value: object, name: str) -> str:
    text = _text(value, name)
    try:
        fit = b"\0" not in os.fsencode(text) and Path(text).is_absolute()
    except UnicodeEncodeError:
        fit = False
    if not fit:
        raise rpc.RpcError(rpc.BAD_PARAMS, f"{name}: a path from the root, as in /home/ada/drops")
    return text


def _check_names(method: str, accepted: Signature, given: dict[str, Any]) -> None:
    """See that each parameter is one, and that those are there that must be.

    Raises
    ------
    RpcError
        In words.
    """
    known = [one for one in accepted.parameters.values() if one.kind is not one.POSITIONAL_ONLY]
    unknown = sorted(given.keys() - {one.name for one in known})
    missing = [one.name for one in known if one.default is one.empty and one.name not in given]
    for names, what in ((unknown, "no such parameter"), (missing, "it needs")):
        if names:
            told = one_line(", ".join(names), 200)
            raise rpc.RpcError(rpc.BAD_PARAMS, f"{method}: {what}: {told}")
