"""What a daemon says of itself: one line for whatever whoever started it wants to know."""

from __future__ import annotations

import os
import queue
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_WAITING = 1000  # lines that a terminal which does not take them may be behind


class Narration:
    """Turns changes of the state into lines, each once."""

    def __init__(self) -> None:
        self._last: dict[str, str] = {}
        self._board = ""

    def lines(self, change: Mapping[str, Any]) -> Iterator[str]:
        """Say what a change of `rig.recorder.published.PublishedState.take` is about.

        Yields
        ------
        str
            A line; few changes are worth one.
        """
        new = change.get("set", {})
        device = new.get("device")
        if device is not None:
            self._board = f"{device['board']}, id {device['unique_id']}"
        for section in ("link", "error", "session", "control", "drop"):
            if section in new:
                line = getattr(self, f"_{section}")(new[section])
                if line and self._last.get(section) != line:
                    yield line
                self._last[section] = line or self._last.get(section, "")

    def _link(self, link: Mapping[str, Any]) -> str:
        if link["state"] == "up":
            return f"up: {self._board}"
        return f"down: {_said(link['error'])}" if link["state"] == "down" else ""

    def _error(self, error: Mapping[str, Any] | None) -> str:
        # A link that is down says so itself.
        return f"trouble: {_said(error)}" if error and error.get("kind") == "SessionError" else ""

    def _session(self, session: Mapping[str, Any] | None) -> str:
        return "no session" if session is None else f"session: {session['path']}"

    def _control(self, control: Mapping[str, Any] | None) -> str:
        return "nobody in control" if control is None else f"in control: {control['client']}"

    def _drop(self, drop: Mapping[str, Any] | None) -> str:
        if drop is None or drop["state"] not in {"recorded", "interrupted"}:
            return ""
        events = f", {drop['events']} events" if drop["state"] == "recorded" else ""
        return f"run {drop['run']}, attempt {drop['attempt']}: {drop['state']}{events}"


def _said(error: Mapping[str, Any]) -> str:
    return f"{error['message']} ({error['hint']})" if error["hint"] else str(error["message"])


class Teller:
    """Writes lines to stderr in a thread of its own.

    A terminal may stop taking them at any time, and clients must not wait for it.
    """

    def __init__(self) -> None:
        self._lines: queue.Queue[str] = queue.Queue(_WAITING)
        threading.Thread(target=self._write, name="teller", daemon=True).start()

    def tell(self, line: str) -> None:
        """Write a line when it can be written; when too many wait, never."""
        with suppress(queue.Full):
            self._lines.put_nowait(line)

    def _write(self) -> None:
        while True:
            line = self._lines.get()
            with suppress(OSError):
                os.write(2, f"{line}\n".encode())  # past Python's buffer and its lock
