"""What the command line says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rig.campaign.machine import COUNTDOWN_S
from rig.tui.stillness import STILL_S


def ascii_only(environment: Mapping[str, str]) -> bool:
    """Whether a terminal shows ASCII only, by its type or its locale."""
    if environment.get("TERM", "") in {"linux", "vt100", "vt220", "ansi", "dumb"}:
        return True
    names = ("LC_ALL", "LC_CTYPE", "LANG")
    locale = next((value for name in names if (value := environment.get(name))), "UTF-8")
    return "utf8" not in locale.casefold().replace("-", "")


@dataclass(frozen=True, slots=True)
class Options:
    """What the command line says.

    Attributes
    ----------
    files
        Protocols to choose from.
    port
        Empty to watch a daemon that runs already.
    session
        The file to be made or continued.
    offline
        Only look at `session`: no daemon is asked for.
    still_s
        How long the screen stands still before Enter can arm.
    bell
        Whether it rings at a verdict.
    ascii
        Whether only ASCII can be shown.
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
