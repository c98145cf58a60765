"""Where a daemon is found, and that nobody else's is taken for it."""

from __future__ import annotations

import json
import os
import socket
import struct
from pathlib import Path

from rig.daemon.rpc import BusyError
from rig.errors import DeviceError, InputError
from rig.reasons import make_error

_SECRET = 0o077  # what the group and others may not have
_REACH_S = 5.0
_PATIENCE = struct.pack("@2l", round(_REACH_S), 0)
_CREDENTIALS = struct.Struct("3i")  # pid, uid, gid


def default_socket(name: str = "") -> Path:
    """Name the socket of this user's daemon, or of the one of several rigs that has a name."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(runtime) if runtime else Path.home() / ".cache"
    return folder / "chainrig" / (f"rig-{name}.sock" if name else "rig.sock")


def token_file(path: Path) -> Path:
    """Name the file that stands for a socket where TCP is spoken."""
    return path.with_suffix(".tcp")


def prepare_folder(folder: Path) -> None:
    """Make a daemon's folder, for its user alone.

    Raises
    ------
    InputError
        Somebody else's, or open to others: whoever can write there could pose as the daemon.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        check_folder(folder)
    except OSError as error:
        raise make_error(InputError, "place_unusable", path=folder, text=error) from error


def require_sockets() -> None:
    """Refuse to do what needs a daemon where none can be.

    Raises
    ------
    InputError
        Python has no Unix sockets here, as on Windows, so nobody knows who a client is.
    """
    if not hasattr(socket, "AF_UNIX"):
        raise make_error(InputError, "no_unix_sockets")


def check_folder(folder: Path) -> None:
    """Refuse a folder that others may write to.

    Raises
    ------
    InputError
        As for `prepare_folder`.
    """
    require_sockets()
    about = folder.stat()
    if about.st_uid != os.getuid():
        raise make_error(InputError, "folder_foreign", folder=folder)
    if about.st_mode & _SECRET:
        raise make_error(InputError, "folder_open", folder=folder)


def peer_uid(connection: socket.socket) -> int | None:
    """Ask the kernel which user is at the other end; `None` where it cannot be asked."""
    option = getattr(socket, "SO_PEERCRED", None)  # Linux has it
    if option is None or connection.family != socket.AF_UNIX:
        return None
    data = connection.getsockopt(socket.SOL_SOCKET, option, _CREDENTIALS.size)
    uid: int = _CREDENTIALS.unpack(data)[1]
    return uid


def reach(path: Path) -> tuple[socket.socket, str]:
    """Connect to a daemon of this user.

    Parameters
    ----------
    path
        Its Unix socket; beside it the file that stands for TCP.

    Returns
    -------
    socket, str
        The connection, and the token that the daemon wants to hear; empty for none.

    Raises
    ------
    DeviceError
        Nobody answers there, or somebody else.
    BusyError
        Too many want to be let in.
    """
    tcp, token = token_file(path), ""
    line: socket.socket | None = None
    try:
        check_folder(path.parent)
        if not path.exists() and tcp.exists():
            place = json.loads(tcp.read_text("ascii"))
            address = "127.0.0.1", place["port"]
            line, token = socket.create_connection(address, _REACH_S), place["token"]
        else:
            line = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            # More may want to be let in than the kernel keeps waiting.
            line.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, _PATIENCE)
            line.connect(str(path))
    except (OSError, ValueError) as error:
        if line is not None:
            line.close()
        if isinstance(error, BlockingIOError | TimeoutError):
            raise make_error(BusyError, "daemon_busy", path=path, patience_s=_REACH_S) from error
        raise make_error(DeviceError, "no_daemon", path=path, text=error) from error
    if peer_uid(line) not in {None, os.getuid()}:
        line.close()
        raise make_error(DeviceError, "daemon_foreign", path=path)
    return line, token
