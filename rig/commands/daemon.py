"""``rig daemon``."""

import asyncio
import logging
import os
import queue
import threading
from contextlib import closing, nullcontext, suppress

from rig.board.process import BoardProcess
from rig.commands.output import Arguments, say
from rig.daemon.server import Server
from rig.daemon.socket_path import default_socket, require_sockets
from rig.link.port import check_url
from rig.printable import printable

_WAITING = 1000  # lines that a terminal which does not take them may be behind
_LAST_S = 1.0  # for the last lines, when it still does not


class StderrHandler(logging.Handler):
    """Writes in a thread of its own.

    A terminal may stop taking lines at any time, and clients must not wait for it.
    """

    def __init__(self) -> None:
        super().__init__()
        self._lines: queue.Queue[str | None] = queue.Queue(_WAITING)
        self._writer = threading.Thread(target=self._write, name="log", daemon=True)
        self._writer.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Write a line when it can be written; when too many wait, never."""
        with suppress(queue.Full):
            self._lines.put_nowait(printable(self.format(record)))

    def close(self) -> None:
        """Let the last lines go out."""
        with suppress(queue.Full):
            self._lines.put_nowait(None)
            self._writer.join(_LAST_S)
        super().close()

    def _write(self) -> None:
        while (line := self._lines.get()) is not None:
            with suppress(OSError):
                os.write(2, f"{line}\n".encode())  # past Python's buffer and its lock


def main(arguments: Arguments) -> None:
    """Own a port and serve clients, in the foreground, until a signal or the idle time ends it."""
    require_sockets()
    check_url(arguments.port)
    path = (arguments.socket or default_socket()).absolute()

    def ready() -> None:
        say(f"rig daemon: {arguments.port} at {path}")
        if board:
            say(f"rig daemon: page to look on, {board.words}")

    logging.basicConfig(handlers=[StderrHandler()], level="INFO", format="%(message)s")
    page = closing(BoardProcess(*arguments.board)) if arguments.board else nullcontext()
    with page as board:
        onlookers = [board.follow] if board else []
        server = Server(arguments.port, path, idle_s=arguments.idle_timeout, onlookers=onlookers)
        asyncio.run(server.run(ready))
    logging.shutdown()  # the last lines go out
    say("rig daemon: ended")
