"""``python -m rig.board ADDRESS DESCRIPTOR``, as a daemon starts it: the page's own process."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import sys
import time
from contextlib import suppress
from typing import Any

from rig.board.page import SCRIPT_DIGEST, BoardPage
from rig.board.server import PageServer

_NICE = 5
_LOOK_S, _LATEST_S = 1.0, 10.0  # from one look to the next
_RESTS = 25.0  # times as long as it worked, or it would cost more than 4 % of a core


async def serve(address: str, listener: socket.socket) -> None:
    """Serve the page until the daemon has ended, which its line tells."""
    page, server, news = BoardPage(address), PageServer(SCRIPT_DIGEST), dict[str, Any]()
    over, loop = asyncio.Event(), asyncio.get_running_loop()

    def hear() -> None:
        lines = os.read(0, 1 << 16).splitlines()
        for line in map(json.loads, lines):
            # A session that was closed stays on the page, however short it was.
            news.update(line, session=line["session"] or news.get("session"))
        if not lines:
            over.set()

    loop.add_reader(0, hear)
    async with await server.start(listener):
        while not over.is_set():
            begun = time.process_time()
            server.show(await asyncio.to_thread(page.look, dict(news)))
            rest_s = _RESTS * (time.process_time() - begun)
            with suppress(TimeoutError):
                await asyncio.wait_for(over.wait(), min(max(_LOOK_S, rest_s), _LATEST_S))


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C is for the daemon
    os.nice(_NICE)
    asyncio.run(serve(sys.argv[1], socket.socket(fileno=int(sys.argv[2]))))
