"""Results as plain data, and as the JSON that others rely on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from rig.analysis.distributions import coverage_factor

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from rig.analysis.edge_classes import UnmatchedEdge
    from rig.analysis.gate_passages import GatePassage
    from rig.protocol.protocol import Run
    from rig.units import Quantity

_ROUNDING = 1e-12
Verdict = Literal["accepted", "marginal", "void", "rejected"]
GOOD: tuple[Verdict, ...] = ("accepted", "marginal")
"""Verdicts that take part in a summary."""


@dataclass(frozen=True, slots=True)
class Measured:
    """A measured value.

    Attributes
    ----------
    value, u
        Best estimate and standard uncertainty.
    degrees
        Degrees of freedom of `u`.
    budget
        What each source adds to `u`; the squares add up to its square.
    shared
        What of `u` is common to all drops of a session, as a vector: those of two drops multiplied
        are their covariance. `None` for a drop by itself.
    stated
        By how much the value moves, with its sign, if what a protocol states of the drop, gravity
        or the air moves by its standard uncertainty: a prediction moves with the same.
    """

    value: float
    u: float
    degrees: float = math.inf
    budget: Mapping[str, float] = field(default_factory=dict)
    shared: NDArray[np.float64] | None = field(default=None, repr=False, compare=False)
    stated: Mapping[str, float] = field(default_factory=dict)

    @property
    def expanded(self) -> float:
        """Expanded uncertainty for 95 %."""
        # Effective degrees of freedom may come out below one, where t has no quantile of use.
        return coverage_factor(max(1.0, self.degrees)) * self.u

    def json(self) -> dict[str, float]:
        """``{"value", "u", "U95"}``."""
        return {"value": self.value, "u": self.u, "U95": self.expanded}


def normalized_error(
    measured: Measured, expected: Quantity, parts: Mapping[str, float] | None = None
) -> float | None:
    """E_n = (x − m)/√(U² + U_m² − 2 k k_m cov(x, m)); within ±1 they agree (ISO 13528).

    Parameters
    ----------
    measured, expected
        x with its coverage factor k, and m, whose uncertainty is taken as known exactly.
    parts
        By how much m moves with what the protocol states, as `Measured.stated` has it of x.

    Returns
    -------
    float or None
        `None` where neither has an uncertainty, or they share all of it.
    """
    k, k_model = coverage_factor(max(1.0, measured.degrees)), coverage_factor(math.inf)
    both = sum(part * measured.stated.get(name, 0.0) for name, part in (parts or {}).items())
    whole = measured.expanded**2 + (k_model * expected.u) ** 2
    square = whole - 2.0 * k * k_model * both
    if square <= _ROUNDING * whole:
        return None
    return (measured.value - expected.value) / math.sqrt(square)


@dataclass(frozen=True, slots=True)
class Audit:
    """What became of the edges of a drop.

    Attributes
    ----------
    received
        Edges in the record, of the gates in use.
    matched
        Of these, belonging to a rod.
    missed
        Expected edges that nobody reported.
    spurious
        Received edges that belong to no rod.
    lost
        Edges the device saw and could not keep.
    unexplained
        Of the spurious ones, those that are not of a known kind either.
    """

    received: int
    matched: int
    missed: int
    spurious: int
    lost: int
    unexplained: int = 0

    @property
    def expected(self) -> int:
        """Edges that a perfect rig would report."""
        return self.matched + self.missed

    def count(self, matched: int, unexplained: int) -> Audit:
        """Count again, with other edges that belong to a rod."""
        missed, spurious = self.expected - matched, self.received - matched
        return Audit(self.received, matched, missed, spurious, self.lost, unexplained)

    def json(self) -> dict[str, int]:
        """``edges`` of a run as `rig analyze --json` prints it."""
        names = ("received", "matched", "missed", "spurious", "lost")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True, slots=True)
class DropResult:
    """Everything that a drop says.

    Attributes
    ----------
    quantities
        By JSON name (``separation_m`` …), only those the scene has.
    matches
        For each matched edge (by its number in the drop) its rod, bottom rod 0.
    scatter
        How much more than assumed the edges scatter, at least 1; `None` when nothing was fitted.
    learned
        Whether the quantities are in the light of the whole session.
    unmatched
        Every edge that is missing or belongs to no rod, and why.
    limits
        The verdict that a rejected drop has by its limits.
    gates
        How one object passed each gate.
    last_passages
        Some of the quantities by themselves, see `rig.analysis.last_passages`.
    """

    run: Run
    attempt: int
    verdict: Verdict
    reasons: tuple[str, ...]
    audit: Audit
    quantities: Mapping[str, Measured] = field(default_factory=dict)
    matches: Mapping[int, int] = field(default_factory=dict)
    scatter: float | None = None
    learned: bool = False
    unmatched: tuple[UnmatchedEdge, ...] = ()
    limits: Verdict | None = None
    last_passages: Mapping[str, Measured] = field(default_factory=dict)
    gates: tuple[GatePassage, ...] = ()

    def json(self) -> dict[str, Any]:
        """One member of ``runs``."""
        found: dict[str, Any] = {
            "run": self.run.number,
            "attempt": self.attempt,
            "incline_deg": self.run.incline_deg,
            "impact_chain": self.run.impact,
        }
        found |= {name: value.json() for name, value in self.quantities.items()}
        if self.gates:
            found["gates"] = [one.json() for one in self.gates]
        found["edges"] = self.audit.json()
        if self.matches:
            found["causes"] = [edge.json() for edge in self.unmatched]
        found["unexplained_edges"] = self.audit.unexplained
        if self.scatter is not None:
            found["scatter"] = self.scatter
        if self.last_passages:
            found["last_passages"] = {n: one.json() for n, one in self.last_passages.items()}
        found["learned"] = self.learned
        found["verdict"] = self.verdict
        found["reasons"] = list(self.reasons)
        found["degrees"] = {
            name: value.degrees if math.isfinite(value.degrees) else None
            for name, value in self.quantities.items()
        }
        found["budget"] = [
            {"name": source, "quantity": name, "u": u}
            for name, value in self.quantities.items()
            for source, u in value.budget.items()
        ]
        return found
