"""JSON-RPC 2.0, one message a line, and errors as data: a client shows what the daemon raised."""

from __future__ import annotations

import json
import logging
from dataclasses import dataclass
from typing import Any

from rig.daemon.lease import ControlError
from rig.errors import DeviceError, DeviceTimeoutError, InputError, RigError, SessionError
from rig.link.messages import DisarmReason, Reason
from rig.link.refusals import DeviceRefusedError
from rig.recorder.interrupts import StoppedError

log = logging.getLogger(__name__)
API = 1
"""Version of the interface that API.md describes."""
REQUEST_LIMIT = 1 << 16
"""Bytes of a line to the daemon: a client that sends more is broken or worse."""
MESSAGE_LIMIT = 1 << 24
"""Bytes of a line from the daemon: a snapshot with the edges of a very long drop."""
PARSE, INVALID, NO_METHOD, BAD_PARAMS = -32700, -32600, -32601, -32602
FAILURE = -32000


class VersionError(RigError):
    """Client and daemon do not speak the same interface."""

    exit_code = 4


class RpcError(Exception):
    """A line that is no proper request, with JSON-RPC's own code."""

    def __init__(self, code: int, message: str, request_id: object = None) -> None:
        super().__init__(message)
        self.code = code
        self.request_id = request_id


_KINDS: dict[str, type[RigError]] = {
    kind.__name__: kind
    for kind in (
        RigError,
        InputError,
        SessionError,
        DeviceError,
        DeviceTimeoutError,
        ControlError,
        StoppedError,
        VersionError,
    )
}


@dataclass(frozen=True, slots=True)
class Request:
    """A request, or a notification when `id` is `None`."""

    method: str
    params: dict[str, Any]
    id: int | str | None


def read_request(line: bytes) -> Request:
    """Read one line from a client.

    Raises
    ------
    RpcError
        It is no request.
    """
    try:
        message = json.loads(line)
    except (ValueError, RecursionError):
        raise RpcError(PARSE, "not JSON") from None
    if not isinstance(message, dict):
        raise RpcError(INVALID, "not a request")
    number, method, params = message.get("id"), message.get("method"), message.get("params", {})
    if isinstance(number, bool) or not isinstance(number, int | str | None):
        raise RpcError(INVALID, "an id is a number or a text")
    if message.get("jsonrpc") != "2.0" or not isinstance(method, str):
        raise RpcError(INVALID, "not a request of JSON-RPC 2.0", number)
    if not isinstance(params, dict):
        raise RpcError(BAD_PARAMS, "parameters have names here", number)
    return Request(method, params, number)


def request(method: str, params: dict[str, Any], number: int | None) -> bytes:
    """Write a request; a notification when there is no number."""
    message: dict[str, Any] = {"jsonrpc": "2.0", "method": method, "params": params}
    return _line(message if number is None else message | {"id": number})


def answer(number: object, result: object) -> bytes:
    """Write the answer to a request."""
    return _line({"jsonrpc": "2.0", "id": number, "result": result})


def failure(number: object, error: Exception) -> bytes:
    """Write that a request failed, whatever the reason."""
    if isinstance(error, RpcError):
        told: dict[str, Any] = {"code": error.code, "message": str(error)}
    else:
        failed = known(error)
        told = {"code": FAILURE, "message": failed.message, "data": error_to_data(failed)}
    return _line({"jsonrpc": "2.0", "id": number, "error": told})


def result_of(message: dict[str, Any]) -> Any:
    """Take the result out of an answer.

    Raises
    ------
    RigError
        What the daemon raised.
    """
    error = message.get("error")
    if error is None:
        return message.get("result")
    if isinstance(error.get("data"), dict):
        raise error_from_data(error["data"])
    raise RigError(
        f"the daemon does not understand: {error.get('message')}", "are both of one version?"
    )


def known(error: Exception) -> RigError:
    """Put any failure into words."""
    if isinstance(error, RigError):
        return error
    log.error("unexpected", exc_info=error)
    return RigError(f"unexpected: {error!r}", "a fault of this program: please report it")


def error_to_data(error: RigError) -> dict[str, Any]:
    """Write an error as API.md says; an unknown kind becomes the nearest listed one above it."""
    refused = error if isinstance(error, DeviceRefusedError) else None
    listed = (kind.__name__ for kind in type(error).__mro__ if kind.__name__ in _KINDS)
    return {
        "kind": "DeviceRefusedError" if refused else next(listed),
        "message": error.message,
        "hint": error.hint,
        "exit_code": error.exit_code,
        "reason": refused.reason.name if refused else None,
        "detail": refused.detail if refused else None,
        "disarmed": refused.disarmed.name if refused and refused.disarmed else None,
    }


def error_from_data(data: dict[str, Any]) -> RigError:
    """Make the error again; one of a kind this program does not know is a `RigError`."""
    if data.get("kind") == "DeviceRefusedError":
        disarmed = data.get("disarmed")
        return DeviceRefusedError(
            Reason[data["reason"]], data["detail"], DisarmReason[disarmed] if disarmed else None
        )
    kind = _KINDS.get(str(data.get("kind")), RigError)
    error = kind(str(data.get("message", "")), str(data.get("hint", "")))
    error.exit_code = int(data.get("exit_code", kind.exit_code))
    return error


def _line(message: dict[str, Any]) -> bytes:
    return json.dumps(message, separators=(",", ":"), ensure_ascii=False).encode() + b"\n"
