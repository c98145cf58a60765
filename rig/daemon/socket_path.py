"""Where a daemon is found, and that nobody else's is taken for it."""

import os
import socket
import struct
from pathlib import Path

from rig.reasons import errors_become, rig_error

_SECRET = 0o077  # what the group and others may not have
_CREDENTIALS = struct.Struct("3i")  # pid, uid, gid


def default_socket(name: str = "") -> Path:
    """Name the socket of this user's daemon, or of the one of several rigs that has a name."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(runtime) if runtime else Path.home() / ".cache"
    return folder / "chainrig" / (f"rig-{name}.sock" if name else "rig.sock")


def prepare_folder(folder: Path) -> None:
    """Make a daemon's folder, for its user alone.

    Raises
    ------
    InputError
        Somebody else's, or open to others: whoever can write there could pose as the daemon.
    """
    with errors_become("place_unusable", OSError, path=folder):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        check_folder(folder)


def require_sockets() -> None:
    """Refuse to do what needs a daemon where none can be.

    Raises
    ------
    InputError
        Python has no Unix sockets here, as on Windows, so nobody knows who a client is.
    """
    if not hasattr(socket, "AF_UNIX"):
        raise rig_error("no_unix_sockets")


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
        raise rig_error("folder_foreign", folder=folder)
    if about.st_mode & _SECRET:
        raise rig_error("folder_open", folder=folder)


def peer_uid(connection: socket.socket) -> int | None:
    """Ask the kernel which user is at the other end; `None` where it cannot be asked."""
    option = getattr(socket, "SO_PEERCRED", None)  # Linux has it
    if option is None or connection.family != socket.AF_UNIX:
        return None
    data = connection.getsockopt(socket.SOL_SOCKET, option, _CREDENTIALS.size)
    return int(_CREDENTIALS.unpack(data)[1])
