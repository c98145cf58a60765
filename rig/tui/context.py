"""Options of the command line."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rig.campaign.machine import COUNTDOWN_S
from rig.tui.stillness import STILL_S


def ascii_only(environment: Mapping[str, str]) -> bool:
    """Whether a terminal is limited to ASCII, by its type or locale."""
    if environment.get("TERM", "") in {"linux", "vt100", "vt220", "ansi", "dumb"}:
        return True
    names = ("LC_ALL", "LC_CTYPE", "LANG")
    locale = next((value for name in names if (value := environment.get(name))), "UTF-8")
    return "utf8" not in locale.casefold().replace("-", "")


@dataclass(frozen=True, slots=True)
class Options:
    """Options of the command line.

    Attributes
    ----------
    files
        Protocols to choose from.
    port
        Port of the rig; empty to watch a running daemon.
    session
        Session file to create or continue.
    offline
        Whether to show only `session`, without a daemon.
    still_s
        Time that the screen must be still before Enter can arm, s.
    bell
        Whether to ring the bell at a verdict.
    ascii
        Whether to draw only ASCII.
    """

    files: tuple[Path, ...] = ()
    port: str = ""
    session: Path | None = None
    seed: int | None = None
    socket: Path | None = None
    offline: bool = False
    countdown_s: float = COUNTDOWN_S
    still_s: float = STILL_S
    bell: bool = False
    ascii: bool = False
