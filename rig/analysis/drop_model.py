"""The observation equations: where the matched edges should be, given all unknowns."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.trajectory import (
    COMMON,
    GRAVITY,
    RELEASE,
    START,
    free_trajectory,
    struck_trajectory,
)
from rig.analysis.unknowns import (
    ANY_GRAVITY,
    ANYTHING,
    BEAM_U,
    HANG_U,
    IMPULSE_FLOOR,
    IMPULSE_U,
    Unknowns,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.pattern import Guess
    from rig.analysis.trains import Side
    from rig.analysis.trajectory import Trajectory
    from rig.protocol.scene import Protocol

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

FLOOR = 0.1e-3
"""What an edge may be off for reasons not in the equations (a rod not quite round), m."""
JITTER = 2e-6
"""Scatter of one time stamp, s."""


class Equations(NamedTuple):
    """Observation equations of one side, one a matched edge.

    Attributes
    ----------
    residuals
        Where the beam saw the rod's side less where the beam is, m.
    jacobian
        Derivatives by all unknowns.
    sigma
        Standard deviation of each residual, m.
    """

    residuals: Array
    jacobian: Array
    sigma: Array


class DropModel:
    """One drop: its unknowns, and the equations that tie them to edges.

    Parameters
    ----------
    protocol
        The scene.
    sides
        The chains with their trains.
    guesses
        First guess for each side, by role.
    clock_u
        Relative standard uncertainty of the time scale.
    """

    def __init__(
        self,
        protocol: Protocol,
        sides: Sequence[Side],
        guesses: Mapping[str, Guess],
        clock_u: float,
    ) -> None:
        assert protocol.gates is not None
        self.protocol = protocol
        self.sides: dict[str, Side] = {side.role: side for side in sides}
        self.guesses = guesses
        gates = protocol.gates.gates
        self.heights = np.array([gate.height for gate in gates])
        free_only = protocol.surface is None
        unknowns = Unknowns()
        unknowns.add("clock", "clock", clock_u)
        unknowns.add("gravity", "gravity", ANY_GRAVITY if free_only else protocol.gravity.u)
        unknowns.add("drop", "drop height", protocol.drop.u)
        unknowns.add("beams", "beam heights", [protocol.gates.height_u] * len(gates))
        slopes = [math.tan(math.radians(side.chain.tilt_deg)) for side in sides]
        if any(slopes):
            unknowns.add("ripple", "beam offsets", [BEAM_U * max(slopes)] * len(gates))
        for side in sides:
            chain, role = side.chain, side.role
            unknowns.add(f"{role} release", "edges", ANYTHING)
            unknowns.add(f"{role} hang", "hanging height", HANG_U)
            unknowns.add(f"{role} rods", "rod places", [chain.position_u] * chain.chain.rods)
            unknowns.add(f"{role} width", "rod width", chain.width_u)
        if "impact" in self.sides:
            alpha = abs(guesses["impact"].alpha)
            scatter = math.hypot(IMPULSE_U * alpha, IMPULSE_FLOOR)
            unknowns.add("alpha", "edges", ANYTHING)
            unknowns.add(
                "impulses", "single impulses", [scatter] * self.sides["impact"].chain.chain.rods
            )
        self.unknowns = unknowns

    def first(self) -> Array:
        """Unknowns as the first guess has them, shape ``(unknowns,)``."""
        x = np.zeros(len(self.unknowns))
        starts = [guess.start for guess in self.guesses.values()]
        x[self.unknowns["drop"]] = sum(starts) / len(starts) - self.protocol.drop.value
        return x

    def trajectory(self, role: str, x: Array) -> Trajectory:
        """Path of one side for given unknowns."""
        at = self.unknowns
        release = self.guesses[role].release + float(x[at[f"{role} release"]][0])
        start = self.protocol.drop.value + float(x[at["drop"]][0] + x[at[f"{role} hang"]][0])
        gravity = self.protocol.gravity.value + float(x[at["gravity"]][0])
        if role == "free":
            return free_trajectory(release, start, gravity)
        side = self.sides["impact"]
        assert side.ratios is not None
        places = np.array(side.chain.chain.heights) + x[at["impact rods"]]
        gains = self.guesses[role].alpha + x[at["alpha"]] + x[at["impulses"]]
        return struck_trajectory(release, start, gravity, gains, side.ratios, places)

    def spread(self, role: str, derivatives: Array) -> Array:
        """Derivatives by a trajectory's parameters → by all unknowns.

        Parameters
        ----------
        derivatives
            Shape ``(…, parameters)``.

        Returns
        -------
        ndarray
            Shape ``(…, unknowns)``.
        """
        at = self.unknowns
        found = np.zeros((*derivatives.shape[:-1], len(at)))
        found[..., at[f"{role} release"]] = derivatives[..., [RELEASE]]
        found[..., at["gravity"]] = derivatives[..., [GRAVITY]]
        found[..., at["drop"]] = found[..., at[f"{role} hang"]] = derivatives[..., [START]]
        if role == "impact":
            rods = self.sides["impact"].chain.chain.rods
            by_gain = derivatives[..., COMMON : COMMON + rods]
            found[..., at["alpha"]] = by_gain.sum(axis=-1, keepdims=True)
            found[..., at["impulses"]] = by_gain
            found[..., at["impact rods"]] = derivatives[..., COMMON + rods :]
        return found

    def levels(self, role: str, x: Array) -> list[Array]:
        """Where the reference point should be at every expected edge of each train, m."""
        at = self.unknowns
        side = self.sides[role]
        found = []
        for train in side.trains:
            shift = x[at["beams"]][train.gate] - x[at[f"{role} rods"]][train.rods]
            if "ripple" in at:
                shift -= _alternating(train.rods) * x[at["ripple"]][train.gate]
            width = 0.5 * float(x[at[f"{role} width"]][0])
            found.append(train.levels + shift + np.where(train.blocks, width, -width))
        return found

    def equations(self, role: str, x: Array, matches: Sequence[Index]) -> Equations:
        """Observation equations of one side for its matched edges."""
        at = self.unknowns
        side = self.sides[role]
        path = self.trajectory(role, x)
        pick = [match >= 0 for match in matches]
        chosen = [match[ok] for match, ok in zip(matches, pick, strict=True)]
        columns = list(zip(side.trains, chosen, pick, strict=True))
        raw = np.concatenate([train.times[edge] for train, edge, _ in columns])
        rods = np.concatenate([train.rods[ok] for train, _, ok in columns])
        sign = np.concatenate([np.where(train.blocks[ok], -0.5, 0.5) for train, _, ok in columns])
        gate = np.concatenate([np.full(edge.size, train.gate) for train, edge, _ in columns])
        level = np.concatenate(
            [level[ok] for level, ok in zip(self.levels(role, x), pick, strict=True)]
        )
        times = raw * (1.0 + x[at["clock"]])
        height, speed = path.heights(times)
        jacobian = self.spread(role, path.derivatives(times))
        row = np.arange(times.size)
        jacobian[row, at["clock"].start] -= speed * raw
        jacobian[row, at[f"{role} rods"].start + rods] += 1.0
        jacobian[row, at[f"{role} width"].start] += sign
        jacobian[row, at["beams"].start + gate] -= 1.0
        if "ripple" in at:
            jacobian[row, at["ripple"].start + gate] += _alternating(rods)
        burst = np.concatenate([train.burst[edge] for train, edge, _ in columns])
        sigma = np.sqrt(FLOOR**2 + (speed * np.hypot(JITTER, burst)) ** 2)
        return Equations(height - level, jacobian, sigma)


def _alternating(rods: Index) -> Array:
    """+1 for even rods, −1 for odd ones: neighbours are tilted the other way."""
    found: Array = np.where(rods % 2, -1.0, 1.0)
    return found
