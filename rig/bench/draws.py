"""Monte Carlo draws from an adjusted drop, all at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.bench.rivals import Reading

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.analysis.fit import Fit

    Array = NDArray[np.float64]

BATCH = 10_000
"""Draws at a time: a few megabytes."""


def drawn(fit: Fit, draws: int, seed: int) -> Reading:
    """Mean Δz and V over draws of all unknowns from their joint normal distribution.

    Nothing is linearised from the unknowns on: each draw is a fall of its own.

    Parameters
    ----------
    fit
        A drop of two chains, adjusted by itself.
    draws
        M of JCGM 101.
    """
    rng = np.random.default_rng(seed)
    model, estimate = fit.model, fit.estimate
    at, struck, free = model.unknowns, model.sides["impact"], model.sides["free"]
    assert struck.ratios is not None
    names = ["gravity", "drop", "side", "alpha", "impulses", "impact hang", "impact rods"]
    names += ["free hang", "free rods"]
    places = np.concatenate([np.arange(at[name].start, at[name].stop) for name in names])
    sd = estimate.sd[places]
    covariance = estimate.covariance[np.ix_(places, places)] * np.outer(sd, sd)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    begin = np.cumsum([0, *(at[name].stop - at[name].start for name in names)])
    part = {name: slice(*begin[n : n + 2]) for n, name in enumerate(names)}
    total, done = np.zeros(2), 0
    while done < draws:
        size = min(BATCH, draws - done)
        x = estimate.x[places][:, None] + root @ rng.standard_normal((places.size, size))
        gravity = model.protocol.gravity.value + x[part["gravity"]][0]
        start = model.protocol.drop.value + x[part["drop"]][0]
        heights = np.array(struck.chain.chain.heights)[:, None] + x[part["impact rods"]]
        gains = model.guesses["impact"].alpha + x[part["alpha"]] + x[part["impulses"]]
        level, speed, time, arrival = start + x[part["impact hang"]][0], 0.0, 0.0, 0.0
        for gain, ratio, height in zip(gains, struck.ratios, heights, strict=True):
            distance = np.maximum(level + height, 0.0)
            arrival = np.sqrt(speed**2 + 2.0 * gravity * distance)
            time = time + 2.0 * distance / (speed + arrival)
            speed, level = arrival * (1.0 + gain * ratio), -height
        top = free.chain.chain.length + x[part["free rods"]][-1]
        above = start + x[part["side"]][0] + x[part["free hang"]][0] + top
        total += [(above - 0.5 * gravity * time**2).sum(), np.sum(arrival)]
        done += size
    return Reading(*(total / draws).tolist())
