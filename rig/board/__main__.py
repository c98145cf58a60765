"""``python -m rig.board ADDRESS DESCRIPTOR``, as a daemon starts it: the page's own process."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import sys
from contextlib import suppress

from rig.board.page import SCRIPT_DIGEST, BoardPage
from rig.board.server import PageServer

_NICE = 5
_LOOK_S = 1.0


async def serve(address: str, listener: socket.socket) -> None:
    """Serve the page until the daemon has ended, which its line tells."""
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader(limit=1 << 16)
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    page, server = BoardPage(address), PageServer(SCRIPT_DIGEST)
    server.show(page.look({}) or "")
    serving = loop.create_task(server.serve(listener))
    news: dict[str, object] = {}
    while not serving.done():
        with suppress(TimeoutError):
            async with asyncio.timeout(_LOOK_S):
                line = await reader.readline()
                if not line:
                    return
                news = json.loads(line)
        text = await asyncio.to_thread(page.look, news)
        if text is not None:
            server.show(text)
    serving.result()


def main() -> None:
    """Serve with what the daemon gave: the page's address, and a socket that listens."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C is for the daemon
    os.nice(_NICE)
    _, address, descriptor = sys.argv
    asyncio.run(serve(address, socket.socket(fileno=int(descriptor))))


if __name__ == "__main__":
    main()
