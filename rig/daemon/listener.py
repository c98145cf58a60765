"""Where clients come in: a socket, and nobody else's in its place."""

import socket
from contextlib import suppress
from errno import EADDRINUSE
from os import strerror
from pathlib import Path

from filelock import FileLock, Timeout

from rig.daemon.socket_path import prepare_folder
from rig.files import stat_of
from rig.reasons import rig_error

_LOCK_S = 0.1  # one that ends takes its lock's file away, and the next tries again
_BACKLOG = 1024  # that many may come at once; the kernel has a limit of its own besides


class Door:
    """The socket by which clients find a daemon.

    A lock beside it, which the kernel takes away with the process, says whose it is.

    Parameters
    ----------
    path
        The Unix socket.

    Attributes
    ----------
    listener
        A socket that listens, and does not block.

    Raises
    ------
    InputError
        Another daemon is there, or the folder cannot be trusted.
    """

    def __init__(self, path: Path) -> None:
        prepare_folder(path.parent)
        self._lock = FileLock(path.with_suffix(".lock"), _LOCK_S, thread_local=False)
        self.path = path
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._lock.acquire()
            if path.exists() and not path.is_socket():  # the user's; a killed daemon leaves sockets
                raise FileExistsError(EADDRINUSE, strerror(EADDRINUSE))
            # Whoever sees the socket finds it open.
            begun = path.with_suffix(".new")
            begun.unlink(missing_ok=True)
            self.listener.bind(str(begun))
            begun.chmod(0o600)
            self.listener.listen(_BACKLOG)
            begun.replace(path)
        except OSError as error:
            self.listener.close()
            code = "daemon_there" if isinstance(error, Timeout) else "place_unusable"
            raise rig_error(code, path=path, text=error) from error
        self.listener.setblocking(False)
        self._ours = _identity(self.path)
        self._lost = False

    def there(self) -> bool:
        """Whether clients still find this daemon by it; a file that was lost never comes back.

        What stands there later is another daemon's, though the file system may give it the number
        that this one's had.
        """
        self._lost = self._lost or _identity(self.path) != self._ours
        return not self._lost

    def close(self) -> None:
        """Let nobody in any more; take the file away unless another daemon's is in its place."""
        self.listener.close()
        with suppress(OSError):
            if self.there():
                self.path.unlink()
                Path(self._lock.lock_file).unlink()  # locked: nobody locks a name that is gone
        self._lock.release()


def _identity(path: Path) -> tuple[int, int, int] | None:
    """Return what another file at a path has otherwise; its number alone may be the same."""
    about = stat_of(path)
    return about and (about.st_dev, about.st_ino, about.st_mode)
