"""What one light beam sees: blocked intervals, and the edges a real receiver makes of them."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy as np

    from .dials import Dials

NOT_A_ROD = -1


class Shadow(NamedTuple):
    """Something in the beam, from `start` to `end`; `rod` is `NOT_A_ROD` for string and bounce."""

    start: float
    end: float
    rod: int


class SeenEdge(NamedTuple):
    """An edge as the receiver reports it, with the hidden truth of its origin."""

    time_s: float
    channel: int
    blocked: bool
    rod: int


def union(shadows: Iterable[Shadow]) -> list[tuple[Shadow, int]]:
    """Merge shadows that overlap; each comes with the rod whose end ends it."""
    merged: list[tuple[Shadow, int]] = []
    for shadow in sorted(shadows):
        if merged and shadow.start <= merged[-1][0].end:
            last, _ = merged[-1]
            if shadow.end > last.end:
                merged[-1] = (Shadow(last.start, shadow.end, last.rod), shadow.rod)
        else:
            merged.append((shadow, shadow.rod))
    return merged


def string_shadows(rods: Sequence[Shadow], chance: float, rng: np.random.Generator) -> list[Shadow]:
    """Flickers of the string in some of the gaps between rods, which come in order of time."""
    shadows: list[Shadow] = []
    for before, after in itertools.pairwise(rods):
        if rng.random() < chance and before.end < after.start:
            at = float(rng.uniform(before.end, after.start))
            shadows.append(Shadow(at, at + float(rng.uniform(30e-6, 200e-6)), NOT_A_ROD))
    return shadows


def bounces(strikes_s: Iterable[float], chance: float, rng: np.random.Generator) -> list[Shadow]:
    """Shadows of some of the rods that struck, as they come up once more."""
    shadows: list[Shadow] = []
    for strike_s in strikes_s:
        if rng.random() < chance:
            at = strike_s + float(rng.uniform(4e-3, 30e-3))
            shadows.append(Shadow(at, at + float(rng.uniform(2e-3, 10e-3)), NOT_A_ROD))
    return shadows


def receive(
    shadows: Iterable[Shadow], channel: int, dials: Dials, rng: np.random.Generator
) -> list[SeenEdge]:
    """Edges of one receiver: missed ones left out, chatter and jitter added.

    Half of what is missed is a rod that never darkens the beam enough, half a gap between two
    rods that never brightens it; either way the levels stay consistent, as they do on a wire.
    """
    edges: list[SeenEdge] = []
    for shadow, end_rod in union(shadows):
        lost = rng.random()
        if lost < dials.missed / 2:
            continue
        if lost > 1.0 - dials.missed / 2 and edges:
            edges.pop()
        else:
            edges.append(SeenEdge(shadow.start, channel, True, shadow.rod))
        edges.append(SeenEdge(shadow.end, channel, False, end_rod))
    if dials.chatter:
        edges = [seen for edge in edges for seen in _flicker(edge, dials, rng)]
    jitter = rng.normal(0.0, dials.jitter_sd, len(edges))
    noisy: list[SeenEdge] = []
    last = 0.0
    for edge, error in zip(edges, jitter, strict=True):
        last = max(last, edge.time_s + float(error))
        noisy.append(SeenEdge(last, channel, edge.blocked, edge.rod))
    return noisy


def _flicker(edge: SeenEdge, dials: Dials, rng: np.random.Generator) -> list[SeenEdge]:
    """One edge, or now and then a burst that ends in the same level."""
    seen = [edge]
    if rng.random() < dials.chatter:
        time = edge.time_s
        for _ in range(int(rng.integers(1, 4))):
            for blocked in (not edge.blocked, edge.blocked):
                time += float(rng.uniform(20e-6, 120e-6))
                seen.append(SeenEdge(time, edge.channel, blocked, edge.rod))
    return seen
