"""Files that are either the old one or the new one, never half of each."""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from rig.reasons import errors_become, rig_error

_KINDS = {"d": "a folder", "p": "a pipe", "s": "a socket", "c": "a device", "b": "a device"}
"""What is no file, by the letter that ``ls -l`` has for it."""
_SQLITE = b"SQLite format 3\0"
"""How a session file begins: nothing but its own recorder ever writes there."""
_DESCRIPTORS = ("/dev/", "/proc/")
"""Where a shell puts the pipe of ``<(...)`` or ``|``: somebody writes into it, and it ends."""


def beside(path: Path, ending: str) -> Path:
    """Return the place of a file beside another, whose name has a further ending."""
    return path.with_name(path.name + ending)


def require_file(path: str | os.PathLike[str], *, descriptors: bool = False) -> None:
    """Refuse what is no file: to open or to read it may never end.

    Parameters
    ----------
    path
        As the user named it.
    descriptors
        Whether a pipe that a shell has opened will do too.

    Raises
    ------
    OSError
        It is a folder, a pipe, a socket or a device, or nothing is there.
    """
    kind = _KINDS.get(stat.filemode(Path(path).stat().st_mode)[0])
    opened = descriptors and kind == "a pipe" and os.fspath(path).startswith(_DESCRIPTORS)
    if kind and not opened:
        raise OSError(errno.EINVAL, f"it is {kind}; name a file", os.fspath(path))


def read_input(path: str | os.PathLike[str], limit: int = -1) -> bytes:
    """Read a file, or a pipe as of ``<(...)``, that a user has named; at most so many bytes.

    Raises
    ------
    OSError
        It cannot be read, or see `require_file`.
    """
    require_file(path, descriptors=True)
    with Path(path).open("rb") as stream:
        return stream.read(limit)


def write_atomic(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Write text as UTF-8, or bytes, so that a crash leaves the old file or the new one.

    A path that is a device or a pipe (``/dev/stdout``) is written straight through, since
    replacing it would be wrong.

    Parameters
    ----------
    path
        The file to make or replace; a symbolic link is followed.
    content
        All of it, line ends as they stand.

    Raises
    ------
    InputError
        If the place cannot be written: no such folder, no permission, disk full.
    """
    with replacing(path) as stream:
        stream.write(content if isinstance(content, bytes) else content.encode("utf-8"))


def check_place(path: str | os.PathLike[str]) -> None:
    """See that a file could be written, before the work begins that it is for.

    Raises
    ------
    InputError
        There is no such folder, or a folder or a session is in its place.
    """
    target = Path(os.path.realpath(path))
    with suppress(OSError):  # what may not be looked at is told when it is written
        if target.is_dir():
            raise rig_error("place_is_folder", path=path)
        if not target.parent.is_dir():
            raise rig_error("place_without_folder", path=path)
        if target.is_file() and read_input(target, len(_SQLITE)) == _SQLITE:
            raise rig_error("place_of_session", path=path)


def check_new(path: str | os.PathLike[str]) -> Path:
    """Return a place at which nothing is yet, for a file that people write on.

    Raises
    ------
    InputError
        Something is there.
    """
    if os.path.lexists(path):
        raise rig_error("place_taken", path=path)
    return Path(path)


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Provide a stream whose content takes the place of a file when the block has ended well.

    As `write_atomic`, for content that comes in pieces; nothing but writing belongs in the block.

    Raises
    ------
    InputError
        As in `write_atomic`.
    """
    path_given, target = Path(path), Path(os.path.realpath(path))  # a pipe has no real path
    with errors_become("file_unwritten", OSError, path=path):
        check_place(path)
        through = path_given.exists() and not path_given.is_file()
        with path_given.open("wb") if through else _replacing(target) as stream:
            yield stream


def state_folder() -> Path:
    """Name the folder for what must outlive a program that fails: logs, and data without a place.

    Raises
    ------
    InputError
        This user has no home.
    """
    with errors_become("no_state_folder", RuntimeError):
        return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local/state") / "chainrig"


def stat_of(path: Path) -> os.stat_result | None:
    """Return what the system says of a file; `None` without one."""
    with suppress(OSError):
        return path.stat()
    return None


def file_stamp(path: Path) -> tuple[tuple[int, int, int], ...]:
    """Tell a session file, and what was written beside it, from what they were before."""
    stats = map(stat_of, (path, beside(path, "-wal")))
    return tuple((stat.st_ino, stat.st_mtime_ns, stat.st_size) for stat in stats if stat)


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder for several files, unless it is there.

    Raises
    ------
    InputError
        If it cannot be made.
    """
    folder = Path(path)
    with errors_become("folder_unmade", OSError, path=folder):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


@contextmanager
def _replacing(target: Path) -> Iterator[BinaryIO]:
    # Hidden and in the same folder: a rename is atomic only within one file system. The name is
    # cut because the target's own may already be as long as a name can be.
    temporary = target.with_name(f".{target.name[:40]}.{os.getpid()}.tmp")
    temporary.unlink(missing_ok=True)  # left by a killed process that had this id
    try:
        # Plain open, not tempfile: the result keeps the permissions of the user's umask.
        with temporary.open("xb") as stream:
            yield stream
            stream.flush()
            # Without it the rename may reach the disk before the content does, and a power cut
            # would leave an empty file under the right name.
            os.fsync(stream.fileno())
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
    with suppress(OSError):  # some network and FAT mounts refuse to sync a folder
        handle = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
