"""``python -m rig.board ADDRESS DESCRIPTOR``, as a daemon starts it: the page's own process."""

import json
import os
import signal
import socket
import sys
import threading
import time
from select import select
from typing import Any

from rig.board.page import BoardPage
from rig.board.server import PageServer

_NICE = 5
_LOOK_S, _LATEST_S = 1.0, 10.0  # from one look to the next
_RESTS = 25.0  # times as long as it worked, or it would cost more than 4 % of a core


def serve(address: str, listener: socket.socket) -> None:
    """Serve the page until the daemon has ended, which its line tells."""
    page, news = BoardPage(address), dict[str, Any]()
    server = PageServer(listener, page.digest)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    due_s = 0.0
    while True:
        if select([0], [], [], max(due_s - time.monotonic(), 0.0))[0]:
            lines = os.read(0, 1 << 16).splitlines()
            if not lines:
                return
            news = json.loads(lines[-1])
            continue
        begun_s = time.process_time()
        if text := page.look(news):
            server.show(text)
        rest_s = _RESTS * (time.process_time() - begun_s)
        due_s = time.monotonic() + min(max(_LOOK_S, rest_s), _LATEST_S)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C is for the daemon
    os.nice(_NICE)
    serve(sys.argv[1], socket.socket(fileno=int(sys.argv[2])))
