"""The paper's uniform chain in the resolved world, hung a little differently each time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sim.resolved.scene import Board, Bounce, Chain, Rods, Strings

if TYPE_CHECKING:
    from numpy.random import Generator

RODS, PITCH, DROP, GRAVITY = 25, 1.165 / 24, 0.18, 9.81
BETA, MU = 0.5, 0.2


def paper_chain(
    incline_deg: float,
    rng: Generator,
    *,
    rods: int = RODS,
    drop: float = DROP,
    touch_s: float = 0.2e-3,
    touching: bool = True,
) -> Chain:
    """Hang the chain's first rods, or more of them.

    Parameters
    ----------
    rng
        For tilts, directions and places.
    drop
        Of the bottom rod, m.
    touch_s
        How long touches last, s.
    touching
        Whether rods strike rods.
    """
    signs = (-1.0) ** np.arange(rods)
    hung = Rods(
        masses=np.full(rods, 5.8e-3),
        heights=PITCH * np.arange(rods),
        diameters=np.full(rods, 12.7e-3),
        tilts=signs * np.radians(12.0 + rng.normal(size=rods)),
        yaws=np.radians(2.0 * rng.normal(size=rods)),
        aside=0.5e-3 * rng.normal(size=rods),
        length=0.102,
    )
    board = Board(math.radians(incline_deg), Bounce(BETA, touch_s, MU))
    wood = Bounce(0.5, touch_s, 0.3) if touching else None
    return Chain(hung, Strings(), drop, GRAVITY, board, wood)
