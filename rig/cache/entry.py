"""What the same program computed from the same content before, on this computer."""

import hashlib
import platform
import sqlite3
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar

from rig import __version__
from rig.cache.plain import from_text, to_text
from rig.cache.store import CacheFolder

Kept = TypeVar("Kept")


def find(kind: type[Kept], *content: object, fresh: bool = False) -> Kept | None:
    """Return a kept result; `None` where there is none.

    Parameters
    ----------
    kind
        Its type: what else is found is no result.
    *content
        All that entered into it, besides this program; each has a `repr` that no other content has.
        Where any is `None`, nothing is kept.
    fresh
        Whether to look for none.
    """
    key = _key(kind, content)
    text = CacheFolder().get(key) if key and not fresh else None
    with suppress(ValueError):
        if isinstance(result := from_text(text or ""), kind):
            return result
    return None


def keep(result: object, *content: object) -> str:
    """Keep a result, and return its text: read again, it is as `find` will return it.

    Parameters
    ----------
    result
        As `rig.cache.plain.to_text` takes it. One whose attribute `failed` names what it lacks
        is not kept.
    *content
        As for `find`.
    """
    key, text = _key(type(result), content), to_text(result)
    if key and not getattr(result, "failed", ()):
        CacheFolder().put(key, text)
    return text


def recall(
    kind: type[Kept], make: Callable[[], Kept], *content: object, fresh: bool = False
) -> Kept:
    """Return a kept result, or else make it; arguments as for `find`."""
    result = find(kind, *content, fresh=fresh)
    return from_text(keep(make(), *content)) if result is None else result


def _key(kind: type, content: tuple[object, ...]) -> str:
    program = "" if None in content else _program()
    return program and repr((program, kind.__qualname__, *content))


def environment() -> dict[str, str]:
    """Return the versions that numbers depend on."""
    return {
        "rig": __version__,
        **{package: version(package) for package in ("numpy", "scipy", "matplotlib")},
        "python": platform.python_version(),
        "sqlite": sqlite3.sqlite_version,
        "system": platform.system(),
        "machine": platform.machine(),
    }


@cache
def _program() -> str:
    """Tell this program, by its files and those it computes with, and this computer from others.

    Returns
    -------
    str
        Empty where its files cannot be read.
    """
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    # By content: files that pip unpacks may all be of the same time.
    for path in sorted(root.rglob("*.*")):
        if path.suffix != ".pyc":
            digest.update(f"{path.relative_to(root)}\0".encode())
            digest.update(path.read_bytes())
    digest.update(repr((environment(), platform.node())).encode())
    return digest.hexdigest() if Path(__file__).is_file() else ""
