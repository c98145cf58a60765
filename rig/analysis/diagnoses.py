"""Counts of a drop's passages by gate and by rod, and what disagrees with the protocol.

A gate that disagrees is reported, never fitted away. `rig.analysis.explanations` compares the
possible causes.
"""

from collections.abc import Collection, Iterable, Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from rig.analysis.annealing import LEAST
from rig.analysis.chain_records import MISSED, SIDES, ChainRecord
from rig.analysis.distributions import most_by_chance
from rig.analysis.equations import STRAY, standardise
from rig.analysis.faults import Suspects, gate_values
from rig.analysis.fit import Fit, Matches
from rig.arrays import Array, Flags, Index
from rig.protocol.protocol import Protocol
from rig.reasons import Reason, make_reason

_PAIRED = 8
"""Gates of which any two are tried as exchanged; half of it in a drop that is identified."""


class GateCount(NamedTuple):
    """Edges of a gate.

    Attributes
    ----------
    role, gate
        Side, and number in the protocol's list.
    rods, seen
        Rod of each expected edge, and whether that is matched.
    came, after
        Number of observed edges, and of those after the last matched one.
    blame
        `rig.analysis.chain_records.DueEdges.blame` of each expected edge.
    """

    role: str
    gate: int
    rods: Index
    seen: Flags
    came: int
    after: int
    blame: Array

    @property
    def missing(self) -> int:
        """Number of expected edges that are not matched."""
        return int(np.count_nonzero(~self.seen))

    @property
    def share(self) -> float:
        """Matched share of its expected edges."""
        return float(np.sum(self.blame[self.seen]) / np.sum(self.blame))

    @property
    def surplus(self) -> int:
        """Number of observed edges that belong to no rod."""
        return self.came - self.seen.size + self.missing

    @property
    def due(self) -> int:
        """Number of rods that should pass."""
        return np.unique(self.rods).size

    @property
    def hidden(self) -> int:
        """Number of rods with a missing edge."""
        return np.unique(self.rods[~self.seen]).size

    @property
    def lacks_end(self) -> bool:
        """Whether it did not see the first or the last rod; by chance, it may be any."""
        return not np.isin(self.rods[[0, -1]], self.rods[self.seen]).all()


def gate_counts(records: Iterable[ChainRecord], matches: Matches | None = None) -> list[GateCount]:
    """Return the counts of all gates with edges that are expected, and observed.

    Without matches, the first expected edges count as matched, as many as were observed.
    """
    counts = []
    for record in records:
        due, edges, blame = record.due, record.edges, record.due.blame
        for gate in sorted({*due.gate.tolist()} & {*edges.gate.tolist()}):
            here, came = np.flatnonzero(due.gate == gate), np.flatnonzero(edges.gate == gate)
            first = np.append(came, np.full(here.size, -1))[: here.size]
            match = first if matches is None else matches[record.role][here]
            after = int(np.count_nonzero(came > match.max()))
            rods, seen = due.rods[here], match >= 0
            counts.append(GateCount(record.role, gate, rods, seen, came.size, after, blame[here]))
    return counts


def silent(protocol: Protocol, records: Collection[ChainRecord]) -> Iterator[Reason]:
    """Yield reasons for gates without edges while the others have theirs."""
    heard = gate_counts(records)
    if sum(gate.missing for gate in heard) >= (1.0 - LEAST) * sum(gate.seen.size for gate in heard):
        return
    for record in records:
        due = sorted({*record.due.gate.tolist()})
        dead = [gate for gate in due if gate not in record.edges.gate]
        if len(dead) == len(due) > 1:
            yield make_reason("side_silent", protocol.vocabulary, side=record.role)
        else:
            for gate in dead:
                yield make_reason("gate_silent", protocol.vocabulary, **_values(protocol, gate))


