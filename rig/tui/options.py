"""What the command line says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.campaign.machine import COUNTDOWN_S

if TYPE_CHECKING:
    from pathlib import Path


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
    """

    files: tuple[Path, ...] = ()
    port: str = ""
    session: Path | None = None
    seed: int | None = None
    socket: Path | None = None
    offline: bool = False
    countdown_s: float = COUNTDOWN_S
