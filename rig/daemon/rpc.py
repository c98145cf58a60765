"""JSON-RPC 2.0, one message a line; without any I/O."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from rig.daemon.faults import from_data, to_data
from rig.errors import RigError

API = 1
"""Version of the interface that API.md describes."""
REQUEST_LIMIT = 1 << 16
"""Bytes of a line to the daemon: a client that sends more is broken or worse."""
MESSAGE_LIMIT = 1 << 24
"""Bytes of a line from the daemon: a snapshot with the edges of a very long drop."""
PARSE, INVALID, NO_METHOD, BAD_PARAMS = -32700, -32600, -32601, -32602
FAILURE = -32000


class RpcError(Exception):
    """A line that is no proper request, with JSON-RPC's own code."""

    def __init__(self, code: int, message: str, request_id: object = None) -> None:
        super().__init__(message)
        self.code = code
        self.request_id = request_id


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


def failure(number: object, error: RigError | RpcError) -> bytes:
    """Write that a request failed."""
    if isinstance(error, RpcError):
        told: dict[str, Any] = {"code": error.code, "message": str(error)}
    else:
        told = {"code": FAILURE, "message": error.message, "data": to_data(error)}
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
        raise from_data(error["data"])
    raise RigError(
        f"the daemon does not understand: {error.get('message')}", "are both of one version?"
    )


def _line(message: dict[str, Any]) -> bytes:
    return json.dumps(message, separators=(",", ":"), ensure_ascii=False).encode() + b"\n"
