"""A disk that can fail: a small ext4 in a file, where it may be mounted."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Self

from rig.errors import InputError

if TYPE_CHECKING:
    from types import TracebackType

_BYTES = 16 << 20


class FailingDisk:
    """Room for a session; a context at whose end it is gone.

    Parameters
    ----------
    place
        Where the file with the disk and its folder are made.

    Attributes
    ----------
    folder
        On the disk.

    Raises
    ------
    InputError
        It cannot be mounted here: that takes root and a kernel that knows loop devices.
    """

    def __init__(self, place: Path) -> None:
        self.folder = place / "mounted"
        self.folder.mkdir()
        image = place / "ext4"
        with image.open("wb") as file:
            file.truncate(_BYTES)
        try:
            _call("mkfs.ext4", "-q", image)
            _call("mount", "-o", "loop,errors=remount-ro", image, self.folder)
        except (OSError, subprocess.CalledProcessError) as error:
            raise InputError(f"no disk can be mounted here: {error}", "as root it can") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: object, _trace: TracebackType | None
    ) -> None:
        _call("umount", "--lazy", self.folder)

    def fail(self) -> None:
        """Have the kernel find an error on it: it can only be read from then on."""
        self._trigger.write_text("1", "ascii")

    @property
    def can_fail(self) -> bool:
        """Whether the kernel lets this program cause an error: some containers show no ext4."""
        return os.access(self._trigger, os.W_OK)

    @property
    def _trigger(self) -> Path:
        source = _call("findmnt", "-no", "SOURCE", self.folder)
        return Path("/sys/fs/ext4", Path(source).name, "trigger_fs_error")


def _call(*command: object) -> str:
    return subprocess.run(
        [*map(str, command)], capture_output=True, check=True, text=True
    ).stdout.strip()
