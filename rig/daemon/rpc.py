"""JSON-RPC 2.0, one message a line, and errors as data: a client shows what the daemon raised."""

from __future__ import annotations

import json
import logging
from dataclasses import dataclass
from typing import Any, NoReturn, TypeAlias

from rig.daemon.lease import ControlError
from rig.errors import DeviceError, DeviceTimeoutError, InputError, RigError, SessionError
from rig.link.messages import DisarmReason, RefusalReason
from rig.link.refusals import DeviceRefusedError
from rig.reasons import make_error, read_record
from rig.recorder.interrupts import StoppedError

log = logging.getLogger(__name__)
API = 1
"""Version of the interface that API.md describes."""
REQUEST_LIMIT = 1 << 16
"""Bytes of a line to the daemon: a client that sends more is broken or worse."""
MESSAGE_LIMIT = 1 << 24
"""Bytes of a line from the daemon: a snapshot with the edges of a very long drop."""
UNREAD_LIMIT = 1 << 22
"""Bytes of answers that a client leaves unread before the daemon reads no more of its requests."""
PARSE, INVALID, NO_METHOD, BAD_PARAMS = -32700, -32600, -32601, -32602
FAILURE = -32000
BATCH_LIMIT = 64
"""Requests of one connection that may wait for their answers, in a batch or one by one."""


class BusyError(DeviceError):
    """So many clients are there, or so many requests wait, that no more is taken."""


class VersionError(RigError):
    """Client and daemon do not speak the same interface."""

    exit_code = 4


class RpcError(Exception):
    """A line that is no proper request, with JSON-RPC's own code."""

    def __init__(
        self, code: int, message: str, request_id: RequestId = None, *, silent: bool = False
    ) -> None:
        super().__init__(message)
        self.code = code
        self.id = request_id
        self.silent = silent  # of a notification, which is never answered


_KINDS: dict[str, type[RigError]] = {
    kind.__name__: kind
    for kind in (
        RigError, InputError, SessionError, DeviceError, DeviceTimeoutError, BusyError,
        DeviceRefusedError, ControlError, StoppedError, VersionError,
    )
}  # fmt: skip


RequestId: TypeAlias = "int | float | str | None"


@dataclass(frozen=True, slots=True)
class Request:
    """A request; a notification is `silent`: it gets no answer."""

    method: str
    params: dict[str, Any]
    id: RequestId
    silent: bool = False


def read_line(line: bytes) -> Request | RpcError | list[Request | RpcError]:
    """Read one line from a client: a message, or a batch of them."""
    try:
        message = json.loads(line, parse_constant=_no_number)
    except (ValueError, RecursionError):
        return RpcError(PARSE, "not JSON")
    if not isinstance(message, list):
        return _read_message(message)
    if not 0 < len(message) <= BATCH_LIMIT:
        return RpcError(INVALID, f"a batch has 1 to {BATCH_LIMIT} requests")
    return [*map(_read_message, message)]


def _read_message(message: Any) -> Request | RpcError:
    if not isinstance(message, dict):
        return RpcError(INVALID, "not a request")
    number, method, params = message.get("id"), message.get("method"), message.get("params", {})
    if isinstance(number, bool) or not isinstance(number, int | float | str | None):
        return RpcError(INVALID, "an id is a number or a text")
    if message.get("jsonrpc") != "2.0" or not isinstance(method, str):
        return RpcError(INVALID, "not a request of JSON-RPC 2.0", number)
    silent = "id" not in message
    if not isinstance(params, dict):
        return RpcError(BAD_PARAMS, "parameters have names here", number, silent=silent)
    return Request(method, params, number, silent)


def _no_number(text: str) -> NoReturn:
    raise ValueError(text)


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
        data: dict[str, Any] = {"code": error.code, "message": str(error)}
    else:
        failed = in_words(error)
        data = {"code": FAILURE, "message": failed.message, "data": error_to_data(failed)}
    return _line({"jsonrpc": "2.0", "id": number, "error": data})


def error_of(message: dict[str, Any]) -> RigError:
    """Make the error of an answer that is one."""
    error = message["error"]
    if isinstance(error.get("data"), dict):
        return error_from_data(error["data"])
    return make_error(RigError, "not_understood", text=str(error.get("message")))


def in_words(error: Exception) -> RigError:
    """Put any failure into words."""
    if isinstance(error, RigError):
        return error
    if isinstance(error, OSError) and error.filename:  # of a file that a client has named
        return make_error(InputError, "file_failed", path=str(error.filename), text=error)
    log.error("internal error", exc_info=error)
    return make_error(RigError, "internal_error")


def error_to_data(error: RigError) -> dict[str, Any]:
    """Write an error as API.md says; an unknown kind becomes the nearest listed one above it."""
    refused = error if isinstance(error, DeviceRefusedError) else None
    return {
        "kind": next(kind.__name__ for kind in type(error).__mro__ if kind in _KINDS.values()),
        "message": error.message,
        "hint": error.hint,
        "exit_code": error.exit_code,
        "reason": refused.reason.name if refused else None,
        "detail": refused.detail if refused else None,
        "disarmed": refused.disarmed.name if refused and refused.disarmed else None,
        "reason_codes": [reason.record() for reason in error.reasons],
    }


def error_from_data(data: dict[str, Any]) -> RigError:
    """Make the error again; one of a kind this program does not know is a `RigError`."""
    if data.get("kind") == "DeviceRefusedError":
        disarmed = data.get("disarmed")
        return DeviceRefusedError(
            RefusalReason[data["reason"]],
            data["detail"],
            DisarmReason[disarmed] if disarmed else None,
        )
    kind = _KINDS.get(str(data.get("kind")), RigError)
    error = kind(str(data.get("message", "")), str(data.get("hint", "")))
    error.exit_code = int(data.get("exit_code", kind.exit_code))
    error.reasons = tuple(map(read_record, data.get("reason_codes") or ()))
    return error


def _line(message: dict[str, Any]) -> bytes:
    # Escaped, for a file's name may have bytes that are no text, and then UTF-8 cannot hold it.
    return json.dumps(message, separators=(",", ":")).encode("ascii") + b"\n"
