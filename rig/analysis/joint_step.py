"""Gauss–Newton steps of a joint fit, with each drop's own unknowns eliminated.

Drops of a condition differ only in their edges, so that they are fitted as arrays.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.annealing import matched
from rig.analysis.chain_records import ChainRecord
from rig.analysis.components import Components
from rig.analysis.drop_model import DropModel
from rig.analysis.equations import STRAY, Seen, linearize, standardise
from rig.analysis.fit import DropFit, Matches, match, without_strays
from rig.analysis.square_root import (
    Elimination,
    EquationRows,
    Root,
    condense,
    eliminate,
    square_root,
)
from rig.analysis.unknowns import SharedUnknowns
from rig.arrays import Array, Index

_AT_ONCE = 1_000_000
"""Derivatives of edges in an array: 8 MB. More are no quicker."""


@dataclass(frozen=True, slots=True, eq=False)
class JointDrop(DropFit):
    """A drop of a joint fit.

    Attributes
    ----------
    own, common, here
        Places of its own and of the shared unknowns in the drop's vector, and of the latter in the
        session's vector.
    inverse, gain
        As in `rig.analysis.square_root.Elimination`.
    """

    own: Index
    common: Index
    here: Index
    inverse: Array
    gain: Array


@dataclass(frozen=True, slots=True, eq=False)
class DropGroup:
    """Drops of a joint fit that differ only in their edges.

    Attributes
    ----------
    places
        Places of the drops in the session.
    model
        Of all of them; its edges are those of any drop.
    records, matches
        Chains of each drop, and its matches, by role.
    edges
        Matched edges by role, shape ``(drops, expected)``; where none is matched, a time that is
        infinitely uncertain.
    x
        Unknowns, shape ``(drops, unknowns)``.
    own, common, here
        As in `JointDrop`.
    """

    places: Sequence[int]
    model: DropModel
    records: Sequence[Mapping[str, ChainRecord]]
    matches: Sequence[Matches]
    edges: Mapping[str, Seen]
    x: Array
    own: Index
    common: Index
    here: Index

    def at(self, shared: Array) -> DropGroup:
        """Return the drops with other values of the session's shared unknowns."""
        x = self.x.copy()
        x[:, self.common] = shared[self.here]
        return replace(self, x=x)

    def move(self, reduced: Elimination, shared: Array, step: Array, share: float) -> DropGroup:
        """Return the drops after a share of a step to `shared`, in units of prior uncertainties."""
        moved, at = self.at(shared), self.own
        own = reduced.own - reduced.gain @ step[self.here]
        moved.x[:, at] += share * self.model.unknowns.sd[at] * own
        return moved

    def rematch(self) -> DropGroup:
        """Return the drops with their edges matched anew."""
        models = [self.model.with_edges(records) for records in self.records]
        matches = [match(model, x) for model, x in zip(models, self.x, strict=True)]
        return replace(self, matches=matches, edges=_edges(models, matches, self.x))

    def split(self, reduced: Elimination) -> Iterator[tuple[int, JointDrop]]:
        """Yield each drop with its place, its own unknowns eliminated, and without strays."""
        places = self.own, self.common, self.here
        drops = zip(self.places, self.records, self.matches, self.x, *reduced[:2], strict=True)
        for n, records, matches, x, inverse, gain in drops:
            kept = without_strays(self.model.with_edges(records), x, matches)
            # The model anew: what it prepared of its edges takes more memory than all else.
            model = self.model.with_edges(records)
            yield n, JointDrop(model, kept, x, *places, inverse, gain)


