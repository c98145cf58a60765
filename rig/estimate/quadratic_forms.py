"""What the edges of one drop say of its impacts, with everything else eliminated.

About the adjusted unknowns, ‖r/σ‖² of a drop is a quadratic form in all of them. Its release
times, hanging heights and the scatter of its single impulses belong to this drop alone and are
eliminated, priors included; what stays are the unknowns that all drops share,
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
from rig.analysis.square_root import EquationRows, eliminate
from rig.analysis.trajectory import COMMON, DRAG, Trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.drop_model import DropModel
    from rig.analysis.joint_step import JointDrop
    from rig.analysis.unknowns import SharedUnknowns
    from rig.arrays import Array, Index
    from rig.model.chain import Chain
    from rig.protocol.protocol import Run


EXTRA = ("contact", "drag")
"""Columns behind those of the rods: height of the contact point, m, and κ of the air, 1/m."""


@dataclass(frozen=True, slots=True)
class QuadraticForm:
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
    alphas = model.guesses["impact"].alpha + x[at["alpha"]] + x[at["impulses"]]
    inflation = drop.estimate.scatter if isinstance(drop, Fit) else 1.0
    blocks, edges = _blocks(drop, alphas, inflation)
    size, rods = len(at) + len(EXTRA), alphas.size
    impulses = np.arange(at["impulses"].start, at["impulses"].stop)
    eliminated = np.concatenate([common, impulses, [at["alpha"].start]])
    # Of one drop alone: its own unknowns, and how far each impulse is off its mean.
    own = np.append(np.setdiff1d(np.arange(len(at)), eliminated), impulses)
    remaining = np.concatenate([common, size + np.arange(rods), np.arange(len(at), size)])
    sd = np.append(at.sd, np.ones(len(EXTRA) + rods))
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


def _blocks(
    drop: Fit | JointDrop, alphas: Array, inflation: float
) -> tuple[list[EquationRows], int]:
    """‖r/σ‖² in the drop's unknowns, `EXTRA`, and the mean of each impulse, all in SI.

    The impulses stand for whole α, and the unknown α for nothing; κ stands behind, free of what is
    known of it beforehand.
    """
    model, x = drop.model, drop.x
    at = model.unknowns
    size, rods = len(at) + len(EXTRA), alphas.size
    point = np.concatenate([x, np.zeros(len(EXTRA)), alphas])
    point[at["impulses"]] = 0.0
    point[size - 1] = model.kappa(x) if "drag" in at else 0.0
    nothing = [at[name].start for name in ("alpha", "drag") if name in at]
    blocks, edges = [], 0
    for role, matches in drop.matches.items():
        rows = model.equations(role, x, matches)
        pairing = model.pairings[role]
        times = pairing.times[pairing.observed(matches)[1]] * (1.0 + x[at["clock"]])
        extra = np.column_stack(_extra(model, role, model.trajectory(role, x), times))
        extra[1:] -= rows.told[1:, None] * extra[:-1]
        stays = ~np.isin(rows.columns, nothing)
        struck = rows.columns - at["impulses"].start
        means = np.flatnonzero((struck >= 0) & (struck < rods))
        slopes = np.column_stack([rows.slopes[:, stays], extra, rows.slopes[:, means]])
        place = [rows.columns[stays], np.arange(len(at), size), size + struck[means]]
        columns = np.concatenate(place)
        sigma = rows.residuals.sigma * inflation
        weight = np.sqrt(robust_weights(rows.residuals.values / sigma, STRAY)) / sigma
        remainder = rows.residuals.values - slopes @ point[columns]
        blocks.append(EquationRows(slopes * weight[:, None], remainder * weight, columns))
        edges += int((weight > 0.0).sum())
    return blocks, edges


def _extra(model: DropModel, role: str, path: Trajectory, times: Array) -> tuple[Array, Array]:
    """Derivatives of the height by that of the contact point and by κ, shape ``(times,)`` each."""
    slopes = path.derivatives(times)
    if role == "free":
        return np.zeros(times.size), slopes[:, DRAG]
    # A contact point higher up is met as if every rod hung that much lower.
    rods = len(model.records["impact"].chain.widths)
    return -slopes[:, COMMON + rods :].sum(axis=1), slopes[:, DRAG]


def merge_like(forms: Sequence[QuadraticForm]) -> list[QuadraticForm]:
    """Add up the forms of like drops: all that is wanted of them is the same function of them.

    Drops are alike where the same chain strikes at the same incline. The run kept is the first.
    """
    groups: dict[tuple[object, ...], list[QuadraticForm]] = {}
    for form in forms:
        groups.setdefault((form.run.incline_deg, form.run.impact, form.run.free), []).append(form)
    return [
        replace(
            group[0],
            rows=group[0]
            .rows._replace(
                slopes=np.concatenate([form.rows.slopes for form in group]),
                left=np.concatenate([form.rows.left for form in group]),
            )
            .triangle(),
            alphas=np.mean([form.alphas for form in group], axis=0),
            arrivals=np.mean([form.arrivals for form in group], axis=0),
            edges=sum(form.edges for form in group),
        )
        for group in groups.values()
    ]
