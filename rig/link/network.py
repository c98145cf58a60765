"""Ports at another computer, through pyserial's ``socket://`` and ``rfc2217://``."""

from __future__ import annotations

import array
import errno
import os
import socket
from typing import Any

NETWORK = ("socket", "rfc2217")
"""URL schemes of ports at another computer."""
REACH = (
    "is the program that passes the port on running there, and does a firewall let it? "
    "As a URL: socket://HOST:PORT"
)


class NetworkPort:
    """A ``socket://`` port that says how much has really arrived.

    Pyserial's own says 1 when anything has: everything would be read byte by byte, each a record
    of its own in the session.

    Parameters
    ----------
    port
        Pyserial's.
    """

    def __init__(self, port: Any) -> None:
        self._port = port
        self._socket = port._socket
        self.read = port.read
        self.write = port.write

    def close(self) -> None:
        """Hang up."""
        self._port.close()
        self._socket.close()  # pyserial forgets to, where the other end has hung up already

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read at once."""
        if not self._port.in_waiting:  # also says when the port is closed
            return 0
        import fcntl  # noqa: PLC0415 - not on Windows
        import termios  # noqa: PLC0415

        count = array.array("i", [0])
        fcntl.ioctl(self._port.fileno(), termios.FIONREAD, count)
        return count[0]


def why_unreachable(error: OSError) -> str:
    """Say in words why a connection could not be made.

    Parameters
    ----------
    error
        Pyserial's, which has the cause in its text and its context only.
    """
    cause = error.__context__
    match cause:
        case socket.gaierror():
            return "there is no computer of that name"
        case TimeoutError():
            return "nobody answers"
        case OSError(errno=errno.ECONNREFUSED):
            return "nothing listens there"
        case OSError(errno=int(number)) if number:
            return os.strerror(number)
    return str(error)
