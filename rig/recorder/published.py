"""The state that every client sees: one snapshot, and numbered changes.

The worker writes, the server reads; neither waits for the other. What changed between two
messages is put together into one, so the rate of messages is the reader's choice and the memory
is that of the state itself, however fast the device talks.
"""

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

EDGES_LIMIT = 1 << 16
"""Edges shown of one drop; all of them are in the session file."""


def link_state(state: str, error: object = None, retry_s: float | None = None) -> dict[str, Any]:
    """Describe the link: closed, opening, up, down."""
    return {"state": state, "error": error, "retry_s": retry_s}


_SHOWN = "daemon port device statistics gates drop release_test session control error"
_FIRST: dict[str, Any] = {"link": link_state("closed"), "phase": "idle", "clients": 0}

Edge3 = tuple[int, int, int]
"""Tick, channel, blocked."""


class PublishedState:
    """The state.

    Attributes
    ----------
    changed
        Called, in the thread that made it, with the first change after a `take`.
    watched
        Whether anybody looks: what costs and is only shown can be left out otherwise.
    """

    def __init__(self) -> None:
        self.changed: Callable[[], object] = lambda: None
        self.watched = False
        self._guard = threading.Lock()
        self._sections = dict.fromkeys(_SHOWN.split()) | _FIRST
        self._phase = "idle"  # of the device
        self._runs: dict[int, dict[str, Any]] = {}
        self._edges: list[Edge3] = []
        self._n = 0
        self._dirty: set[str | int] = set()  # sections by name, runs by number
        self._sent = 0  # edges that went out

    def set(self, **sections: Any) -> None:
        """Give sections new values; equal ones are no change. An error hides the device's phase."""
        with self._changing():
            self._phase = sections.get("phase", self._phase)
            error = sections.get("error", self._sections["error"])
            for name, value in (sections | {"phase": "trouble" if error else self._phase}).items():
                if self._sections[name] != value:
                    self._sections[name] = value
                    self._dirty.add(name)

    def plan(self, runs: Iterable[dict[str, Any]]) -> None:
        """Show another plan."""
        with self._changing():
            self._runs = {run["run"]: run for run in runs}
            self._dirty.add("runs")

    def run(self, number: int, **fields: Any) -> None:
        """Change what is said of one run."""
        with self._changing():
            if number in self._runs:
                self._runs[number] = self._runs[number] | fields
                self._dirty.add(number)

    def edges(self, more: Iterable[Edge3]) -> None:
        """Show more edges of the current drop."""
        with self._changing():
            self._edges.extend(more)
            del self._edges[EDGES_LIMIT:]

    def replace_edges(self, edges: Iterable[Edge3]) -> None:
        """Show these edges instead."""
        with self._changing():
            self._edges = list(edges)[:EDGES_LIMIT]
            self._dirty.add("edges")

    def get(self, section: str) -> Any:
        """Read one section."""
        with self._guard:
            return self._sections[section]

    def snapshot(self) -> dict[str, Any]:
        """Return the whole state as of the last `take`'s number, or later by what is not taken."""
        with self._guard:
            return {"n": self._n, "state": self._state()}

    def _state(self) -> dict[str, Any]:
        return self._sections | {"runs": [*self._runs.values()], "edges": [*self._edges]}

    def take(self) -> dict[str, Any] | None:
        """Return what changed since the last time, with its number; `None` for nothing."""
        with self._guard:
            if self._clean:
                return None
            self._n += 1
            state, dirty = self._state(), self._dirty
            parts = {
                "set": {name: state[name] for name in state if name in dirty},
                "runs": [run for number, run in self._runs.items() if number in dirty],
                "edges": [] if "edges" in dirty else self._edges[self._sent :],
            }
            self._sent = len(self._edges)
            dirty.clear()
            return {"n": self._n} | {name: part for name, part in parts.items() if part}

    @contextmanager
    def _changing(self) -> Iterator[None]:
        """Keep others out; tell of the first change after a `take`, once they are in again."""
        with self._guard:
            clean = self._clean
            yield
            changed = clean and not self._clean
        if changed:
            self.changed()

    @property
    def _clean(self) -> bool:
        return not self._dirty and self._sent >= len(self._edges)