def gate_reasons(fit: Fit) -> Iterator[Reason]:
    """Yield reasons about gates that do not match the chains of the protocol."""
    protocol, records = fit.model.protocol, fit.model.records.values()
    words, beams, estimate = protocol.vocabulary, fit.model.unknowns["beams"], fit.estimate
    off = np.abs(standardise(estimate.x[beams], estimate.sd[beams]))
    for gate in gate_counts(records, fit.matches):
        where, deviations = _values(protocol, gate.gate), float(off[gate.gate])
        if gate.share < LEAST:
            # A gate with few expected edges may miss a rod by chance, without effect on the result.
            code = "gate_disagrees" if gate.seen.size >= 2 * SIDES else "gate_disagrees_few"
            yield make_reason(code, words, **where, share=gate.share)
        elif deviations > STRAY:
            # With equal, evenly spaced rods an exchanged gate fits well at a wrong height.
            yield make_reason("gate_off", words, **where, deviations=deviations)
    yield from silent(protocol, records)
    if aside := [_values(protocol, gate) for record in records for gate in record.aside]:
        yield make_reason("low_gates_miss_rods", words, at=aside)


def suspects(records: Collection[ChainRecord], matches: Matches | None = None) -> Suspects:
    """Return the gates that match worst, and the rods that no gate of their chain saw.

    Without matches, only numbers of edges are compared, which tell less.
    """
    counts = gate_counts(records, matches)
    worst = sorted(counts, key=lambda gate: -gate.missing - gate.surplus)
    worst = worst[: _PAIRED // 2 if matches else _PAIRED]
    crowded = [gate for gate in counts if gate.surplus >= SIDES]
    lacking = [gate for gate in counts if gate.lacks_end]
    absent, more = {}, any(_are_crossed(*pair) for pair in product(lacking, crowded))
    more |= sum(gate.lacks_end for gate in crowded) > 1
    for record in records:
        gates = [gate for gate in counts if gate.role == record.role]
        if matches and gates:
            due, match = record.due.rods, matches[record.role]
            absent[record.chain.name] = np.setdiff1d(due, due[match >= 0]).tolist()
            more |= min(gate.after for gate in gates) >= SIDES
    return Suspects([gate.gate for gate in worst], absent, more)


def _are_crossed(one: GateCount, other: GateCount) -> bool:
    """Whether the numbers of edges of two gates rather match each other's expectation."""
    came, due = (one.came, other.came), (one.seen.size, other.seen.size)
    own = abs(came[0] - due[0]) + abs(came[1] - due[1])
    return own - abs(came[0] - due[1]) - abs(came[1] - due[0]) >= 2 * SIDES


def _values(protocol: Protocol, gate: int) -> dict[str, Any]:
    return gate_values(protocol.gates.gates[gate])


def gates_too_low(
    protocol: Protocol, records: Iterable[ChainRecord], fit: Fit | None
) -> tuple[int, ...]:
    """Return the lowest gates beside the striking chain that miss more rods than by chance.

    There, rods strike before they pass, or lie in the beam. The highest gate is never left out. The
    rate of chance misses is that of all other gates.

    Parameters
    ----------
    records
        The chains with their edges.
    fit
        `None` if the drop is not identified: then the number of edges is used.

    Returns
    -------
    tuple of int
        Numbers of the gates in the protocol's list.
    """
    counts = gate_counts(records, fit.matches if fit else None)
    due, hidden = sum(gate.due for gate in counts), sum(gate.hidden for gate in counts)
    struck, gates = [gate for gate in counts if gate.role == "impact"], protocol.gates.gates
    low: list[int] = []
    for gate in sorted(struck, key=lambda gate: gates[gate.gate].height)[:-1]:
        due, hidden = due - gate.due, hidden - gate.hidden
        missed = MISSED * gate.seen.size / gate.due  # each edge of a rod may be missed
        if gate.hidden <= most_by_chance(gate.due, max(missed, hidden / due)):
            break
        low.append(gate.gate)
    return tuple(low)
