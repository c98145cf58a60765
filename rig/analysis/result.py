"""Results as plain data, and as the JSON that others rely on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from rig.analysis.distributions import coverage_factor
from rig.analysis.plain_data import attributes, plain
from rig.errors import InputError
from rig.reasons import make_error, reasons_json

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from rig.analysis.edge_classes import UnmatchedEdge
    from rig.analysis.gate_passages import GatePassage
    from rig.protocol.protocol import Run
    from rig.reasons import Reason

Verdict = Literal["accepted", "marginal", "void", "rejected"]
GOOD: tuple[Verdict, ...] = ("accepted", "marginal")
"""Verdicts that take part in a summary."""

COUNTS = ("received", "matched", "missed", "spurious", "lost")
"""Of edges, in the order in which tables have them."""


def optional_package(name: str) -> Any:
    """Import a package of the extra ``notebook``.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise make_error(InputError, "package_absent", package=name) from error


class Deviation(NamedTuple):
    """Variance of a drop's result less its prediction if the model holds, coefficients aside.

    A fall's own impulses, this rig's own rods and the errors of measuring are in it; what measuring
    leaves to be as stated is in neither. Covariances of two drops of a session are products,
    `plus`·`plus` − `minus`·`minus`.

    Attributes
    ----------
    own
        Variance that is this drop's own.
    degrees
        Degrees of freedom of `own`.
    plus, minus
        What it has in common with other drops.
    """

    own: float
    degrees: float
    plus: Sequence[float] | NDArray[np.float64]
    minus: Sequence[float] | NDArray[np.float64]


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
    deviation
        How far from the model's prediction it may be while the model holds.
    """

    value: float
    u: float
    degrees: float = math.inf
    budget: Mapping[str, float] = field(default_factory=dict)
    shared: NDArray[np.float64] | None = field(default=None, repr=False, compare=False)
    deviation: Deviation | None = field(default=None, repr=False, compare=False)

    @property
    def normalized_error(self) -> float | None:
        """E_n of a difference: within ±1 both agree (ISO 13528); `None` without uncertainty."""
        return self.value / self.expanded if self.u > 0.0 else None

    def less(self, other: Measured) -> Measured:
        """Return the difference from something measured or stated independently."""
        u = math.hypot(self.u, other.u)
        shares = self.u**4 / self.degrees + other.u**4 / other.degrees
        return Measured(self.value - other.value, u, u**4 / shares if shares else math.inf)

    @property
    def expanded(self) -> float:
        """Expanded uncertainty for 95 %."""
        # Effective degrees of freedom may come out below one, where t has no quantile of use.
        return coverage_factor(max(1.0, self.degrees)) * self.u

    def ufloat(self) -> Any:
        """Return it for the package ``uncertainties``, as a number independent of all others.

        Raises
        ------
        InputError
            Where that package is not installed.
        """
        return optional_package("uncertainties").ufloat(self.value, self.u)

    def json(self) -> dict[str, float]:
        """``{"value", "u", "U95"}``."""
        return {"value": self.value, "u": self.u, "U95": self.expanded}


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
    thinned
        Of the spurious ones, those in the middle of long flickers, which nothing was fitted to.
    """

    received: int = 0
    matched: int = 0
    missed: int = 0
    spurious: int = 0
    lost: int = 0
    unexplained: int = 0
    thinned: int = 0

    @property
    def expected(self) -> int:
        """Edges that a perfect rig would report."""
        return self.matched + self.missed

    def count(self, matched: int, unexplained: int) -> Audit:
        """Count again, with other edges that belong to a rod."""
        missed, spurious = self.expected - matched, self.received - matched
        changes = {"matched": matched, "missed": missed, "spurious": spurious}
        return replace(self, **changes, unexplained=unexplained)

    def json(self) -> dict[str, int]:
        """``edges`` of a run as `rig analyze --json` prints it."""
        counts = attributes(self, *COUNTS)
        return counts | ({"thinned": self.thinned} if self.thinned else {})


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
    alone
        What the drop says by itself, where the quantities are in the light of the whole session.
    unmatched
        Every edge that is missing or belongs to no rod, and why.
    limits
        The verdict that a rejected drop has by its limits.
    damaged
        Whether its stored record is damaged, which tells nothing of the rig.
    gates
        How one object passed each gate.
    last_passages
        Some of the quantities by themselves, see `rig.analysis.last_passages`.
    gravity
        What the free chain says of gravity, m/s², see `rig.analysis.gravity`; `None` where nobody
        asked it.
    """

    run: Run
    attempt: int
    verdict: Verdict
    reasons: tuple[Reason, ...]
    audit: Audit
    quantities: Mapping[str, Measured] = field(default_factory=dict)
    matches: Mapping[int, int] = field(default_factory=dict)
    scatter: float | None = None
    alone: Mapping[str, Measured] = field(default_factory=dict)
    unmatched: tuple[UnmatchedEdge, ...] = ()
    limits: Verdict | None = None
    damaged: bool = False
    last_passages: Mapping[str, Measured] = field(default_factory=dict)
    gates: tuple[GatePassage, ...] = ()
    gravity: Measured | None = None

    @property
    def learned(self) -> bool:
        """Whether the quantities are in the light of the whole session."""
        return bool(self.alone)

    def json(self) -> dict[str, Any]:
        """One member of ``runs``."""
        fields: dict[str, Any] = {"run": self.run.number, "attempt": self.attempt}
        fields |= {"incline_deg": self.run.incline_deg, "impact_chain": self.run.impact}
        fields |= {"damaged": True} if self.damaged else {}
        fields |= plain(self.quantities)
        fields |= {"edges": self.audit.json(), "unexplained_edges": self.audit.unexplained}
        if self.matches:
            fields["causes"] = plain(self.unmatched)
        names = ("gates", "scatter", "last_passages", "alone")
        fields |= attributes(self, *(name for name in names if getattr(self, name)))
        fields |= attributes(self, "learned", "verdict") | reasons_json(self.reasons)
        fields["degrees"] = plain({name: m.degrees for name, m in self.quantities.items()})
        fields["budget"] = [
            {"name": source, "quantity": name, "u": u}
            for name, value in self.quantities.items()
            for source, u in value.budget.items()
        ]
        return fields
