"""The methods of the interface, see API.md: one table of what they do, take and need."""

from __future__ import annotations

import asyncio
import logging
import os
from functools import partial
from inspect import isawaitable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import msgspec

from rig import __version__
from rig.daemon import rpc
from rig.daemon.admission import Admission
from rig.errors import DeviceTimeoutError
from rig.printable import encodable, one_line
from rig.reasons import Reason, make_error, plain_reason, read_record
from rig.recorder.controller import Controller
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Callable

    from rig.daemon.connection import Connection
    from rig.daemon.lease import Lease
    from rig.daemon.publisher import Publisher
    from rig.daemon.worker import Worker

log = logging.getLogger(__name__)
_STOP_S = 1.0  # for the board's answer; what is not known by then is said so


class Service:
    """Carries out what clients ask for.

    Parameters
    ----------
    token
        What a client must know; empty for nothing.
    worker
        Does what needs the port or the session.
    lease
        Who is in control.
    publisher
        Shows everything.

    Attributes
    ----------
    admission
        Who is let in.
    """

    def __init__(self, token: str, worker: Worker, lease: Lease, publisher: Publisher) -> None:
        self.token = token
        self.worker = worker
        self.lease = lease
        self.publisher = publisher
        self.admission = Admission()

    async def do(self, client: Connection, request: rpc.Request) -> Any:
        """Carry out one request of a client.

        Raises
        ------
        RpcError
            It is none of the interface.
        RigError
            It failed.
        """
        method = METHODS.get(request.method)
        if method is None:
            raise rpc.RpcError(rpc.NO_METHOD, f"no method {one_line(request.method, 80)}")
        if not client.name and request.method != "hello":
            raise rpc.RpcError(rpc.INVALID, "hello comes first")
        self.admission.check(client, request.method)
        try:
            parsed = msgspec.convert(request.params, method.parameters, dec_hook=_read_value)
        except msgspec.ValidationError as error:
            text = one_line(f"{request.method}: {error}", 200)
            raise rpc.RpcError(rpc.BAD_PARAMS, text) from None
        values = {name: getattr(parsed, name) for name in parsed.__struct_fields__}
        if method.of_rig:
            self.lease.require(client)
            work = partial(method.do, **values)
            result = asyncio.wrap_future(self.worker.submit(work, client, writes=method.writes))
        else:
            result = method.do(self, client, **values)
        if isawaitable(result):
            result = await result
        return result if isinstance(result, dict) else {}

    def forget(self, client: Connection) -> None:
        """Note that a client is gone: what it had armed is disarmed."""
        self.admission.forget(client)
        self.publisher.discard(client)
        self.release(client)

    def release(self, client: Connection) -> None:
        """Take control away from a client, when it has it."""
        if self.lease.release(client):
            self.worker.wake()
            self.show_control()

    def show_control(self) -> None:
        """Show who is in control now."""
        published = self.publisher.published
        control = None if self.lease.holder is None else {"client": self.lease.name}
        if control != published.get("control"):
            log.info("in control: %s", control["client"] if control else "nobody")
        published.set(control=control)


class ApiMethod(NamedTuple):
    """One row of the table.

    Attributes
    ----------
    do
        Called with service and client; of a method of the rig with the worker's `Controller`, in
        its thread.
    parameters
        Their names and types, which `msgspec` compares with what a client sent.
    of_rig
        Whether it needs control.
    writes
        Whether it makes no sense while the session file cannot be written.
    """

    do: Callable[..., Any]
    parameters: type[msgspec.Struct]
    of_rig: bool = False
    writes: bool = False


class Reasons(tuple[Reason, ...]):
    """A list in which clients write reasons as texts or as records."""

    __slots__ = ()


def _read_value(kind: type, value: Any) -> Any:
    """Read a parameter of a kind of our own."""
    if kind is Reasons:
        if not isinstance(value, list):
            raise TypeError("reasons: a list")
        return Reasons(
            plain_reason(encodable(reason)) if isinstance(reason, str) else read_record(reason)
            for reason in value
        )
    try:
        if isinstance(value, str) and b"\0" not in os.fsencode(value) and value.startswith("/"):
            return Path(value)
    except UnicodeEncodeError:
        pass
    raise ValueError("a path from the root is needed, as in /home/ada/drops")


