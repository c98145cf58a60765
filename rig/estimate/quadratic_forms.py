"""What the edges of one drop say of its impacts, with everything else eliminated.

About the adjusted unknowns, ‖r/σ‖² of a drop is a quadratic form in all of them. Its release
times, hanging heights and the scatter of its single impulses belong to this drop alone and are
eliminated, priors included; what stays are the unknowns that all drops share,
the α of every rod, the height of the contact point and the air's drag. Every hypothesis about the
impacts is then a few small matrices away: no edge is looked at again, and none of what the edges
say is lost.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rig.analysis.equations import STRAY, robust_weights
from rig.analysis.fit import Fit
from rig.analysis.joint_step import JointDrop
from rig.analysis.square_root import EquationRows, eliminate
from rig.analysis.trajectory import COMMON, DRAG
from rig.analysis.unknowns import SharedUnknowns
from rig.arrays import Array, Index
from rig.model.chain import Chain
from rig.protocol.protocol import Run

EXTRA = ("contact", "drag")
"""Columns behind those of the rods: height of the contact point, m, and κ of the air, 1/m."""


class QuadraticForm(NamedTuple):
    """|R·z + r|², z being the shared unknowns of the drop, then its impacts.

    Attributes
    ----------
    run
        Which drop.
    chain, ratios
        What struck, and ΔV/V of each impact for α = 1, shape ``(rods,)``.
    here
        Places of the drop's shared unknowns in the session's vector.
    rows
        R and r, of n = shared + rods + `EXTRA` columns. Shared unknowns are in units of their prior
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
    rows: EquationRows
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
    alphas = x[at["alpha"]] + x[at["impulses"]]
    blocks, edges = _blocks(drop, alphas)
    sd = np.append(at.sd, np.ones(alphas.size + len(EXTRA)))
    # Of one drop alone: its own unknowns, and how far each impulse is off its mean.
    own = np.setdiff1d(np.arange(len(at)), np.append(common, at["alpha"].start))
    remaining = np.append(common, np.arange(len(at), sd.size))
    rest = eliminate(blocks, sd, np.zeros(sd.size), own, remaining).rest
    hits = model.trajectory("impact", x).hits
    assert hits is not None
    return QuadraticForm(
        run,
        record.chain.chain,
        record.ratios,
        here,
        rest._replace(columns=np.arange(remaining.size)),
        alphas,
        hits.arrival,
        edges,
    )


def _blocks(drop: Fit | JointDrop, alphas: Array) -> tuple[list[EquationRows], int]:
    """‖r/σ‖² in the drop's unknowns, the mean of each impulse, and `EXTRA`, all in SI.

    The impulses stand for whole α, and the unknown α for nothing; κ stands behind, free of what is
    known of it beforehand.
    """
    model, x = drop.model, drop.x
    at, means = model.unknowns, slice(x.size, x.size + alphas.size)
    point = np.concatenate([x, alphas, [0.0, model.kappa(x)]])
    point[at["impulses"]] = 0.0
    inflation = drop.estimate.scatter if isinstance(drop, Fit) else 1.0
    nothing = [at["alpha"].start, at["drag"].start]
    blocks, edges = [], 0
    for role, match in drop.matches.items():
        rows = model.equations(role, x, match)
        times = model.records[role].edges.times[match[match >= 0]] * (1.0 + x[at["clock"]])
        path = model.trajectory(role, x).sights(times)[2]
        # A contact point higher up is met as if every rod that strikes hung that much lower.
        lower = -path[:, COMMON + alphas.size :].sum(axis=1)
        extra = np.column_stack([lower, path[:, DRAG]])
        extra[1:] -= rows.told[1:, None] * extra[:-1]
        slopes = np.zeros((times.size, point.size))
        slopes[:, rows.columns], slopes[:, means.stop :] = rows.slopes, extra
        slopes[:, means], slopes[:, nothing] = slopes[:, at["impulses"]], 0.0
        sigma = rows.residuals.sigma * inflation
        weight = np.sqrt(robust_weights(rows.residuals.values / sigma, STRAY)) / sigma
        remainder = rows.residuals.values - slopes @ point
        columns = np.flatnonzero(slopes.any(axis=0))
        slopes = slopes[:, columns] * weight[:, None]
        blocks.append(EquationRows(slopes, remainder * weight, columns))
        edges += int((weight > 0.0).sum())
    return blocks, edges


def merge_like(forms: Sequence[QuadraticForm]) -> list[QuadraticForm]:
    """Add up the forms of like drops: all that is wanted of them is the same function of them.

    Drops are alike where the same chain strikes at the same incline. The run kept is the first.
    """
    groups: dict[Run, list[QuadraticForm]] = {}
    for form in forms:
        groups.setdefault(form.run.kind, []).append(form)
    return [
        group[0]._replace(
            rows=EquationRows(
                np.concatenate([form.rows.slopes for form in group]),
                np.concatenate([form.rows.left for form in group]),
                group[0].rows.columns,
            ).triangle(),
            alphas=np.mean([form.alphas for form in group], axis=0),
            arrivals=np.mean([form.arrivals for form in group], axis=0),
            edges=sum(form.edges for form in group),
        )
        for group in groups.values()
    ]
