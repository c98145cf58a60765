"""Results of drops: measured values, edge counts and verdicts, and their JSON."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from rig.analysis.distributions import coverage_factor
from rig.plain_data import Record, spread
from rig.reasons import Reason, errors_become, reasons_json
from rig.records import Job

if TYPE_CHECKING:  # results are shown, and predictions made, where no drop is analysed
    import numpy as np
    from numpy.typing import NDArray

    from rig.analysis.edge_classes import UnmatchedEdge
    from rig.analysis.gate_passages import GatePassage
    from rig.protocol.protocol import Run

Verdict = Literal["accepted", "marginal", "void", "rejected"]
GOOD: tuple[Verdict, ...] = ("accepted", "marginal")
"""Verdicts of drops that are included in a summary."""

COUNTS = ("received", "matched", "missed", "spurious", "lost")
"""Counts of edges in the order of tables."""


def optional_package(name: str) -> Any:
    """Import a package of the extra ``notebook``.

    Raises
    ------
    InputError
        It is not installed.
    """
    with errors_become("package_absent", ModuleNotFoundError, package=name):
        return import_module(name)


class Deviation(NamedTuple):
    """Variance of a drop's result less its prediction if the model holds.

    It includes single impulses, this rig's rods and measurement errors, but not the uncertainty of
    the model's coefficients. The covariance of two drops of a session is
    `plus`·`plus` − `minus`·`minus`.

    Attributes
    ----------
    own
        Variance that is independent of other drops.
    degrees
        Degrees of freedom of `own`.
    plus, minus
        Vectors whose products give the covariance with other drops.
    """

    own: float
    degrees: float
    plus: Sequence[float] | NDArray[np.float64]
    minus: Sequence[float] | NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Measured(Record):
    """A measured value.

    Attributes
    ----------
    value, u
        Best estimate and standard uncertainty.
    degrees
        Degrees of freedom of `u`.
    budget
        Contribution of each source to `u`; the squares add up to u².
    shared
        Part of `u` that is common to all drops of a session, as a vector: the product of two drops'
        vectors is their covariance. `None` for a drop by itself.
    deviation
        Variance about the model's prediction if the model holds.
    """

    MEMBERS = "value u U95=expanded"

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
        """Return the difference from an independent value, with its uncertainty."""
        u = math.hypot(self.u, other.u)
        shares = self.u**4 / self.degrees + other.u**4 / other.degrees
        return Measured(self.value - other.value, u, u**4 / shares if shares else math.inf)

    @property
    def expanded(self) -> float:
        """Expanded uncertainty for 95 % coverage."""
        # Effective degrees of freedom may be below 1, where the quantile of t is useless.
        return coverage_factor(max(1.0, self.degrees)) * self.u

    def ufloat(self) -> Any:
        """Return the value as an independent number of the package ``uncertainties``.

        Raises
        ------
        InputError
            That package is not installed.
        """
        return optional_package("uncertainties").ufloat(self.value, self.u)


@dataclass(frozen=True, slots=True)
class Audit(Record):
    """Edge counts of a drop.

    Attributes
    ----------
    received
        Edges in the record, of the gates in use.
    matched
        Received edges that belong to a rod.
    missed
        Expected edges that were not received, but for those of rods that may have struck before.
    spurious
        Received edges that belong to no rod.
    lost
        Edges that the device could not store.
    unexplained
        Spurious edges of no known kind.
    thinned
        Spurious edges in the middle of long flickers, which the fit did not use.
    struck
        Edges that were not received as their rods rather struck before, on a heap.
    """

    MEMBERS = "received matched missed spurious lost thinned? struck?"

    received: int = 0
    matched: int = 0
    missed: int = 0
    spurious: int = 0
    lost: int = 0
    unexplained: int = 0
    thinned: int = 0
    struck: int = 0

    @property
    def edge_count(self) -> int:
        """Edges that a perfect rig would report."""
        return self.matched + self.missed

    def count(self, matched: int, unmatched: Collection[UnmatchedEdge]) -> Audit:
        """Return the counts for a number of matched edges, and all unmatched ones."""
        kinds = [edge.kind for edge in unmatched]
        absent, struck = sum(edge.edge is None for edge in unmatched), kinds.count("struck")
        return replace(
            self,
            matched=matched,
            missed=absent - struck,
            spurious=self.received - matched,
            unexplained=kinds.count("extra"),
            struck=struck,
        )


@dataclass(frozen=True, slots=True)
class DropResult(Record):
    """All results of a drop.

    Attributes
    ----------
    quantities
        Measurands by JSON name (``separation_m`` …), only those of the scene.
    rods
        Rod of each of the drop's edges, −1 if it belongs to none; the bottom rod is 0. Empty
        without a fit.
    scatter
        Scatter of the edges relative to the assumed scatter, at least 1; `None` without a fit.
    alone
        Measurands of the drop by itself, if `quantities` come from the joint fit.
    unmatched
        Every edge that is missing or belongs to no rod, with its class.
    limits
        The verdict of a rejected drop by its limits.
    damaged
        Whether its stored record is damaged, which says nothing about the rig.
    gates
        DueEdges of a single object through the gates.
    last_passages
        Measurands from the last passages alone, see `rig.analysis.last_passages`.
    gravity
        Gravity from the free chain, m/s², see `rig.analysis.gravity`; `None` if not computed.
    """

    MEMBERS = (
        "run=run.number attempt incline_deg=run.incline_deg impact_chain=run.impact "
        "setting=run.setting? damaged? *quantities edges=audit unexplained_edges=audit.unexplained "
        "*causes gates? scatter? last_passages? alone? learned verdict *explained degrees budget"
    )

    run: Run
    attempt: int
    verdict: Verdict
    reasons: tuple[Reason, ...]
    audit: Audit
    quantities: Mapping[str, Measured] = field(default_factory=dict)
    rods: tuple[int, ...] = ()
    scatter: float | None = None
    alone: Mapping[str, Measured] = field(default_factory=dict)
    unmatched: tuple[UnmatchedEdge, ...] = ()
    limits: Verdict | None = None
    damaged: bool = False
    last_passages: Mapping[str, Measured] = field(default_factory=dict)
    gates: tuple[GatePassage, ...] = ()
    gravity: Measured | None = None

    @property
    def job(self) -> Job:
        """Run and attempt."""
        return Job(self.run.number, self.attempt)

    @property
    def matches(self) -> dict[int, int]:
        """Rod of each matched edge, by the edge's number in the drop."""
        return {n: rod for n, rod in enumerate(self.rods) if rod >= 0}

    @property
    def learned(self) -> bool:
        """Whether `quantities` come from the joint fit."""
        return bool(self.alone)

    @property
    def causes(self) -> dict[str, Sequence[UnmatchedEdge]]:
        """Unmatched edges of a fitted drop, for JSON."""
        return {"causes": self.unmatched} if self.rods else {}

    @property
    def explained(self) -> dict[str, list[Any]]:
        """Reasons as sentences and as codes, for JSON."""
        return reasons_json(self.reasons)

    @property
    def degrees(self) -> dict[str, float]:
        """Degrees of freedom of each quantity."""
        return {name: value.degrees for name, value in self.quantities.items()}

    @property
    def budget(self) -> list[dict[str, Any]]:
        """Contribution of each source to each quantity."""
        return spread({name: value.budget for name, value in self.quantities.items()})


def good_runs(results: Iterable[DropResult], *, rejected: bool = False) -> list[DropResult]:
    """Return the results of good drops.

    Parameters
    ----------
    rejected
        Whether to include drops that are good by their limits but were rejected by the operator.
    """
    verdicts = [(result, result.limits if rejected else None) for result in results]
    return [result for result, limits in verdicts if {result.verdict, limits} & {*GOOD}]
