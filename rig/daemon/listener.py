"""Where clients come in: a socket, or a port and a token, and nobody else's in its place."""

from __future__ import annotations

import json
import os
import socket
from contextlib import suppress
from pathlib import Path

from rig.daemon import rpc
from rig.daemon.rpc import BusyError
from rig.daemon.socket_path import prepare_folder, reach, token_file
from rig.errors import DeviceError, InputError
from rig.files import identity_of, write_atomic
from rig.reasons import make_error

_PROBE_S = 1.0
_BACKLOG = 1024  # that many may come at once; the kernel has a limit of its own besides


def listen(path: Path, token: str) -> socket.socket:
    """Let clients come.

    Parameters
    ----------
    path
        The Unix socket; the file that stands for TCP is beside it.
    token
        What a client over TCP must know; empty for the socket.

    Returns
    -------
    socket
        Which listens, and does not block.

    Raises
    ------
    InputError
        Another daemon is there, or the folder cannot be trusted.
    """
    prepare_folder(path.parent)
    if _answers(path):
        raise make_error(InputError, "daemon_there", path=path)
    for left_by_a_killed_one in (path, token_file(path)):
        left_by_a_killed_one.unlink(missing_ok=True)
    if token:
        listener = socket.create_server(("127.0.0.1", 0), backlog=_BACKLOG)
        file, port = token_file(path), listener.getsockname()[1]
        file.touch(mode=0o600)
        write_atomic(file, json.dumps({"port": port, "token": token}))
        file.chmod(0o600)
    else:
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        listener.bind(str(path))
        path.chmod(0o600)
        listener.listen(_BACKLOG)
    listener.setblocking(False)
    return listener


class Door:
    """The file by which clients find a daemon: its socket, or what stands for its TCP port."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._ours = identity_of(path)
        self._lost = False

    def there(self) -> bool:
        """Whether clients still find this daemon by it; a file that was lost never comes back.

        What stands there later is another daemon's, though the file system may give it the number
        that this one's had.
        """
        self._lost = self._lost or identity_of(self.path) != self._ours
        return not self._lost

    def remove(self) -> None:
        """Take it away, unless another daemon's is in its place."""
        with suppress(OSError):
            if self.there():
                self.path.unlink()


def _answers(path: Path) -> bool:
    """Whether a daemon answers: any program may have the port of one that was killed."""
    try:
        line, token = reach(path)
    except BusyError:
        return True  # so many wait that it does not come to us
    except DeviceError as error:
        if isinstance(error.__cause__, FileNotFoundError | ConnectionRefusedError | ValueError):
            return False
        raise make_error(InputError, "place_unusable", path=path, text=error.__cause__) from error
    with line:
        line.settimeout(_PROBE_S)
        hello = {"api": rpc.API, "client": "a daemon that starts", "token": token}
        try:
            line.sendall(rpc.request("hello", hello, 1))
            return not token or b'"jsonrpc"' in line.recv(1 << 12)
        except OSError:
            return not token


def notify_systemd() -> None:
    """Tell systemd that clients can come, where it asked to be told (sd_notify(3))."""
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address:
        return
    with (
        suppress(OSError),
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as out,
    ):
        out.connect("\0" + address[1:] if address.startswith("@") else address)
        out.send(b"READY=1")
