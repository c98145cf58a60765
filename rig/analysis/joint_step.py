"""Gauss–Newton steps of a joint fit, with each drop's own unknowns eliminated.

Drops of a condition differ only in their edges, so that they are fitted as arrays.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from rig.analysis.adjust import Estimate
from rig.analysis.annealing import matched
from rig.analysis.components import Components
from rig.analysis.drop_model import DropModel
from rig.analysis.equations import STRAY, Seen, linearize, standardise
from rig.analysis.fit import DropFit, Matches, without_strays
from rig.analysis.square_root import (
    Elimination,
    EquationRows,
    Root,
    condense,
    eliminate,
    square_root,
)
from rig.analysis.unknowns import SharedUnknowns, Unknown
from rig.arrays import Array, Index

_NONE = np.zeros(0)
_AT_ONCE = 1_000_000
"""Derivatives of edges in an array: 8 MB. More are no quicker."""


class Places(NamedTuple):
    """Places of a drop's unknowns.

    Attributes
    ----------
    own, common, here
        Of its own and of the shared unknowns in its vector, and of the latter in the session's.
    """

    own: Index
    common: Index
    here: Index


@dataclass(frozen=True, slots=True, eq=False)
class JointDrop(DropFit):
    """A drop of a joint fit.

    Attributes
    ----------
    places
        Places of its unknowns.
    fitted
        Matches of the fit: `matches` and strays.
    estimate
        Result of its own fit, if it shares nothing with others.
    """

    places: Places
    fitted: Matches
    estimate: Estimate | None = None

    def solve(self) -> tuple[Array, Array]:
        """Return R⁻¹ and gain of its own unknowns, as in `rig.analysis.square_root.Elimination`."""
        if self.estimate is not None:
            return self.estimate.inverse, np.zeros((self.x.size, 0))
        return _solve(self)


@lru_cache(maxsize=1)  # those of all drops would take most of the memory
def _solve(drop: JointDrop) -> tuple[Array, Array]:
    # What a model prepares of its edges goes with the copy.
    model = drop.model.with_edges(drop.model.records)
    return _eliminate(model, drop.fitted, drop.x, drop.places)[:2]


def _eliminate(
    model: DropModel, edges: Matches | Mapping[str, Seen], x: Array, at: Places, cut: float = STRAY
) -> Elimination:
    """Eliminate the own unknowns of a drop, or of many."""
    rows = [*linearize(model, edges, x, cut=cut).rows.values()]
    return eliminate(rows, model.unknowns.sd, model.unknowns.pull(x), at.own, at.common)


class DropGroup(NamedTuple):
    """Drops of a joint fit that differ only in their edges.

    Attributes
    ----------
    numbers
        Numbers of the drops in the session.
    model
        Of all of them; its edges are those of any drop.
    drops
        Each drop with its matches.
    edges
        Matched edges by role, shape ``(drops, expected)``; where none is matched, a time that is
        infinitely uncertain.
    x
        Unknowns, shape ``(drops, unknowns)``.
    places
        Places of the unknowns.
    best, gain
        Least-squares step of the drops' own unknowns, in units of their prior uncertainties, and
        its derivatives by the shared ones, with half of the digits: they take most of the memory.
    variances, blocks
        Variances of their own unknowns, given the shared ones, in units of the prior variances; and
        the covariance of each block with a variance component. Shape ``(drops, own)``, and
        ``(drops, members, members)``.
    """

    numbers: Sequence[int]
    model: DropModel
    drops: Sequence[DropFit]
    edges: Mapping[str, Seen]
    x: Array
    places: Places
    best: Array = _NONE
    gain: Array = _NONE
    variances: Array = _NONE
    blocks: Mapping[str, Array] = MappingProxyType({})

    def at(self, shared: Array) -> DropGroup:
        """Return the drops with other values of the session's shared unknowns."""
        x = self.x.copy()
        x[:, self.places.common] = shared[self.places.here]
        return self._replace(x=x)

    def move(self, shared: Array, step: Array, share: float) -> DropGroup:
        """Return the drops after a share of a step to `shared`, in units of prior uncertainties."""
        moved, own = self.at(shared), self.places.own
        best = self.best - self.gain @ step[self.places.here]
        moved.x[:, own] += share * self.model.unknowns.sd[own] * best
        return moved

    def reduce(self, cut: float) -> tuple[DropGroup, EquationRows]:
        """Eliminate the drops' own unknowns; return the drops, and what is left of the equations.

        Parameters
        ----------
        cut
            As for `rig.analysis.equations.linearize`.
        """
        here, blocks = self.places.here, {}
        inverse, gain, best, rest = _eliminate(self.model, self.edges, self.x, self.places, cut)
        for name, row, inside in self._own_blocks():
            if row.scale:
                blocks[name] = inverse[:, inside] @ np.swapaxes(inverse[:, inside], 1, 2)
        rows = EquationRows(rest.slopes.reshape(-1, here.size), rest.left.ravel(), here)
        variances, gain = np.sum(inverse**2, axis=-1), gain.astype(np.float32)
        return self._replace(best=best, gain=gain, variances=variances, blocks=blocks), rows

    def told(self, inverse: Array) -> tuple[Array, dict[str, Array]]:
        """Return `variances` and `blocks` with shares of the shared unknowns, of R⁻¹ `inverse`."""
        root, blocks = self.gain @ inverse[self.places.here], dict(self.blocks)
        for name, _, inside in self._own_blocks():
            if name in blocks:
                blocks[name] = blocks[name] + root[:, inside] @ np.swapaxes(root[:, inside], 1, 2)
        return self.variances + np.sum(root**2, axis=-1), blocks

    def _own_blocks(self) -> Iterator[tuple[str, Unknown, slice]]:
        """Yield the name, row, and places among the own unknowns of each of their blocks."""
        end, at = 0, self.model.unknowns
        for name, row in at.rows.items():
            if row.shared == "drop":
                begin, end = end, end + at[name].stop - at[name].start
                yield name, row, slice(begin, end)

    def add_gains(self, gains: Mapping[str, Array]) -> None:
        """Add the sum of GᵀG over the drops' own unknowns to that of each line of the budget."""
        here = self.places.here
        for _, row, inside in self._own_blocks():
            flat = self.gain[:, inside].reshape(-1, here.size).astype(np.float64)
            gains[row.line][np.ix_(here, here)] += flat.T @ flat

    def split(self) -> Iterator[tuple[int, JointDrop]]:
        """Yield each drop with its number, without strays."""
        for n, drop, x in zip(self.numbers, self.drops, self.x, strict=True):
            records = drop.model.records
            kept = without_strays(self.model.with_edges(records), x, drop.matches)
            # The model anew: what it prepared of its edges takes more memory than all else.
            model = self.model.with_edges(records)
            yield n, JointDrop(model, kept, x, self.places, drop.matches)


