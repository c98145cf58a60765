"""Resolved falls made before, on the disk: for each a file of JSON, behind a line to know it by."""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from . import resolved

KEPT = 2000
"""Files at most, of some 0.1 MB each; the oldest go."""


def key(*causes: object) -> str:
    """Name a fall by all that it follows from, the code of its world included."""
    return hashlib.sha256(repr((_code(), *causes)).encode()).hexdigest()[:32]


@cache
def _code() -> str:
    """All of the simulation: how chains hang, cameras and films are kept in a fall too."""
    digest = hashlib.sha256()
    world = Path(resolved.__file__).parent
    for source in sorted([*world.glob("*.py"), *world.parent.glob("*.py")]):
        digest.update(source.read_bytes())
    return digest.hexdigest()


def folder() -> Path:
    """Where they are kept."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "chainrig" / "falls"


def load(name: str) -> Any | None:
    """Find a fall; `None` if it was never made, or is not what was kept."""
    with suppress(OSError, ValueError):
        digest, text = (folder() / f"{name}.json").read_text(encoding="utf-8").split("\n", 1)
        if digest == _digest(text):
            return json.loads(text)
    return None


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def save(name: str, drop: Any) -> None:
    """Keep a fall, where that is possible: a full or forbidden disk only costs time later."""
    with suppress(OSError):
        place = folder()
        place.mkdir(parents=True, exist_ok=True)
        text = json.dumps(drop)
        beside = place / f"{name}.{os.getpid()}.new"
        try:
            beside.write_text(f"{_digest(text)}\n{text}", encoding="utf-8")
            beside.replace(place / f"{name}.json")
        except OSError:  # what a full disk took of it must not stay
            beside.unlink(missing_ok=True)
            raise
        files = sorted(place.glob("*.json"), key=lambda file: file.stat().st_mtime)
        for old in files[:-KEPT]:
            old.unlink(missing_ok=True)
