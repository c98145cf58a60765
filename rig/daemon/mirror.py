"""A client's copy of the daemon's state, kept up to date by what the daemon sends."""

from __future__ import annotations

from typing import Any


class Mirror:
    """The state as API.md describes it.

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
