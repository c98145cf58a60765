"""What became of simulated drops, and how far results are from the truth."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from statistics import fmean, median, stdev
from typing import TYPE_CHECKING, Any

from bench.studies.falls import STRAY
from rig.analysis.result import GOOD

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from bench.studies.falls import SimulatedDrop
    from rig.analysis.result import DropResult, Measured
    from rig.protocol.protocol import Protocol

_INTENDED = 0.95  # share of the truths that intervals are made to hold


@dataclass(slots=True)
class Errors:
    """Errors of one quantity: measured less true, with the uncertainties and the number of the rig.

    An instrument that states no uncertainty has errors alone.
    """

    errors: list[float] = field(default_factory=list)
    expanded: list[float] = field(default_factory=list)
    standard: list[float] = field(default_factory=list)
    rigs: list[int] = field(default_factory=list)

    def add(self, measured: Measured, true: float, rig: int) -> None:
        """Count a measurement on a rig."""
        self.errors.append(measured.value - true)
        self.expanded.append(measured.expanded)
        self.standard.append(measured.u)
        self.rigs.append(rig)

    @property
    def rms(self) -> float:
        """Root of the mean squared error."""
        return math.sqrt(fmean(error**2 for error in self.errors))

    @property
    def ratios(self) -> list[float]:
        """|error| over U of each."""
        return [abs(error) / u for error, u in zip(self.errors, self.expanded, strict=True)]

    def json(self) -> dict[str, float | int]:
        """Rms, bias, largest error, mean and median U95, and share of intervals with the truth.

        Drops on one rig share errors: ``bias_se`` and ``coverage_se``, from rig to rig, say how
        well bias and coverage are known. ``bias_over_U`` is the bias in units of the mean U95, and
        ``times_u`` the rms over that of the stated standard uncertainties.
        """
        hits = [ratio <= 1.0 for ratio in self.ratios]
        bias, mean_u = fmean(self.errors), fmean(self.expanded)
        figures = {
            "n": len(self.errors),
            "rms": self.rms,
            "bias": bias,
            "worst": max(map(abs, self.errors)),
            "mean_U95": mean_u,
            "median_U95": median(self.expanded),
            "bias_over_U": bias / mean_u,
            "coverage": fmean(hits),
            "times_u": self.rms / math.sqrt(fmean(u**2 for u in self.standard)),
            "z_rms": math.sqrt(
                fmean((e / u) ** 2 for e, u in zip(self.errors, self.standard, strict=True))
            ),
        }
        if len(set(self.rigs)) > 1:
            figures["bias_se"] = self._between(self.errors)
            # Few misses tell little of how they scatter: so many independent errors there are.
            independent = (figures["rms"] / figures["bias_se"]) ** 2
            chance = math.sqrt(_INTENDED * (1.0 - _INTENDED) / independent)
            figures["coverage_se"] = max(self._between(hits), chance)
        return figures

    def _between(self, values: Sequence[float]) -> float:
        """Standard error of a mean over rigs."""
        by_rig: dict[int, list[float]] = defaultdict(list)
        for rig, value in zip(self.rigs, values, strict=True):
            by_rig[rig].append(value)
        means = [fmean(group) for group in by_rig.values()]
        return stdev(means) / math.sqrt(len(means))


@dataclass(slots=True)
class Score:
    """What became of drops beside their hidden truth.

    Attributes
    ----------
    verdicts, beyond
        How many of each; void drops that truly are beyond the protocol's limits.
    reasons
        First ones of the other void and marginal drops.
    edges, strays, wrong_edges, wrong_drops
        Of good drops: edges given to a rod, of these strays, and those given to another rod than
        they came from; drops with such an edge.
    errors
        Of each quantity.
    seconds
        Processor time of the analysis.
    """

    verdicts: Counter[str] = field(default_factory=Counter)
    beyond: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    edges: int = 0
    strays: int = 0
    wrong_edges: int = 0
    wrong_drops: int = 0
    errors: dict[str, Errors] = field(default_factory=dict)
    seconds: float = 0.0

    def add_drop(
        self, protocol: Protocol, result: DropResult, fall: SimulatedDrop, rig: int
    ) -> None:
        """Compare one drop with its truth."""
        self.verdicts[result.verdict] += 1
        good = result.verdict in GOOD
        beyond = not good and _is_beyond(protocol, result, fall)
        self.beyond += beyond
        if result.verdict != "accepted" and not beyond:
            self.reasons.update(f"{result.verdict}: {reason}" for reason in result.reasons[:1])
        if good:
            wrong, strays = fall.rods(result.matches)
            self.edges += len(result.matches)
            self.strays += strays
            self.wrong_edges += wrong
            self.wrong_drops += wrong > 0
            for name, measured in result.quantities.items():
                self.add_error(name, measured, fall.truth.get(name), rig)

    def add_error(self, name: str, measured: Measured, true: float | None, rig: int) -> None:
        """Count a measurement, where its true value is known."""
        if true is not None:
            self.errors.setdefault(name, Errors()).add(measured, true, rig)

    def add_score(self, other: Score) -> None:
        """Count what another score has."""
        for name in ("beyond", "edges", "strays", "wrong_edges", "wrong_drops", "seconds"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.verdicts += other.verdicts
        self.reasons += other.reasons
        for name, errors in other.errors.items():
            own = self.errors.setdefault(name, Errors())
            for column in errors.__slots__:
                getattr(own, column).extend(getattr(errors, column))

    @property
    def void(self) -> int:
        """Drops that are void without need."""
        return self.verdicts.total() - sum(self.verdicts[good] for good in GOOD) - self.beyond

    def json(self) -> dict[str, Any]:
        """Counts, shares of the drops that are not beyond limits, and errors of each quantity."""
        drops = self.verdicts.total()
        fair = max(1, drops - self.beyond)
        counts = "beyond", "edges", "strays", "wrong_edges", "wrong_drops"
        return {
            "drops": drops,
            **{name: getattr(self, name) for name in counts},
            "void_share": self.void / fair,
            "marginal_share": self.verdicts["marginal"] / fair,
            "ms_per_drop": 1e3 * self.seconds / max(1, drops),
            "quantities": {name: errors.json() for name, errors in self.errors.items()},
            "reasons": dict(self.reasons.most_common()),
        }


def total(scores: Iterable[Score]) -> Score:
    """Sum scores up."""
    result = Score()
    for score in scores:
        result.add_score(score)
    return result


def _is_beyond(protocol: Protocol, result: DropResult, fall: SimulatedDrop) -> bool:
    """Whether a drop truly is beyond the protocol's limits, so that it has to be void."""
    skew = fall.truth.get("release_skew_s")
    if skew is not None and abs(skew) > protocol.accept.release_skew:
        return True
    passages = {tuple(edge) for _, *edge in fall.truth["edges"] if edge[-1] != STRAY}
    expected = result.audit.edge_count
    return expected - len(passages) > protocol.accept.missed_edges * expected


def shares_held(figures: Mapping[str, float], digits: int) -> tuple[str, str]:
    """Write the share of intervals with the truth, and how well it is known (± from rig to rig)."""
    chance = f"± {figures['coverage_se']:.{digits}%}" if "coverage_se" in figures else ""
    return f"{figures['coverage']:.{digits}%}", chance
