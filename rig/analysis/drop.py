"""One drop, from its edges to its results."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.adjust import Estimate, adjust
from rig.analysis.align import align
from rig.analysis.drop_model import DropModel
from rig.analysis.pattern import guess
from rig.analysis.quantities import quantities
from rig.analysis.result import Audit, DropResult
from rig.analysis.trains import Edges, Side, train
from rig.analysis.verdict import judge
from rig.model.fall import kicks
from rig.model.rods import rod_impacts

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.pattern import Guess
    from rig.model.chain import Chain
    from rig.protocol.scene import Protocol, Run
    from rig.records import Drop

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]
    Matches = dict[str, list[Index]]

_COARSE = 2.5e-3  # m: how far off a first guess may put a rod
_FINE = 0.5e-3  # m: how far off an adjusted trajectory may
_STRAY = 6.0  # standard deviations: no rod is that far off after everything was adjusted
_ROUNDS = 6


class TimeScale(NamedTuple):
    """Seconds from ticks: the rate in Hz and its relative standard uncertainty."""

    hz: float
    u: float


def analyze_drop(protocol: Protocol, run: Run, drop: Drop, scale: TimeScale) -> DropResult:
    """Find out what a drop says.

    Parameters
    ----------
    protocol
        The scene; it must have gates.
    run
        The planned run that the drop was.
    drop
        The raw record.
    scale
        Calibration of its ticks.
    """
    sides = _sides(protocol, run, drop, scale)
    received = sum(part.times.size for side in sides for part in side.trains)
    expected = sum(side.expected for side in sides)
    lost = 0
    if drop.certificate is not None:
        lost = drop.certificate.overflows
    guesses = _guesses(protocol, sides)
    blank = Audit(received, 0, expected, received, lost)
    early = judge(protocol, drop, guesses, blank, {}, None)
    if early.verdict == "void":
        return DropResult(run, drop.attempt, early.verdict, early.reasons, blank)
    model = DropModel(protocol, sides, guesses, scale.u)
    matches, estimate = _settle(model)
    matched = sum(int((match >= 0).sum()) for side in matches.values() for match in side)
    audit = Audit(received, matched, expected - matched, received - matched, lost)
    found = quantities(model, estimate)
    end = judge(protocol, drop, guesses, audit, found, estimate)
    return DropResult(
        run,
        drop.attempt,
        end.verdict,
        end.reasons,
        audit,
        found,
        _assignments(model, matches),
        estimate.scatter,
    )


def _sides(protocol: Protocol, run: Run, drop: Drop, scale: TimeScale) -> list[Side]:
    """Collect each chain with the trains of its gates."""
    assert protocol.gates is not None
    edges = Edges.of(drop, scale.hz)
    start = protocol.drop.value
    sides = []
    for role in ("impact", "free"):
        name = run.impact if role == "impact" else run.free
        gates = [(n, gate) for n, gate in enumerate(protocol.gates.gates) if gate.side == role]
        if name is None or not gates:
            continue
        chain = protocol.chains[name]
        trains = [train(n, g, chain, edges, start, role == "impact") for n, g in gates]
        ratios = _ratios(protocol, chain.chain) if role == "impact" else None
        sides.append(Side(role, chain, tuple(trains), ratios))
    return sides


def _guesses(protocol: Protocol, sides: Sequence[Side]) -> dict[str, Guess]:
    """Guess each side's fall."""
    gravity = protocol.gravity.value
    return {side.role: guess(side, protocol.drop, gravity) for side in sides}


def _ratios(protocol: Protocol, chain: Chain) -> Array:
    """ΔV/V of each impact for α = 1, Eq. 9."""
    assert protocol.surface is not None
    # γ is the same at every incline, and level ground is always inside the domain of Eq. 13.
    gammas = [impact.gamma for impact in rod_impacts(protocol.surface, chain, 0.0)]
    return np.array(kicks(chain, [1.0] * chain.rods, gammas))


def _settle(model: DropModel) -> tuple[Matches, Estimate]:
    """Match and adjust in turn until the matching stays."""
    x = model.first()
    estimate: Estimate | None = None
    before: Matches = {}
    for round_ in range(_ROUNDS):
        width = _COARSE if round_ == 0 else _FINE
        clock = float(x[model.unknowns["clock"]][0])
        matches: Matches = {
            role: align(side.trains, model.levels(role, x), model.trajectory(role, x), width, clock)
            for role, side in model.sides.items()
        }
        if estimate is not None and _same(matches, before):
            break
        estimate = adjust(model, matches, x)
        x, before = estimate.x, matches
    assert estimate is not None
    struck = {role: _without_strays(model, role, x, before[role], estimate) for role in before}
    if _same(struck, before):
        return before, estimate
    return struck, adjust(model, struck, x)


def _without_strays(
    model: DropModel, role: str, x: Array, matches: Sequence[Index], estimate: Estimate
) -> list[Index]:
    """Take back matches far off the adjusted motion: a bounce where a rod's edge was missed."""
    rows = model.equations(role, x, matches)
    stray = np.abs(rows.residuals) > _STRAY * rows.sigma * estimate.scatter
    kept, position = [], 0
    for match in matches:
        copy = match.copy()
        chosen = np.flatnonzero(match >= 0)
        copy[chosen[stray[position : position + chosen.size]]] = -1
        position += chosen.size
        kept.append(copy)
    return kept


def _same(one: Matches, other: Matches) -> bool:
    return all(
        np.array_equal(a, b)
        for role in one
        for a, b in zip(one[role], other.get(role, []), strict=True)
    )


def _assignments(model: DropModel, matches: Matches) -> Mapping[int, int]:
    """Rod of every matched edge of the drop."""
    return {
        int(part.edge[edge]): int(rod)
        for role, side in model.sides.items()
        for part, match in zip(side.trains, matches[role], strict=True)
        for edge, rod in zip(match, part.rods, strict=True)
        if edge >= 0
    }
