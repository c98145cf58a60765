"""``python -m rig.board ADDRESS DESCRIPTOR``, as a daemon starts it: the page's own process."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import sys
import time
from typing import Any

from rig.board.page import SCRIPT_DIGEST, BoardPage
from rig.board.server import PageServer

_NICE = 5
_LOOK_S, _LATEST_S = 1.0, 10.0  # from one look to the next
_RESTS = 25.0  # times as long as it worked, or it would cost more than 4 % of a core


async def serve(address: str, listener: socket.socket) -> None:
    """Serve the page until the daemon has ended, which its line tells."""
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    page, server, news = BoardPage(address), PageServer(SCRIPT_DIGEST), dict[str, Any]()

    async def hear() -> None:
        async for line in reader:
            news.update(json.loads(line))

    server.show(page.look({}) or "")
    tasks = [loop.create_task(hear()), loop.create_task(server.serve(listener))]
    done: set[asyncio.Task[None]] = set()
    while not done:
        begun = time.process_time()
        text = await asyncio.to_thread(page.look, dict(news))
        if text is not None:
            server.show(text)
        rest_s = _RESTS * (time.process_time() - begun)
        rest_s = min(max(_LOOK_S, rest_s), _LATEST_S)
        done, _ = await asyncio.wait(tasks, timeout=rest_s, return_when=asyncio.FIRST_COMPLETED)
    for task in done:
        task.result()


def main() -> None:
    """Serve with what the daemon gave: the page's address, and a socket that listens."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C is for the daemon
    os.nice(_NICE)
    _, address, descriptor = sys.argv
    asyncio.run(serve(address, socket.socket(fileno=int(descriptor))))


if __name__ == "__main__":
    main()
