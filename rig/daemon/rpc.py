"""JSON-RPC 2.0, one message a line, and errors as data: a client shows what the daemon raised."""

import json
import logging
from typing import Any, Literal

import msgspec

from rig import errors
from rig.errors import RigError
from rig.link.messages import DisarmReason, RefusalReason
from rig.link.refusals import DeviceRefusedError
from rig.printable import one_line
from rig.reasons import read_record, rig_error

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
WAITING_LIMIT = 64
"""Requests of one connection that may wait for their answers."""


class RpcError(Exception):
    """A line that is no proper request, with JSON-RPC's own code."""

    def __init__(self, code: int, message: str, number: int | float | str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.id = number


_ELSEWHERE = {"ClusterError", "DomainError"}  # of a sweep and of a model: no rig raises them
_KINDS: dict[str, type[RigError]] = {
    name: kind
    for name, kind in (vars(errors) | {"DeviceRefusedError": DeviceRefusedError}).items()
    if name.endswith("Error") and name not in _ELSEWHERE
}
"""Errors by the names that API.md lists."""


class Request(msgspec.Struct, frozen=True, kw_only=True):
    """A request."""

    jsonrpc: Literal["2.0"]
    method: str
    id: int | float | str | None
    params: Any = msgspec.field(default_factory=dict)


def read_line(line: bytes) -> Request | RpcError:
    """Read one line from a client."""
    try:
        # What is made of NaN and Infinity, which JSON does not have, is an error.
        message = json.loads(line, parse_constant=int)
    except (ValueError, RecursionError):
        return RpcError(PARSE, "not JSON")
    try:
        return msgspec.convert(message, Request)
    except msgspec.ValidationError as error:
        number = message.get("id") if isinstance(message, dict) else None
        known = isinstance(number, int | float | str) and not isinstance(number, bool)
        text = one_line(f"not a request of JSON-RPC 2.0: {error}", 200)
        return RpcError(INVALID, text, number if known else None)


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


def in_words(error: Exception) -> RigError:
    """Put any failure into words."""
    if isinstance(error, RigError):
        return error
    if isinstance(error, OSError) and error.filename:  # of a file that a client has named
        return rig_error("file_failed", path=str(error.filename), text=error)
    log.error("internal error", exc_info=error)
    return rig_error("internal_error")


def error_to_data(error: RigError) -> dict[str, Any]:
    """Write an error as API.md says; an unknown kind becomes the nearest listed one above it."""
    refusal = {name: getattr(error, name, None) for name in ("reason", "detail", "disarmed")}
    return {
        "kind": next(kind.__name__ for kind in type(error).__mro__ if kind in _KINDS.values()),
        "message": error.message,
        "hint": error.hint,
        "exit_code": error.exit_code,
        "reason_codes": [reason.record() for reason in error.reasons],
    } | {name: getattr(value, "name", value) for name, value in refusal.items()}


def error_of(member: dict[str, Any]) -> RigError:
    """Make the error that an answer has; of a kind this program does not know it is `RigError`."""
    data = member.get("data")
    if not isinstance(data, dict):
        return rig_error("not_understood", text=str(member.get("message")))
    if data.get("kind") == "DeviceRefusedError":
        disarmed = DisarmReason[data["disarmed"]] if data.get("disarmed") else None
        return DeviceRefusedError(RefusalReason[data["reason"]], data["detail"], disarmed)
    kind = _KINDS.get(str(data.get("kind")), RigError)
    error = kind(str(data.get("message", "")), str(data.get("hint", "")))
    error.exit_code = int(data.get("exit_code", kind.exit_code))
    error.reasons = tuple(map(read_record, data.get("reason_codes") or ()))
    return error


def _line(message: dict[str, Any]) -> bytes:
    # Escaped, for a file's name may have bytes that are no text, and then UTF-8 cannot hold it.
    return json.dumps(message, separators=(",", ":")).encode("ascii") + b"\n"