def _hello(
    service: Service, caller: Connection, api: object, client: str, token: str
) -> dict[str, Any]:
    if isinstance(api, bool) or api != rpc.API:
        versions = {"client": one_line(str(api), 40), "rig": __version__, "daemon": rpc.API}
        raise make_error(rpc.VersionError, "daemon_version", **versions)
    if service.token and token != service.token:
        raise rpc.RpcError(rpc.INVALID, "wrong token")
    if not caller.name:
        service.admission.welcome(caller)
        service.publisher.add(caller)
    caller.name = one_line(client, 80) or "a client"
    port = service.publisher.published.get("port")
    return {
        "api": rpc.API,
        "version": __version__,
        "pid": os.getpid(),
        "port": port["url"],
        "path": port["path"],
    }


def _take_control(service: Service, client: Connection) -> None:
    service.lease.take(client, client.name)
    service.show_control()


async def _stop(service: Service, client: Connection, reason: str) -> None:
    text = one_line(reason, 200) or f"stopped by {client.name}"
    done = asyncio.wrap_future(service.worker.stop(text))
    await asyncio.wait([done], timeout=_STOP_S)
    if not done.done():
        stalled = service.worker.stall()
        because = f": {stalled.message}" if stalled else ""
        raise make_error(DeviceTimeoutError, "stop_unknown", because=because)
    done.result()


def _open_session(
    rig: Controller, protocol: Path, session: Path, seed: int | None
) -> dict[str, Any]:
    fetched = rig.open_session(str(protocol), str(session), seed)
    return {"session": rig.published.get("session"), "fetched": fetched}


def _log_state(rig: Controller, reasons: Reasons, **values: Any) -> None:
    rig.log_state(reasons=tuple(reasons), **values)


def _at_once(do: Callable[..., Any], **parameters: Any) -> ApiMethod:
    return ApiMethod(do, _declare(parameters))


def _of_rig(do: Callable[..., Any], *, writes: bool = True, **parameters: Any) -> ApiMethod:
    return ApiMethod(do, _declare(parameters), of_rig=True, writes=writes)


def _declare(parameters: dict[str, Any]) -> type[msgspec.Struct]:
    """Make what reads parameters: of each its type, and its default where it may be missing."""
    fields = [(name, *(of if isinstance(of, tuple) else (of,))) for name, of in parameters.items()]
    return msgspec.defstruct("Parameters", fields, kw_only=True, forbid_unknown_fields=True)


_SECONDS = Annotated[float, msgspec.Meta(ge=0.0, le=3600.0)]
METHODS = {
    "hello": _at_once(_hello, api=Any, client=str, token=(str, "")),
    "subscribe": _at_once(lambda service, client: service.publisher.subscribe(client)),
    "unsubscribe": _at_once(lambda service, client: service.publisher.unsubscribe(client)),
    "take_control": _at_once(_take_control),
    "release_control": _at_once(Service.release),
    "renew": _at_once(lambda service, _: {"disk_s": service.worker.disk_s()}),
    "stop": _at_once(_stop, reason=(str, "")),
    "open_session": _of_rig(
        _open_session, protocol=Path, session=Path, seed=(int | None, None), writes=False
    ),
    "close_session": _of_rig(Controller.close_session, writes=False),
    "wait": _of_rig(Controller.wait, seconds=_SECONDS),
    "arm": _of_rig(lambda rig, **job: {"token": rig.arm(**job)}, run=int, attempt=int),
    "fire": _of_rig(Controller.fire, token=int),
    "collect": _of_rig(Controller.collect, run=int, attempt=int, writes=False),
    "test_release": _of_rig(Controller.test_release),
    "log_state": _of_rig(_log_state, run=int, attempt=int, state=RunState, reasons=Reasons),
    "unblind": _of_rig(Controller.unblind),
}
