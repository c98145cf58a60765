"""What the edges of one drop say of its impacts, with everything else eliminated.

About the adjusted unknowns, ‖r/σ‖² of a drop is a quadratic form in all of them. Its release
times, hanging heights and the scatter of its single impulses belong to this drop alone and are
eliminated, priors included (a Schur complement); what stays are the unknowns that all drops share,
the α of every rod, the height of the contact point and the air's drag. Every hypothesis about the
impacts is then a few small matrices away: no edge is looked at again, and none of what the edges
say is lost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.equations import STRAY, robust_weights
from rig.analysis.fit import Fit
from rig.analysis.trajectory import COMMON, DRAG

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel
    from rig.analysis.joint_fit import JointDrop
    from rig.analysis.trajectory import Trajectory
    from rig.analysis.unknowns import SharedUnknowns
    from rig.model.chain import Chain
    from rig.protocol.protocol import Run

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

EXTRA = ("contact", "drag")
"""Columns behind those of the rods: height of the contact point, m, and κ of the air, 1/m."""


@dataclass(frozen=True, slots=True)
class QuadraticForm:
    """zᵀMz + 2 vᵀz + c, z being the shared unknowns of the drop, then its impacts.

    Attributes
    ----------
    run
        Which drop.
    chain, ratios
        What struck, and ΔV/V of each impact for α = 1, shape ``(rods,)``.
    here
        Places of the drop's shared unknowns in the session's vector.
    matrix, vector, constant
        M, v and c, n = shared + rods + `EXTRA` of them. Shared unknowns are in units of their prior
        uncertainties, the others in SI.
    alphas
        α of each rod at which the form was made.
    arrivals
        Speed just before each impact, m/s.
    edges
        How many it is made of.
    """

    run: Run
    chain: Chain
    ratios: Array
    here: Index
    matrix: Array
    vector: Array
    constant: float
    alphas: Array
    arrivals: Array
    edges: int


def quadratic_form(run: Run, drop: Fit | JointDrop, shared: SharedUnknowns) -> QuadraticForm:
    """Reduce a drop to what it says of its impacts.

    Parameters
    ----------
    run
        What was dropped; its scene has a surface.
    drop
        Adjusted, by itself or with others.
    shared
        Where the shared unknowns are.
    """
    model, x = drop.model, drop.x
    at, record = model.unknowns, model.records["impact"]
    assert record.ratios is not None
    common, here = shared.places(model)
    alphas = model.guesses["impact"].alpha + x[at["alpha"]] + x[at["impulses"]]
    inflation = drop.estimate.scatter if isinstance(drop, Fit) else 1.0
    normal, vector, constant, edges = _normal(drop, alphas, inflation)
    sd = np.concatenate([at.sd, np.ones(len(EXTRA))])
    impulses = np.arange(at["impulses"].start, at["impulses"].stop)
    extra = np.arange(len(at), len(at) + len(EXTRA))
    alone = np.setdiff1d(
        np.arange(len(at)), np.concatenate([common, impulses, [at["alpha"].start]])
    )
    # Of one drop alone: its own unknowns, and how far each impulse is off its mean.
    own = np.concatenate([alone, impulses])
    kept = np.concatenate([common, impulses, extra])
    scale = sd.copy()
    scale[impulses] = 1.0
    left = normal[np.ix_(own, own)] * np.outer(sd[own], sd[own]) + np.eye(own.size)
    cross = normal[np.ix_(own, kept)] * np.outer(sd[own], scale[kept])
    # Matrix and vector in one solution: the same factors serve both.
    gain = np.linalg.solve(left, np.column_stack([cross, vector[own] * sd[own]]))
    path = model.trajectory("impact", x)
    return QuadraticForm(
        run,
        record.chain.chain,
        record.ratios,
        here,
        normal[np.ix_(kept, kept)] * np.outer(scale[kept], scale[kept]) - cross.T @ gain[:, :-1],
        vector[kept] * scale[kept] - cross.T @ gain[:, -1],
        constant - float(vector[own] * sd[own] @ gain[:, -1]),
        alphas,
        path.speed[1:] / (1.0 + alphas * record.ratios),
        edges,
    )


def _normal(
    drop: Fit | JointDrop, alphas: Array, inflation: float
) -> tuple[Array, Array, float, int]:
    """‖r/σ‖² about a point, as in `QuadraticForm`, in the drop's unknowns and `EXTRA`, all in SI.

    The impulses stand for whole α, and the unknown α for nothing.
    """
    model, x = drop.model, drop.x
    at = model.unknowns
    size = len(at) + len(EXTRA)
    point = np.concatenate([x, np.zeros(len(EXTRA))])
    point[at["impulses"]], point[at["alpha"]] = alphas, 0.0
    # κ stands behind the rods here, free of what is known of it beforehand.
    point[-1], point[at["drag"]] = model.kappa(x), 0.0
    matrix, vector, constant, edges = np.zeros((size, size)), np.zeros(size), 0.0, 0
    for role, matches in drop.matches.items():
        rows = model.equations(role, x, matches)
        expected = model.expected[role]
        times = expected.times[expected.chosen(matches)[1]] * (1.0 + x[at["clock"]])
        extra = np.column_stack(_extra(model, role, model.trajectory(role, x), times))
        extra[1:] -= rows.told[1:, None] * extra[:-1]
        place = np.append(rows.columns, np.arange(len(at), size))
        slopes = np.column_stack([rows.slopes, extra])
        slopes[:, np.flatnonzero(rows.columns == at["drag"].start)] = 0.0
        sigma = rows.residuals.sigma * inflation
        weight = robust_weights(rows.residuals.values / sigma, STRAY) / sigma**2
        weighted = slopes * weight[:, None]
        left = rows.residuals.values - slopes @ point[place]
        matrix[np.ix_(place, place)] += slopes.T @ weighted
        vector[place] += weighted.T @ left
        constant += float(left @ (weight * left))
        edges += int((weight > 0.0).sum())
    return matrix, vector, constant, edges


def _extra(model: DropModel, role: str, path: Trajectory, times: Array) -> tuple[Array, Array]:
    """Derivatives of the height by that of the contact point and by κ, shape ``(times,)`` each."""
    slopes = path.derivatives(times)
    if role == "free":
        return np.zeros(times.size), slopes[:, DRAG]
    # A contact point higher up is met as if every rod hung that much lower.
    rods = len(model.records["impact"].chain.widths)
    return -slopes[:, COMMON + rods :].sum(axis=1), slopes[:, DRAG]


def merged(forms: Sequence[QuadraticForm]) -> list[QuadraticForm]:
    """Add up the forms of like drops: all that is wanted of them is the same function of them.

    Drops are alike where the same chain strikes at the same incline. The run kept is the first.
    """
    like: dict[tuple[object, ...], list[QuadraticForm]] = {}
    for one in forms:
        like.setdefault((one.run.incline_deg, one.run.impact, one.run.free), []).append(one)
    return [
        replace(
            group[0],
            matrix=sum((one.matrix for one in group[1:]), group[0].matrix),
            vector=sum((one.vector for one in group[1:]), group[0].vector),
            constant=sum(one.constant for one in group),
            alphas=np.mean([one.alphas for one in group], axis=0),
            arrivals=np.mean([one.arrivals for one in group], axis=0),
            edges=sum(one.edges for one in group),
        )
        for group in like.values()
    ]
