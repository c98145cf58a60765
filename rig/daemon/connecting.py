"""The rig as its clients see it: through the daemon that owns the port, or without one."""

import logging
import os
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from rig.daemon.client import Client, Line
from rig.daemon.lease import Lease
from rig.daemon.service import METHODS
from rig.daemon.socket_path import default_socket
from rig.daemon.worker import Worker
from rig.errors import RigError
from rig.reasons import rig_error
from rig.recorder.interrupts import Interrupts
from rig.recorder.published import PublishedState


class OwnLine(Line):
    """The line to a worker of this process, which owns the port until the line is closed.

    Parameters
    ----------
    url
        The port.
    """

    def __init__(self, url: str) -> None:
        # What the worker would tell onlookers, whoever asked is told as an error.
        logging.getLogger("rig.daemon.worker").addHandler(logging.NullHandler())
        lease = Lease(lambda: 0.0)  # never lapses
        lease.take(self, "rig run")
        self._worker = Worker(url, PublishedState(), lease)

    def ask(self, method: str, **params: Any) -> Future[Any]:
        """Have something done, see API.md."""
        if method == "stop":
            return self._worker.stop(**params)
        row = METHODS[method]
        answer = self._worker.submit(row.bind(params), self, writes=row.writes)
        self._worker.start()
        return answer

    def close(self) -> None:
        """Make safe and close session and port; a drop that fell is recorded to its end."""
        self._worker.end()
        self._worker.start()
        self._worker.join()


def connect(
    url: str, say: Callable[[str], None], interrupts: Interrupts, socket: Path | None = None
) -> Client:
    """Find the owner of a port, or become it.

    Parameters
    ----------
    url
        The port.
    say
        Is told when a daemon does the work.
    interrupts
        As for `Client`.
    socket
        Of the daemon to ask, which must then be there; else the usual one, if there is one.

    Returns
    -------
    Client
        To be closed.

    Raises
    ------
    RigError
        The daemon that was named is not there or has another port; another client is in control.
    """
    try:
        line = Line(socket or default_socket(), f"rig run {os.getpid()}")
        # A board has several names in /dev, and plugged in again another than the daemon was told.
        names = {Path(line.daemon.get(name, "")).resolve() for name in ("port", "path")}
        if Path(url).resolve() not in names:
            line.close()
            raise rig_error("daemon_port", port=line.daemon["port"], wanted=url)
    except RigError:
        if socket is not None:
            raise
        # None, another port's daemon, what a killed one left, or one of another version.
        return Client(OwnLine(url), interrupts)
    client = Client(line, interrupts)
    try:
        client.take_control()
    except RigError:
        client.close()
        raise
    say(f"through the daemon, process {line.daemon['pid']}, which owns {url}")
    return client
