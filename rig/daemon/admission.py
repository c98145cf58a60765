"""Who is let in, and how many: a crowd that says nothing keeps nobody out, STOP least of all."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.daemon.rpc import BusyError
from rig.reasons import make_error

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.daemon.connection import Connection

HELLO_S = 2.0
"""A client that has not said hello for so long is sent away."""
STRANGERS = 64
"""Connections that have not been let in; the oldest that says nothing makes room for the next."""
CLIENTS = 128
RESERVE = 8
"""Connections beyond those, for `stop` alone, and no longer than `HELLO_S`."""


class Admission:
    """Counts connections from their first moment to their last."""

    def __init__(self) -> None:
        self._strangers: dict[Connection, None] = {}  # in the order in which they came
        self._clients: set[Connection] = set()
        self._reserve: set[Connection] = set()

    def __iter__(self) -> Iterator[Connection]:
        """Give every connection there is."""
        return iter([*self._strangers, *self._clients, *self._reserve])

    def arrived(self, connection: Connection) -> None:
        """Count a connection of which nothing is known yet."""
        if len(self._strangers) >= STRANGERS:
            self.make_room()
        self._strangers[connection] = None

    def make_room(self) -> bool:
        """Send the oldest away that has said nothing; `False` when there is none."""
        # Who said hello and waits for the answer has done what there is to do.
        oldest = next((one for one in self._strangers if not one.spoke), None)
        if oldest is not None:
            del self._strangers[oldest]
            oldest.turn_away(make_error(BusyError, "connections_silent"))
        return oldest is not None

    def late(self, connection: Connection) -> bool:
        """Whether a connection that came `HELLO_S` ago has had its time."""
        return connection in self._strangers or connection in self._reserve

    def welcome(self, connection: Connection) -> None:
        """Let a client in that has said hello.

        Raises
        ------
        BusyError
            There is not even room in the reserve.
        """
        if len(self._clients) < CLIENTS:
            room = self._clients
        elif len(self._reserve) < RESERVE:
            room = self._reserve
        else:
            raise make_error(BusyError, "clients_full", clients=CLIENTS)
        self._strangers.pop(connection, None)
        room.add(connection)

    def check(self, connection: Connection, method: str) -> None:
        """Let a client in the reserve do nothing but stop.

        Raises
        ------
        BusyError
            It wants something else.
        """
        if connection in self._reserve and method != "stop":
            raise make_error(BusyError, "clients_only_stop", clients=CLIENTS)

    def left(self, connection: Connection) -> None:
        """Forget a connection."""
        self._strangers.pop(connection, None)
        self._clients.discard(connection)
        self._reserve.discard(connection)
