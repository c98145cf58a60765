"""Who is let in, and how many: a crowd that says nothing keeps nobody out, STOP least of all."""

from __future__ import annotations

from enum import Enum
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
Standing = Enum("Standing", ["STRANGER", "CLIENT", "RESERVE"])


class Admission:
    """Knows how each connection stands from its first moment to its last."""

    def __init__(self) -> None:
        self._standings: dict[Connection, Standing] = {}  # in the order in which they came

    def __iter__(self) -> Iterator[Connection]:
        """Give every connection there is."""
        return iter([*self._standings])

    def register(self, connection: Connection) -> None:
        """Count a connection of which nothing is known yet."""
        if self._count(Standing.STRANGER) >= STRANGERS:
            self.make_room()
        self._standings[connection] = Standing.STRANGER

    def make_room(self) -> bool:
        """Send the oldest away that has said nothing; `False` when there is none."""
        for connection, standing in self._standings.items():
            # Who said hello and waits for the answer has done what there is to do.
            if standing is Standing.STRANGER and not connection.spoke:
                self.forget(connection)
                connection.turn_away(make_error(BusyError, "connections_silent"))
                return True
        return False

    def late(self, connection: Connection) -> bool:
        """Whether a connection that came `HELLO_S` ago has had its time."""
        return self._standings.get(connection, Standing.CLIENT) is not Standing.CLIENT

    def welcome(self, connection: Connection) -> None:
        """Let a client in that has said hello.

        Raises
        ------
        BusyError
            There is not even room in the reserve.
        """
        for standing, room in ((Standing.CLIENT, CLIENTS), (Standing.RESERVE, RESERVE)):
            if self._count(standing) < room:
                self._standings[connection] = standing
                return
        raise make_error(BusyError, "clients_full", clients=CLIENTS)

    def check(self, connection: Connection, method: str) -> None:
        """Let a client in the reserve do nothing but stop.

        Raises
        ------
        BusyError
            It wants something else.
        """
        if self._standings.get(connection) is Standing.RESERVE and method != "stop":
            raise make_error(BusyError, "clients_only_stop", clients=CLIENTS)

    def forget(self, connection: Connection) -> None:
        """Forget a connection."""
        self._standings.pop(connection, None)

    def _count(self, standing: Standing) -> int:
        return sum(each is standing for each in self._standings.values())
