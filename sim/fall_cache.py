"""Resolved falls that were made before, on the disk: one file of JSON for each."""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from sim import resolved

KEPT = 2000
"""Files at most; the oldest go."""


def key(*what: object) -> str:
    """Name a fall by all that it follows from, the code of its world included."""
    return hashlib.sha256(repr((_code(), *what)).encode()).hexdigest()[:32]


@cache
def _code() -> str:
    digest = hashlib.sha256()
    world = Path(resolved.__file__).parent
    for source in sorted([*world.glob("*.py"), *world.parent.glob("resolved_*.py")]):
        digest.update(source.read_bytes())
    return digest.hexdigest()


def folder() -> Path:
    """Where they are kept."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "chainrig" / "falls"


def load(name: str) -> Any | None:
    """Find a fall; `None` if it was never made, or cannot be read."""
    with suppress(OSError, ValueError):
        return json.loads((folder() / f"{name}.json").read_text(encoding="utf-8"))
    return None


def save(name: str, what: Any) -> None:
    """Keep a fall, where that is possible: a full or forbidden disk only costs time later."""
    with suppress(OSError):
        place = folder()
        place.mkdir(parents=True, exist_ok=True)
        beside = place / f"{name}.{os.getpid()}.new"
        beside.write_text(json.dumps(what), encoding="utf-8")
        beside.replace(place / f"{name}.json")
        kept = sorted(place.glob("*.json"), key=lambda one: one.stat().st_mtime)
        for old in kept[:-KEPT]:
            old.unlink(missing_ok=True)
