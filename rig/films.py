"""How a simulated chain moved: every rod at every moment, as the simulation tells it for pictures.

Only worlds that resolve rods tell it; it lies with the hidden truth beside the session file.
"""

from __future__ import annotations

import json
import math
from bisect import bisect_left
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from typing import TYPE_CHECKING

from rig.ports import truth_file

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    Point = Sequence[float]

_LOOSE_M = 5e-4  # places are told to 0.1 mm


@dataclass(frozen=True, slots=True)
class Film:
    """The striking chain's fall, from its release to a little after its top rod struck.

    x runs along the level lines of the board, y down its slope, z upwards from the contact level.

    Attributes
    ----------
    incline_deg
        Of the board.
    board_m
        Height of the board below the chain, negative; at y it is lower by y tan of the incline.
    radii_m
        Of each rod, bottom up.
    rest_m
        Lengths of the strings above each rod but the last, left and right; shape (2, N − 1).
    touched_s
        When each rod first touched anything, s after the release; `None` if it never did.
    times_s
        Moments, s after the release of this chain; shape (T,).
    left, right
        Both ends of each rod's axis then, x, y and z in m; shape (T, N, 3).
    """

    incline_deg: float
    board_m: float
    radii_m: Sequence[float]
    rest_m: Sequence[Sequence[float]]
    touched_s: Sequence[float | None]
    times_s: Sequence[float]
    left: Sequence[Sequence[Point]]
    right: Sequence[Sequence[Point]]

    def nearest(self, time_s: float) -> int:
        """Number of the moment nearest to a time."""
        after = min(max(bisect_left(self.times_s, time_s), 1), len(self.times_s) - 1)
        early = time_s - self.times_s[after - 1] < self.times_s[after] - time_s
        return after - 1 if early else after

    def middles(self, moment: int) -> list[tuple[float, float, float]]:
        """Middle of each rod."""
        return [
            ((a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0, (a[2] + b[2]) / 2.0)
            for a, b in zip(self.left[moment], self.right[moment], strict=True)
        ]

    def slack(self, moment: int) -> tuple[list[bool], list[bool]]:
        """Whether each string is shorter than at rest: the left ones, and the right ones."""

        def loose(ends: Sequence[Point], lengths: Sequence[float]) -> list[bool]:
            strings = zip(ends, ends[1:], lengths, strict=False)
            return [math.dist(low, high) < rest - _LOOSE_M for low, high, rest in strings]

        left, right = self.rest_m
        return loose(self.left[moment], left), loose(self.right[moment], right)


def film_digest(session: Path) -> str:
    """SHA-256 of the file that has a session's films; empty where there is none."""
    with suppress(OSError):
        return sha256(truth_file(session).read_bytes()).hexdigest()
    return ""


def read_films(session: Path) -> dict[tuple[int, int], Film]:
    """Films of a session by run and attempt; none for real rigs and for the model's world.

    A line that was cut off while it was written is passed over.
    """
    films: dict[tuple[int, int], Film] = {}
    with suppress(OSError), truth_file(session).open(encoding="utf-8") as lines:
        for line in lines:
            with suppress(ValueError, TypeError):
                truth = json.loads(line)
                if truth.get("film") is not None:
                    films[truth["run"], truth["attempt"]] = Film(**truth["film"])
    return films
