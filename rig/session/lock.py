"""One writer at a time: an advisory lock that no crash can leave behind."""

from __future__ import annotations

import errno
import os
import time
from contextlib import suppress
from pathlib import Path

from rig.errors import SessionError
from rig.reasons import make_error

_POLL_S = 0.0025
_LOOK_S = 0.01  # whoever looks for a writer has the lock for microseconds
_NO_LOCKS = {errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS}


class WriterLock:
    """An exclusive lock on ``FILE.lock`` beside the session.

    The kernel drops the lock when its process ends, however it ends, so a killed writer blocks
    nobody. The lock has a file of its own because closing any second handle on the database
    would silently drop the POSIX locks SQLite holds on it in this process.

    Raises
    ------
    SessionError
        If another process (or another `Session` here) holds it, or the folder cannot be written.
    """

    def __init__(self, session: Path) -> None:
        from filelock import FileLock, Timeout, has_fcntl  # noqa: PLC0415 - not for who only reads

        self.path = _place(session)
        self._lock = FileLock(
            self.path, _LOOK_S, thread_local=False, poll_interval=_POLL_S, fallback_to_soft=False
        )
        try:
            with suppress(FileNotFoundError):
                # A hard link has a lock and a log of its own: two writers would destroy the file.
                if session.stat().st_nlink > 1:
                    raise make_error(SessionError, "session_two_names", path=session)
            session.parent.stat()  # filelock would make it
            self._lock.acquire()
            if has_fcntl:  # elsewhere the lock's file cannot be written, or says who has it
                self.path.write_text(f"{os.getpid()}\n", "ascii")
        except Timeout:
            holder = _holder(self.path)
            raise make_error(SessionError, "session_in_use", path=session, holder=holder) from None
        except OSError as error:
            self._lock.release()
            if isinstance(error, SessionError):
                raise
            if error.errno in _NO_LOCKS:
                raise make_error(SessionError, "disk_knows_no_locks", path=session) from error
            # The lock is the first file that a session makes: without its folder there is neither.
            code = "session_unmade" if isinstance(error, FileNotFoundError) else "cannot_lock"
            raise make_error(SessionError, code, path=session, text=error) from error

    def release(self) -> None:
        """Give the lock up and take its file away; further calls do nothing."""
        if self._lock.is_locked:
            # A folder made read-only meanwhile: a stale *file* blocks nobody. While it is locked,
            # for then nobody else locks a name that is gone.
            with suppress(OSError):
                self.path.unlink(missing_ok=True)
            self._lock.release()


def _place(session: Path) -> Path:
    return session.with_name(session.name + ".lock")


def _holder(lock: Path) -> str:
    owner = ""
    with suppress(OSError):
        owner = lock.read_text("ascii", "replace").partition("\n")[0]
    return f"process {owner}" if owner else "another process"


def writer_of(session: Path) -> str:
    """Name the process that has a session open for writing; empty without one."""
    lock = _place(session)
    with suppress(OSError), lock.open("rb") as file:
        from filelock import lock_descriptor  # noqa: PLC0415 - only where somebody may write

        for pause_s in (_LOOK_S, 0.0):
            if lock_descriptor(file.fileno(), blocking=False):
                return ""
            time.sleep(pause_s)
        return _holder(lock)
    return ""
