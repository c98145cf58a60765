"""What was noticed in an earlier run of `bench.mutation`, and still would be."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING

from rig.files import write_atomic

if TYPE_CHECKING:
    from pathlib import Path


class Memory:
    """Faults that a test noticed: while the test and the faulty file stay, it would again.

    Parameters
    ----------
    root
        The project.
    file
        Where all is kept, so that a run that was ended goes on.
    """

    def __init__(self, root: Path, file: Path) -> None:
        self._root, self._file = root, file
        self._known: dict[str, str] = json.loads(file.read_text("utf-8")) if file.exists() else {}

    def noticed_by(self, path: str, faulty: str) -> str:
        """Name the test that noticed, empty where none is known to."""
        by = self._known.get(_digest(path, faulty), "")
        test, _, state = by.rpartition(" ")
        return test if state == self._state_of(test) else ""

    def note(self, path: str, faulty: str, test: str) -> None:
        """Keep it that a test noticed."""
        self._known[_digest(path, faulty)] = f"{test} {self._state_of(test)}"
        write_atomic(self._file, json.dumps(self._known))

    def _state_of(self, test: str) -> str:
        file = self._root / test.partition("::")[0]
        return _digest(file.read_text("utf-8")) if file.is_file() else "-"


def _digest(*texts: str) -> str:
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]
