"""Writer lock of a session: an advisory lock that ends with its process."""

import errno
import os
import time
from contextlib import suppress
from pathlib import Path

from rig.errors import SessionError
from rig.files import beside
from rig.reasons import rig_error

_POLL_S = 0.0025
_LOOK_S = 0.01  # a check for a writer holds the lock for microseconds
_CODES = dict.fromkeys((errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS), "disk_knows_no_locks")
# The lock is the first file of a new session: without its folder both are missing.
_CODES[errno.ENOENT] = "session_unmade"


class WriterLock:
    """An exclusive lock on ``FILE.lock`` beside the session.

    The kernel drops the lock when its process ends, so a killed writer blocks no other process. The
    lock has a file of its own because closing any second handle on the database
    would silently drop the POSIX locks SQLite holds on it in this process.

    Raises
    ------
    SessionError
        Another process (or another `Session` here) holds it, or the folder cannot be written.
    """

    def __init__(self, session: Path) -> None:
        from filelock import FileLock, Timeout, has_fcntl  # noqa: PLC0415 - not for who only reads

        self.path = beside(session, ".lock")
        self._lock = FileLock(
            self.path, _LOOK_S, thread_local=False, poll_interval=_POLL_S, fallback_to_soft=False
        )
        try:
            with suppress(FileNotFoundError):
                # A hard link has its own lock and log: two writers would destroy the file.
                if session.stat().st_nlink > 1:
                    raise rig_error("session_two_names", path=session)
            session.parent.stat()  # filelock would create it
            self._lock.acquire()
            if has_fcntl:  # on other systems a locked file cannot be written
                self.path.write_text(f"{os.getpid()}\n", "ascii")
        except Timeout:
            raise rig_error("session_in_use", path=session, holder=_holder(self.path)) from None
        except SessionError:
            raise
        except OSError as error:
            self._lock.release()
            code = _CODES.get(error.errno or 0, "cannot_lock")
            raise rig_error(code, path=session, text=error) from error

    def release(self) -> None:
        """Release the lock and remove its file; further calls do nothing."""
        if self._lock.is_locked:
            # If the folder has become read-only, a stale *file* does no harm. Remove the file while
            # it is locked, so that no other process locks a removed name.
            with suppress(OSError):
                self.path.unlink(missing_ok=True)
            self._lock.release()


def _holder(lock: Path) -> str:
    owner = ""
    with suppress(OSError):
        owner = lock.read_text("ascii", "replace").partition("\n")[0]
    return f"process {owner}" if owner else "another process"


def writer_of(session: Path) -> str:
    """Return the name of the process that writes a session; empty without a writer."""
    lock = beside(session, ".lock")
    with suppress(OSError), lock.open("rb") as file:
        from filelock import FileLock, SoftFileLock, lock_descriptor  # noqa: PLC0415 - rare

        is_soft = FileLock is SoftFileLock  # its file is the lock
        for pause_s in (_LOOK_S, 0.0):
            if not is_soft and lock_descriptor(file.fileno(), blocking=False):
                return ""
            time.sleep(pause_s)
        return _holder(lock)
    return ""
