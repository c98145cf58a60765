"""One writer at a time: an advisory lock that no crash can leave behind."""

from __future__ import annotations

import errno
import fcntl
import os
from contextlib import suppress
from pathlib import Path

from rig.errors import SessionError
from rig.reasons import make_error


class WriterLock:
    """An exclusive ``flock`` on ``FILE.lock`` beside the session.

    The kernel drops the lock when its process ends, however it ends, so a killed writer blocks
    nobody. The lock has a file of its own because closing any second handle on the database
    would silently drop the POSIX locks SQLite holds on it in this process.

    Raises
    ------
    SessionError
        If another process (or another `Session` here) holds it, or the folder cannot be written.
    """

    def __init__(self, session: Path) -> None:
        self.path = session.with_name(session.name + ".lock")
        self._handle: int | None = None
        try:
            self._handle = self._acquire(session)
        except OSError as error:
            if isinstance(error, SessionError):
                raise
            if error.errno in {errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS}:
                raise make_error(SessionError, "disk_knows_no_locks", path=session) from error
            # The lock is the first file that a session makes: without its folder there is neither.
            code = "session_unmade" if isinstance(error, FileNotFoundError) else "cannot_lock"
            raise make_error(SessionError, code, path=session, text=error) from error

    def _acquire(self, session: Path) -> int:
        while True:
            _refuse_second_name(session)
            handle = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if self._is_current(handle):
                    os.ftruncate(handle, 0)
                    os.write(handle, f"{os.getpid()}\n".encode())
                    return handle
            except BlockingIOError:
                holder = _holder(handle)
                os.close(handle)
                used = make_error(SessionError, "session_in_use", path=session, holder=holder)
                raise used from None
            except BaseException:
                os.close(handle)
                raise
            os.close(handle)

    def _is_current(self, handle: int) -> bool:
        # The holder before us may have removed the file between our open and our lock; what we
        # hold would then be a lock on a name nobody else can see.
        with suppress(FileNotFoundError):
            return os.path.samestat(os.fstat(handle), self.path.stat())
        return False

    def release(self) -> None:
        """Give the lock up and take its file away; further calls do nothing."""
        if self._handle is None:
            return
        with suppress(OSError):  # a folder made read-only meanwhile: a stale *file* blocks nobody
            self.path.unlink(missing_ok=True)  # while still locked, see _is_current
        os.close(self._handle)
        self._handle = None


def _holder(handle: int) -> str:
    owner = os.pread(handle, 32, 0).decode("ascii", "replace").strip()
    return f"process {owner}" if owner else "another process"


def writer_of(session: Path) -> str:
    """Name the process that has a session open for writing; empty without one."""
    with suppress(OSError), session.with_name(session.name + ".lock").open("rb") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return _holder(lock.fileno())
    return ""


def _refuse_second_name(session: Path) -> None:
    """A hard link has a lock and a log of its own: two writers would destroy the file."""
    with suppress(FileNotFoundError):
        if session.stat().st_nlink > 1:
            raise make_error(SessionError, "session_two_names", path=session)
