"""The methods of the interface, see API.md: one table of what they do, take and need."""

import asyncio
import logging
from collections.abc import Callable
from functools import partial
from inspect import isawaitable
from typing import Annotated, Any, NamedTuple

import msgspec

from rig import __version__
from rig.daemon import rpc
from rig.daemon.connection import CLIENTS, Connection
from rig.daemon.lease import Lease
from rig.daemon.publisher import Publisher
from rig.daemon.worker import Worker
from rig.printable import encodable, one_line
from rig.reasons import plain_reason, read_record, rig_error
from rig.recorder.controller import Controller
from rig.recorder.published import PublishedState
from rig.session.schema import RunState

log = logging.getLogger(__name__)
_STOP_S = 1.0  # for the board's answer; what is not known by then is said so


class Service:
    """Carries out what clients ask for.

    Parameters
    ----------
    url
        The port.

    Attributes
    ----------
    published, publisher
        The state, on its way to the clients.
    lease
        Who is in control.
    worker
        Does what needs the port or the session.
    connections
        All that there are.
    """

    def __init__(self, url: str) -> None:
        self.published = PublishedState()
        self.lease = Lease()
        self.worker = Worker(url, self.published, self.lease)
        self.connections: set[Connection] = set()
        self.publisher = Publisher(self.published, self.connections)

    async def do(self, client: Connection, request: rpc.Request | rpc.RpcError) -> Any:
        """Carry out one request of a client.

        Raises
        ------
        RpcError
            It is none of the interface.
        RigError
            It failed.
        """
        if isinstance(request, rpc.RpcError):
            raise request
        method = METHODS.get(request.method)
        if method is None:
            raise rpc.RpcError(rpc.NO_METHOD, f"no method {one_line(request.method, 80)}")
        if not client.name and request.method != "hello":
            raise rpc.RpcError(rpc.INVALID, "hello comes first")
        if not client.is_client and request.method not in {"hello", "stop"}:
            raise rig_error("clients_only_stop", clients=CLIENTS)
        try:
            work = method.bind(request.params)
        except msgspec.ValidationError as error:
            text = one_line(f"{request.method}: {error}", 200)
            raise rpc.RpcError(rpc.BAD_PARAMS, text) from None
        if method.of_rig:
            self.lease.require(client)
            result = asyncio.wrap_future(self.worker.submit(work, client, writes=method.writes))
        else:
            result = work(self, client)
        if isawaitable(result):
            result = await result
        return result if isinstance(result, dict) else {}

    def forget(self, client: Connection) -> None:
        """Note that a client is gone: what it had armed is disarmed."""
        self.connections.discard(client)
        self.publisher.count()
        self.release(client)

    def release(self, client: Connection) -> None:
        """Take control away from a client, when it has it."""
        if self.lease.release(client):
            self.show_control()

    def show_control(self) -> None:
        """Show who is in control now; what was armed by whoever lost it is disarmed."""
        control = None if self.lease.holder is None else {"client": self.lease.name}
        if control != self.published.get("control"):
            log.info("in control: %s", control["client"] if control else "nobody")
            if control is None:
                self.worker.wake()
        self.published.set(control=control)


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
    of_rig: bool
    writes: bool

    def bind(self, params: Any) -> Callable[..., Any]:
        """Return what is to be done, with the parameters that a client sent.

        Raises
        ------
        msgspec.ValidationError
            They are not what the method takes.
        """
        return partial(self.do, **msgspec.structs.asdict(msgspec.convert(params, self.parameters)))


def _hello(service: Service, caller: Connection, api: object, client: str) -> dict[str, Any]:
    if isinstance(api, bool) or api != rpc.API:
        versions = {"client": one_line(str(api), 40), "rig": __version__, "daemon": rpc.API}
        raise rig_error("daemon_version", **versions)
    if not caller.name:
        others = sum(connection.is_client for connection in service.connections)
        caller.is_client = others < CLIENTS
        service.publisher.count()
    caller.name = one_line(client, 80) or "a client"
    daemon, port = service.published.get("daemon"), service.published.get("port")
    return {**daemon, "port": port["url"], "path": port["path"]}


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
        raise rig_error("stop_unknown", because=because)
    done.result()


def _open_session(rig: Controller, **names: Any) -> dict[str, Any]:
    fetched = rig.open_session(**names)
    return {"session": rig.published.get("session"), "fetched": fetched}


def _log_state(rig: Controller, reasons: list[str | dict[str, Any]], **values: Any) -> None:
    records = (
        plain_reason(encodable(reason)) if isinstance(reason, str) else read_record(reason)
        for reason in reasons
    )
    rig.log_state(reasons=tuple(records), **values)


def _method(
    do: Callable[..., Any], *, of_rig: bool = False, writes: bool = False, **parameters: Any
) -> ApiMethod:
    """Make a row: of each parameter its type, and its default where it may be missing."""
    fields = [(name, *(of if isinstance(of, tuple) else (of,))) for name, of in parameters.items()]
    reader = msgspec.defstruct("Parameters", fields, kw_only=True, forbid_unknown_fields=True)
    return ApiMethod(do, reader, of_rig, writes)


_of_rig, _writing = partial(_method, of_rig=True), partial(_method, of_rig=True, writes=True)
_PATH = Annotated[str, msgspec.Meta(pattern="^/[^\0\ud800-\udc7f\udd00-\udfff]*$")]
_SECONDS = Annotated[float, msgspec.Meta(ge=0.0, le=3600.0)]
METHODS = {
    "hello": _method(_hello, api=Any, client=str),
    "subscribe": _method(lambda service, client: service.publisher.subscribe(client)),
    "unsubscribe": _method(lambda service, client: service.publisher.unsubscribe(client)),
    "take_control": _method(_take_control),
    "release_control": _method(Service.release),
    "renew": _method(lambda service, _: {"disk_s": service.worker.disk_s()}),
    "stop": _method(_stop, reason=(str, "")),
    "open_session": _of_rig(_open_session, protocol=_PATH, session=_PATH, seed=(int | None, None)),
    "close_session": _of_rig(Controller.close_session),
    "wait": _writing(Controller.wait, seconds=_SECONDS),
    "arm": _writing(lambda rig, **job: {"token": rig.arm(**job)}, run=int, attempt=int),
    "fire": _writing(Controller.fire, token=int),
    "collect": _of_rig(Controller.collect, run=int, attempt=int),
    "test_release": _writing(Controller.test_release),
    "log_state": _writing(
        _log_state, run=int, attempt=int, state=RunState, reasons=list[str | dict[str, Any]]
    ),
    "unblind": _writing(Controller.unblind),
}
