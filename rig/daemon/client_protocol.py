"""A client's side of the protocol: messages, and the copy of the state; without any I/O."""

from __future__ import annotations

import json
from typing import Any

from rig.daemon import rpc
from rig.errors import DeviceError, DeviceTimeoutError
from rig.reasons import make_error

HELLO_PATIENCE_S = 10.0
"""How long a client waits for the answer to `hello`."""


class ClientProtocol:
    """Numbers requests, and finds messages in the bytes that come."""

    def __init__(self) -> None:
        self._number = 0
        self._rest = bytearray()  # of a line that has not ended yet

    def ask(self, method: str, params: dict[str, Any]) -> tuple[int, bytes]:
        """Write a request; give its number, which the answer will have, too."""
        self._number += 1
        return self._number, rpc.request(method, params, self._number)

    def feed(self, data: bytes) -> list[dict[str, Any]]:
        """Take the next bytes, none for the end, and give the messages that are whole.

        Raises
        ------
        DeviceError
            It hung up, or is no daemon of this rig.
        """
        if not data:
            raise gone("it hung up")
        self._rest += data
        if b"\n" not in data:
            lines: list[bytearray] = []
        else:
            *lines, self._rest = self._rest.split(b"\n")
        try:
            messages = [json.loads(line) for line in lines]
        except ValueError:
            messages = [None]
        if len(self._rest) > rpc.MESSAGE_LIMIT or not all(isinstance(m, dict) for m in messages):
            raise make_error(DeviceError, "not_a_daemon")
        return messages


class Replica:
    """A client's copy of the state, as API.md describes it.

    Attributes
    ----------
    n
        Number of the last change that is in it.
    state
        Sections by name.
    """

    def __init__(self) -> None:
        self.n = 0
        self.state: dict[str, Any] = {}

    def snapshot(self, message: dict[str, Any]) -> None:
        """Take a whole state: the answer to ``subscribe``, or a ``snapshot``."""
        self.n, self.state = message["n"], message["state"]

    def change(self, message: dict[str, Any]) -> None:
        """Take a ``change``.

        Raises
        ------
        ValueError
            One is missing before it: the daemon never leaves one out.
        """
        if message["n"] != self.n + 1:
            raise ValueError(f"change {message['n']} behind {self.n}")
        self.n = message["n"]
        self.state |= message.get("set", {})
        changed = {run["run"]: run for run in message.get("runs", [])}
        if changed:
            self.state["runs"] = [changed.get(run["run"], run) for run in self.state["runs"]]
        self.state["edges"] += message.get("edges", [])

    def notified(self, method: str, params: dict[str, Any]) -> None:
        """Take any notification of the two kinds."""
        if method == "snapshot":
            self.snapshot(params)
        elif method == "change":
            self.change(params)


def turned_away(message: dict[str, Any]) -> bool:
    """Whether a message is an error that answers no request: the daemon hangs up after it."""
    return "error" in message and message.get("id") is None


def hello(name: str, token: str) -> dict[str, Any]:
    """Give the parameters of the first request, see API.md.

    Parameters
    ----------
    name
        What others are told of this client.
    token
        From `rig.daemon.socket_path.reach`.
    """
    return {"api": rpc.API, "client": name} | ({"token": token} if token else {})


def gone(why: object) -> DeviceError:
    """Make the error that says that a daemon is gone."""
    return make_error(DeviceError, "daemon_gone", text=why)


def silent(path: object) -> DeviceTimeoutError:
    """Make the error that says that a daemon takes connections and answers nothing."""
    patience_s = HELLO_PATIENCE_S
    return make_error(DeviceTimeoutError, "daemon_silent", path=path, patience_s=patience_s)