def group_drops(fits: Sequence[DropFit], shared: SharedUnknowns) -> list[DropGroup]:
    """Return drops that were fitted by themselves, or in an earlier joint fit, as groups."""
    # A rig has a single clock: its error is shared, with the largest calibration uncertainty.
    clock_u: dict[str | None, float] = {}
    alike: dict[object, list[int]] = {}
    for n, model in enumerate(fit.model for fit in fits):
        rig, owners = model.owners.get("rig"), tuple(sorted(model.owners.items()))
        clock_u[rig] = max(model.clock_u, clock_u.get(rig, 0.0))
        alike.setdefault((model.condition, owners), []).append(n)
    groups = []
    for numbers in alike.values():
        first = fits[numbers[0]].model
        common, here = shared.places(first)
        own = np.setdiff1d(np.arange(len(first.unknowns)), common)
        model = first.copy_with(clock_u=clock_u[first.owners.get("rig")])
        count = max(1, _AT_ONCE // sum(side.sights.size for side in model.slopes.values()))
        for places in (numbers[n : n + count] for n in range(0, len(numbers), count)):
            drops = [fits[n] for n in places]
            x = np.array([drop.x for drop in drops])
            records = [drop.model.records for drop in drops]
            matches = [drop.matches for drop in drops]
            edges = _edges([model.with_edges(each) for each in records], matches, x)
            about = places, model, records, matches
            groups.append(DropGroup(*about, edges, x, own, common, here))
    return groups


def with_priors(groups: Sequence[DropGroup], components: Components) -> list[DropGroup]:
    """Return drops with other priors; those of impulses are relative to a condition's mean α."""
    alphas: dict[object, list[Array]] = {}
    for group in groups:
        if "impact" in group.model.records:
            alphas.setdefault(group.model.condition, []).append(group.model.alphas(group.x))
    changed = []
    for group in groups:
        of_condition = alphas.get(group.model.condition)
        alpha = float(np.concatenate(of_condition).mean()) if of_condition else 0.0
        changed.append(
            replace(group, model=group.model.copy_with(components=components, alpha=alpha))
        )
    return changed


def _edges(models: Sequence[DropModel], matches: Sequence[Matches], x: Array) -> dict[str, Seen]:
    edges, at = {}, models[0].unknowns
    for role, expected in models[0].expected.items():
        times = np.empty((len(models), expected.rods.size))
        burst = np.full(times.shape, np.inf)
        # Any moment after the release: at rest, a chain has no uncertainty.
        fallen = x[:, at[f"{role} release"]] + 1.0
        for n, model in enumerate(models):
            pairing = model.pairings[role]
            pick, edge = matched(matches[n][role])
            times[n] = pairing.times[edge].max() if edge.size else fallen[n]
            times[n, pick], burst[n, pick] = pairing.times[edge], pairing.burst[edge]
        edges[role] = expected.seen(np.arange(expected.rods.size), times, burst)
    return edges


def joint_step(
    groups: Sequence[DropGroup], x: Array, cut: float = STRAY
) -> tuple[Array, Root, list[Elimination]]:
    """Eliminate the drops' own unknowns, and return the information on the shared ones.

    Parameters
    ----------
    x
        Shared unknowns.
    cut
        As for `rig.analysis.equations.linearize`.

    Returns
    -------
    sd, root, reduced
        Prior uncertainties of the shared unknowns; the information on these, in units of `sd`; and
        each group with its own unknowns eliminated.
    """
    sd, rows, reduced = np.zeros(x.size), list[EquationRows](), []
    for group in groups:
        at = group.model.unknowns
        sd[group.here] = at.sd[group.common]
        blocks = [*linearize(group.model, group.edges, group.x, cut=cut).rows.values()]
        part = eliminate(blocks, at.sd, at.pull(group.x), group.own, group.common)
        slopes = part.rest.slopes.reshape(-1, group.here.size)
        rows = condense([*rows, EquationRows(slopes, part.rest.left.ravel(), group.here)], x.size)
        used = part.rest._replace(slopes=slopes[:0].copy(), left=slopes[:0, 0].copy())
        reduced.append(part._replace(rest=used))  # without what is in `rows`
    return sd, square_root(rows, np.ones(x.size), standardise(x, sd)), reduced
