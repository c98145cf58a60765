"""A disk that can be filled: a small tmpfs where it may be mounted, else a limit on files."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from bench.process_fixture import Process

_SIZE = "4m"
_CHUNK = bytes(1 << 12)


class SmallDisk:
    """Room for a session.

    Parameters
    ----------
    folder
        Is made; the disk is there until `close`.

    Attributes
    ----------
    how
        What stands for a full disk: ``tmpfs`` or ``RLIMIT_FSIZE``.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()
        mounted = (
            sys.platform == "linux"
            and os.geteuid() == 0
            and _called("mount", "-t", "tmpfs", "-o", f"size={_SIZE}", "tmpfs", str(folder))
        )
        self.how = "tmpfs" if mounted else "RLIMIT_FSIZE"

    def fill(self, writer: Process | None) -> None:
        """Leave no room, at least not for this process."""
        if self.how != "tmpfs":
            written = [file.stat().st_size for file in self.folder.iterdir()]
            self._limit(writer, max(written, default=0))
            return
        try:
            with self._filler.open("wb", buffering=0) as file:
                while file.write(_CHUNK):
                    pass
        except OSError:
            pass  # full

    def free(self, writer: Process | None) -> None:
        """Make room again."""
        if self.how == "tmpfs":
            self._filler.unlink(missing_ok=True)
        else:
            self._limit(writer, None)

    def close(self) -> None:
        """Take the disk away."""
        if self.how == "tmpfs":
            _called("umount", "--lazy", str(self.folder))

    @property
    def _filler(self) -> Path:
        return self.folder / "filler"

    def _limit(self, writer: Process | None, size: int | None) -> None:
        if writer is None or sys.platform != "linux":
            raise NotImplementedError("no way to fill a disk here")
        import resource  # noqa: PLC0415 - not on Windows

        soft = resource.RLIM_INFINITY if size is None else size
        resource.prlimit(writer.pid, resource.RLIMIT_FSIZE, (soft, resource.RLIM_INFINITY))


def _called(*command: str) -> bool:
    return subprocess.run(command, capture_output=True, check=False).returncode == 0
