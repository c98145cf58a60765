"""A port in another room: what ser2net and its like do, with pyserial's own RFC 2217 server."""

import contextlib
import select
import socket
import threading
from types import SimpleNamespace

import serial
from serial.rfc2217 import PortManager

_LOOK_S = 0.01


class Terminal(serial.Serial):
    """A pseudo-terminal, which has no modem lines to ask for."""

    cts = dsr = ri = cd = False

    def _update_dtr_state(self):
        pass

    def _update_rts_state(self):
        pass


class FarPort:
    """Passes a serial port on over TCP while entered, to one client after the other.

    Parameters
    ----------
    path
        Of the port.
    scheme
        ``rfc2217``, or ``socket`` for the bare bytes.
    """

    def __init__(self, path, scheme):
        self._path, self._scheme = str(path), scheme
        self._server = socket.create_server(("127.0.0.1", 0))
        self.url = f"{scheme}://127.0.0.1:{self._server.getsockname()[1]}"
        self.baudrates = []
        self._over = threading.Event()
        self._hung_up = threading.Event()
        self._silent = threading.Event()
        self._half_open = []
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_exc):
        self._over.set()
        self._thread.join()
        self._server.close()
        for one in self._half_open:
            one.close()

    def hang_up(self):
        """Lose the client that is connected now."""
        self._hung_up.set()

    def fall_silent(self):
        """Lose it without a word, as a cable does that is pulled between two switches."""
        self._silent.set()
        self._hung_up.set()

    def _run(self):
        while not self._over.is_set():
            if select.select([self._server], [], [], _LOOK_S)[0]:
                client, _ = self._server.accept()
                self._hung_up.clear()
                with client, Terminal(self._path, timeout=0) as port:
                    with contextlib.suppress(ConnectionError):
                        self._serve(client, port)
                    self.baudrates.append(port.baudrate)
                    if self._silent.is_set():
                        self._half_open.append(client.dup())
                        self._silent.clear()

    def _serve(self, client, port):
        to_board = to_host = bytes
        if self._scheme == "rfc2217":
            manager = PortManager(port, SimpleNamespace(write=client.sendall))
            to_board = lambda data: b"".join(manager.filter(data))  # noqa: E731
            to_host = lambda data: b"".join(manager.escape(data))  # noqa: E731
        while not self._over.is_set() and not self._hung_up.is_set():
            readable, _, _ = select.select([client, port], [], [], _LOOK_S)
            if client in readable:
                data = client.recv(4096)
                if not data:
                    return
                port.write(to_board(data))
            if port in readable:
                client.sendall(to_host(port.read(4096)))
