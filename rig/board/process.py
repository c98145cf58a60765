"""The page's process, as the daemon's sees it: where it is seen, and which session it is told of.

It has a lower priority and only one line to the daemon, on which nothing comes back. Whatever
browsers do, neither the port nor STOP notices; when the daemon ends, so does the page.
"""

import asyncio
import json
import logging
import os
import socket
import subprocess
import sys
from contextlib import suppress
from urllib.parse import urlsplit

from rig.reasons import errors_become
from rig.recorder.published import PublishedState

log = logging.getLogger(__name__)
_TELL_S = 0.25
_SOMEWHERE = ("192.0.2.1", 9)  # TEST-NET-1 (RFC 5737); nothing is sent there


class BoardProcess:
    """The page of one daemon.

    Parameters
    ----------
    host, port
        Where it is seen; port 0 for any that is free.

    Attributes
    ----------
    address
        The page's address, for a browser.

    Raises
    ------
    InputError
        There is no such host here, or another program has the port.
    """

    def __init__(self, host: str, port: int) -> None:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        with errors_become("page_unserved", OSError, host=host, port=port):
            listener = socket.create_server((host, port), family=family)
        with listener:
            self.address = _address(host, listener.getsockname()[1])
            descriptor = listener.fileno()
            self._process = subprocess.Popen(
                [sys.executable, "-m", "rig.board", self.address, str(descriptor)],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                pass_fds=[descriptor],
            )
        assert self._process.stdin is not None
        self._line = self._process.stdin.fileno()
        os.set_blocking(self._line, False)

    async def follow(self, published: PublishedState) -> None:
        """Tell the page which session is open and what its drop does, as long as both are there."""
        before = path = None
        while self._process.poll() is None:
            # A session that was closed stays on the page.
            path = session["path"] if (session := published.get("session")) else path
            news = {"session": path, "drop": published.get("drop")}
            if news != before:
                # It may be behind: then it is told later.
                with suppress(BlockingIOError, BrokenPipeError):
                    os.write(self._line, json.dumps(news).encode() + b"\n")
                    before = news
            await asyncio.sleep(_TELL_S)
        log.error("the page at %s has ended; start the daemon again to have it back", self.address)
        await asyncio.Event().wait()  # the rig goes on without it

    @property
    def words(self) -> str:
        """Where the page is, and for whom."""
        who = "on this computer only" if is_local(self.address) else "for everyone who reaches it"
        return f"{who}: {self.address}"

    def close(self) -> None:
        """End the page."""
        self._process.kill()
        self._process.communicate()


def is_local(address: str) -> bool:
    """Whether a page's address is of this computer alone."""
    return urlsplit(address).hostname in {"localhost", "127.0.0.1", "::1"}


def _address(host: str, port: int) -> str:
    """Return the page's address as a browser elsewhere needs it."""
    if host in {"0.0.0.0", "::"}:  # noqa: S104 - only where the user said so
        host = socket.gethostname()
        with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(_SOMEWHERE)
            host = probe.getsockname()[0]
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"
