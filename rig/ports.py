"""Port URLs: which of them are simulations, and what a simulation needs to be told."""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlencode, urlsplit

if TYPE_CHECKING:
    from pathlib import Path

SIMULATED = ("sim", "emu")
"""URL schemes behind which no real chain falls."""


def is_simulated(url: str) -> bool:
    """Whether data from this port must be stamped as simulated."""
    return urlsplit(url).scheme in SIMULATED


def completed(url: str, protocol: Path, session: Path, seed: int | None) -> str:
    """Tell a simulation its scene, seed and where to keep the hidden truth.

    Parameters
    ----------
    url
        As the user wrote it; whatever it says stays. A real port comes back as it is.
    protocol
        The protocol file.
    session
        The session file; the truth is kept beside it.
    seed
        `None` for 0.
    """
    if not is_simulated(url):
        return url
    parts = urlsplit(url)
    settings = dict(parse_qsl(parts.query, keep_blank_values=True))
    settings.setdefault("protocol", str(protocol.resolve()))
    settings.setdefault("truth", str(truth_file(session)))
    if seed is not None:
        settings["seed"] = str(seed)
    settings.setdefault("seed", "0")
    # urlunsplit would drop the empty authority that pyserial looks for.
    return f"{parts.scheme}://{parts.netloc}{parts.path}?{urlencode(settings)}"


def truth_file(session: Path) -> Path:
    """Where a simulation keeps the truth of a session."""
    return session.with_name(session.name + ".truth.jsonl")
