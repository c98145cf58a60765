"""The page's process, as the daemon's sees it: where it is seen, and which session it is told of.

It has a lower priority and only one line to the daemon, on which nothing comes back. Whatever
browsers do, neither the port nor STOP notices; when the daemon ends, so does the page.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import re
import socket
import subprocess
import sys
from contextlib import suppress
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from rig.errors import InputError

if TYPE_CHECKING:
    from rig.recorder.published import PublishedState

log = logging.getLogger(__name__)
_BACKLOG = 256
_LAST_PORT = 65535
_TELL_S = 0.25
_ACCEPTED = ":8080 for this computer alone, HOST:8080 or 0.0.0.0:8080 for others too"
_SOMEWHERE = ("192.0.2.1", 9)  # TEST-NET-1 (RFC 5737); nothing is sent there
_LOCAL = "localhost"


class BoardProcess:
    """The page of one daemon.

    Parameters
    ----------
    place
        ``:PORT``, ``HOST:PORT`` or ``[IPv6]:PORT``.

    Attributes
    ----------
    address
        The page's address, for a browser.

    Raises
    ------
    InputError
        It is no such place, or it cannot be had.
    """

    def __init__(self, place: str) -> None:
        parts = re.fullmatch(r"(?:\[([\w:.%]+)\]|([\w.-]*)):(\d{1,5})", place, re.ASCII)
        if parts is None or int(parts[3]) > _LAST_PORT:
            raise InputError(f"--board: found '{place}'", f"accepted: {_ACCEPTED}")
        host = parts[1] or parts[2] or _LOCAL
        try:
            family, *_, name = socket.getaddrinfo(
                host, int(parts[3]), type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
            )[0]
            with socket.create_server(name[:2], family=family, backlog=_BACKLOG) as listener:
                port = listener.getsockname()[1]
                self.address = _address(host, str(name[0]), port)
                command = [sys.executable, "-m", "rig.board", self.address]
                self._process = subprocess.Popen(
                    [*command, str(listener.fileno())],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    pass_fds=[listener.fileno()],
                )
        except OSError as error:
            why = error.strerror or error
            raise InputError(f"--board {place}: {why}", f"accepted: {_ACCEPTED}") from error
        assert self._process.stdin is not None
        self._line = self._process.stdin.fileno()
        os.set_blocking(self._line, False)

    async def follow(self, published: PublishedState) -> None:
        """Tell the page which session is open and what its drop does, as long as both are there."""
        before = None
        while self._process.poll() is None:
            session, drop = published.get("session"), published.get("drop")
            news = {"session": session and session["path"], "drop": drop}
            if news != before:
                # It may be behind: then it is told later.
                with suppress(BlockingIOError, BrokenPipeError):
                    os.write(self._line, json.dumps(news).encode() + b"\n")
                    before = news
            await asyncio.sleep(_TELL_S)
        log.error("the page at %s has ended; start the daemon again to have it back", self.address)
        await asyncio.Event().wait()  # the rig goes on without it

    @property
    def local(self) -> bool:
        """Whether no other computer sees the page."""
        return is_local(self.address)

    def close(self) -> None:
        """End the page."""
        self._process.kill()
        self._process.communicate()


def is_local(address: str) -> bool:
    """Whether a page's address is of this computer alone."""
    return urlsplit(address).hostname in {_LOCAL, "127.0.0.1", "::1"}


def _address(host: str, numbers: str, port: int) -> str:
    """Return the page's address as a browser elsewhere needs it."""
    if numbers in {"0.0.0.0", "::"}:  # noqa: S104 - only where the user said so
        host = _LOCAL
        with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(_SOMEWHERE)
            host = probe.getsockname()[0]
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"
