"""A virtual board at the far end of a TCP connection, as a serial-to-network program gives it."""

from __future__ import annotations

import select
import socket
import threading
import time

from sim.board import VirtualBoard

_LOOK_S = 0.002


class TcpBridge:
    """Runs a board in real time behind `url`, for one client after the other, while entered."""

    def __init__(self, board: VirtualBoard) -> None:
        self._board = board
        board.reset(0)
        self._server = socket.create_server(("127.0.0.1", 0))
        self.url = f"socket://127.0.0.1:{self._server.getsockname()[1]}"
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> TcpBridge:
        self._thread.start()
        return self

    def __exit__(self, *_exc: object) -> None:
        self.end()
        self._server.close()

    def end(self) -> None:
        """Hang up."""
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        begun = time.monotonic_ns()
        client = None
        while not self._over.is_set():
            readable, _, _ = select.select([client or self._server], [], [], _LOOK_S)
            now = time.monotonic_ns() - begun
            if readable and client is None:
                client, _ = self._server.accept()
            elif readable:
                data = client.recv(4096)
                if data:
                    self._board.receive(now, data)
                else:
                    client.close()
                    client = None
            self._board.advance(now)
            arrived = self._board.line.read(now)
            if client is not None and arrived:
                client.sendall(arrived)
        if client is not None:
            client.close()
