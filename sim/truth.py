"""The hidden truth of simulated drops, kept apart from the data."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


@dataclass(slots=True)
class Truth:
    """What really happened in one drop; `None` for what the scene does not have.

    Without ``strike`` it is at level, where the top rod's middle passes the contact level; at
    strike that rod touches something.

    Each of `edges` is (seconds after fire, channel, blocked, rod), rod −1 for what was no rod.
    """

    run: int
    attempt: int
    incline_deg: float
    impact_chain: str | None
    gravity_m_s2: float
    edges: Sequence[tuple[float, int, bool, int]] = ()
    separation_m: float | None = None
    separation_raw_m: float | None = None
    separation_strike_m: float | None = None
    speed_m_s: float | None = None
    speed_strike_m_s: float | None = None
    fall_time_s: float | None = None
    release_skew_s: float | None = None


@dataclass(slots=True)
class ResolvedTruth(Truth):
    """The truth of a resolved drop.

    Where the top rod strikes before the level, on rods that lie there, at level is when it would
    have passed had it fallen on. ``camera`` is read off as by the paper's camera. ``track`` are
    heights of both top rods until the strike, each counted from its own release.
    """

    camera_separation_m: float | None = None
    camera_speed_m_s: float | None = None
    strike_time_s: float | None = None
    contact_height_m: float | None = None
    track: dict[str, list[float]] | None = None


def append_truth(path: Path | None, truth: Truth) -> None:
    """Add one drop's truth as a line of JSON to a file, if there is one."""
    if path is None:
        return
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(asdict(truth)) + "\n")
