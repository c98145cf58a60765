"""The published state on its way to the clients that subscribed to it."""

import asyncio
from collections.abc import Iterable
from functools import partial
from typing import Any

from rig.daemon import rpc
from rig.daemon.connection import Connection
from rig.recorder.published import PublishedState

_CHANGES_S = 0.004
"""From one message to the next: in a flood a face takes many together; at 5000 edges/s, a frame in
8 ms, each goes out at once."""
_FULL = 1 << 16
"""Bytes on their way to one client; beyond, it gets a snapshot when it has read them."""


class Publisher:
    """Sends changes to whoever keeps up, snapshots to whoever does so again.

    Parameters
    ----------
    published
        The state.
    connections
        All that there are, at any time.
    """

    def __init__(self, published: PublishedState, connections: Iterable[Connection]) -> None:
        self.published = published
        self._connections = connections
        self._dirty = asyncio.Event()

    def count(self) -> None:
        """Show how many clients there are, and note whether anybody looks."""
        clients = [connection for connection in self._connections if connection.is_client]
        self.published.watched = any(client.subscribed for client in clients)
        self.published.set(clients=len(clients))

    def subscribe(self, connection: Connection) -> dict[str, Any]:
        """Give a client the snapshot upon which its changes will follow."""
        self.spread()  # what the others are told first is in the snapshot
        connection.subscribed = True
        self.count()
        return self.published.snapshot()

    def unsubscribe(self, connection: Connection) -> None:
        """Send a client no more changes."""
        connection.subscribed = connection.behind = False
        self.count()

    def spread(self) -> None:
        """Send what changed."""
        change = self.published.take()
        line = None if change is None else rpc.request("change", change, None)
        snapshot = None
        for connection in self._connections:
            if not connection.subscribed:
                continue
            if connection.waiting() > _FULL:
                connection.behind = True
            elif connection.behind:
                snapshot = snapshot or rpc.request("snapshot", self.published.snapshot(), None)
                connection.behind = False
                connection.send(snapshot)
            elif line is not None:
                connection.send(line)

    async def run(self) -> None:
        """Send what changes, until cancelled."""
        loop = asyncio.get_running_loop()
        self.published.changed = partial(loop.call_soon_threadsafe, self._dirty.set)
        self._dirty.set()
        while True:
            if not any(connection.behind for connection in self._connections):
                await self._dirty.wait()
            self._dirty.clear()
            self.spread()
            await asyncio.sleep(_CHANGES_S)