def group_drops(fits: Sequence[DropFit]) -> tuple[SharedUnknowns, list[DropGroup]]:
    """Group drops that were fitted by themselves or jointly, and return what all share."""
    # A rig has a single clock: its error is shared, with the largest calibration uncertainty.
    clock_u: dict[str | None, float] = {}
    alike: dict[object, list[int]] = {}
    for n, model in enumerate(fit.model for fit in fits):
        rig, owners = model.owners.get("rig"), tuple(sorted(model.owners.items()))
        clock_u[rig] = max(model.clock_u, clock_u.get(rig, 0.0))
        alike.setdefault((model.condition, owners), []).append(n)
    firsts = [fits[numbers[0]].model for numbers in alike.values()]
    shared, groups = SharedUnknowns(firsts), []
    for first, numbers in zip(firsts, alike.values(), strict=True):
        common, here = shared.places(first)
        places = Places(np.setdiff1d(np.arange(len(first.unknowns)), common), common, here)
        model = first.copy_with(clock_u=clock_u[first.owners.get("rig")])
        count = max(1, _AT_ONCE // sum(side.sights.size for side in model.slopes.values()))
        for begin in range(0, len(numbers), count):
            some = numbers[begin : begin + count]
            drops = [fits[n] for n in some]
            x = np.array([drop.x for drop in drops])
            groups.append(DropGroup(some, model, drops, _edges(model, drops), x, places))
    return shared, groups


def with_priors(groups: Sequence[DropGroup], components: Components) -> list[DropGroup]:
    """Return drops with other priors; those of impulses are relative to a condition's mean α."""
    alphas = defaultdict[object, list[Array]](list)
    for group in groups:
        if "impact" in group.model.records:
            alphas[group.model.condition].append(group.x[:, group.model.unknowns["alpha"]])
    mean = {condition: float(np.concatenate(each).mean()) for condition, each in alphas.items()}
    models = [
        group.model.copy_with(components=components, alpha=mean.get(group.model.condition, 0.0))
        for group in groups
    ]
    return [group._replace(model=model) for group, model in zip(groups, models, strict=True)]


def _edges(model: DropModel, drops: Sequence[DropFit]) -> dict[str, Seen]:
    edges = {}
    for role, expected in model.expected.items():
        times = np.empty((len(drops), expected.rods.size))
        burst = np.full(times.shape, np.inf)
        for n, drop in enumerate(drops):
            record, (pick, edge) = drop.model.records[role].edges, matched(drop.matches[role])
            # Any moment after the release: at rest, a chain has no uncertainty.
            fallen = drop.x[model.unknowns[f"{role} release"]] + 1.0
            times[n] = record.times[edge].max() if edge.size else fallen
            times[n, pick], burst[n, pick] = record.times[edge], record.burst[edge]
        edges[role] = expected.seen(np.arange(expected.rods.size), times, burst)
    return edges


def joint_step(
    groups: Sequence[DropGroup], x: Array, cut: float = STRAY
) -> tuple[Array, Root, list[DropGroup]]:
    """Eliminate the drops' own unknowns.

    Parameters
    ----------
    x
        Shared unknowns.
    cut
        As for `rig.analysis.equations.linearize`.

    Returns
    -------
    sd, root, groups
        Prior uncertainties of the shared unknowns; the information on these, in units of `sd`; and
        the drops, with the step of their own unknowns.
    """
    sd, rows, reduced = np.zeros(x.size), list[EquationRows](), []
    for group in groups:
        sd[group.places.here] = group.model.unknowns.sd[group.places.common]
        part, rest = group.reduce(cut)
        rows = condense([*rows, rest], x.size)
        reduced.append(part)
    root = square_root(rows, np.ones(x.size), standardise(x, sd))
    return sd, root, reduced
