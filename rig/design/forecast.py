"""What a session with given beams will tell: its normal matrix, and uncertainties from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.summary import by_case
from rig.design.cases import BEAM
from rig.estimate.coefficients import KNOWN, described, first_held, given_alphas
from rig.estimate.hypotheses import BETA, MU, alphas
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from rig.design.cases import Case, Cases
    from rig.protocol.protocol import Condition, Protocol

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

_EXACT = 1e18
"""What is known of a coefficient that the protocol states without ±: 1/u²."""


@dataclass(frozen=True, slots=True)
class Forecast:
    """Standard uncertainties to be expected.

    Attributes
    ----------
    single, mean
        Of a measurand in one run, and of its mean over an incline's runs with what makes the runs
        themselves differ, in the light of the whole session; by JSON name, then by condition.
    coefficients
        Of the coefficients, by name: of those that the edges tell, with the others held; of the
        others, without any prior.
    held
        Coefficients that the edges do not tell: `rig estimate` would hold them as stated, too.
    """

    single: Mapping[str, Mapping[Condition, float]]
    mean: Mapping[str, Mapping[Condition, float]]
    coefficients: Mapping[str, float]
    held: frozenset[str] = frozenset()

    def typical(self, name: str) -> float:
        """Root mean square over inclines of one run's uncertainty."""
        values = self.single[name].values()
        return math.sqrt(sum(u * u for u in values) / len(values))

    def wanted(self) -> dict[str, float]:
        """All that a layout is judged by."""
        return {name: self.typical(name) for name in self.single} | dict(self.coefficients)


@one_thread
def forecast(
    protocol: Protocol,
    found: Cases,
    layout: Sequence[int],
    names: Sequence[str] | None = None,
    *,
    sure: bool = False,
) -> Forecast:
    """Predict the uncertainties of a session.

    Parameters
    ----------
    found
        Kinds of drop, with what each of many beams would say.
    layout
        Which of these beams there are.
    names
        Only these measurands, if given.
    sure
        Whether also coefficients are kept that the edges hardly tell.
    """
    size = found.shared + BEAM * len(layout)
    parts = [_Part.of(case, found.shared, layout, names) for case in found.cases]
    total = np.eye(size)
    for part in parts:
        total[part.grid] += part.case.count * part.without_alpha
    covariance = np.linalg.inv(total)  # once a layout, then asked by every measurand and incline
    single: dict[str, dict[Condition, float]] = {}
    mean: dict[str, dict[Condition, float]] = {}
    for here in by_case(protocol, parts, lambda part: part.case.run):
        at = protocol.condition(here[0].case.run)
        n = sum(part.case.count for part in here)
        for name in here[0].spreads:
            alone, together, common = 0.0, 0.0, np.zeros(size)
            for part in here:
                share = part.case.count / n
                # Own variance and slopes by what the session has in common, at this layout.
                own, slopes = part.spreads[name]
                shared = np.zeros(size)
                shared[part.place] = slopes
                chance = part.case.gradients[name][part.case.by_chance]
                alone += share * (own + float(shared @ covariance @ shared))
                together += share * (own + float(chance @ chance)) / n
                common += share * shared
            single.setdefault(name, {})[at] = math.sqrt(alone)
            both = together + float(common @ covariance @ common)
            mean.setdefault(name, {})[at] = math.sqrt(both)
    coefficients, held = _coefficients(protocol, parts, size)
    kept = {name: u for name, u in coefficients.items() if sure or name not in held}
    return Forecast(single, mean, kept, held)


@dataclass(frozen=True, slots=True)
class _Part:
    """One kind of drop, with all that is its own eliminated.

    Attributes
    ----------
    place, grid
        Where its unknowns are in the session's vector and matrix, beams included.
    matrix, cross, square
        What it says of them, of them with α, and of α; the latter are zero where nothing is struck.
    spreads
        Of each measurand: its variance given the session's unknowns, and its slopes by them.
    """

    case: Case
    place: Index
    grid: tuple[Index, ...]
    matrix: Array
    cross: Array
    square: float
    spreads: dict[str, tuple[float, Array]]

    @classmethod
    def of(
        cls, case: Case, shared: int, layout: Sequence[int], names: Sequence[str] | None
    ) -> _Part:
        """Add up what the beams say, then eliminate."""
        core, own = case.core, case.own
        size = core + BEAM * len(layout)
        whole = np.zeros((size, size))
        for slot, n in enumerate(layout):
            block = case.blocks[n]
            beam = core + BEAM * slot
            place = np.append(block.columns, np.arange(beam, beam + BEAM))
            whole[place[:, None], place] += block.matrix
        inverse = np.linalg.inv(whole[:own, :own] + np.eye(own))
        gain = inverse @ whole[:own, own:]
        left = whole[own:, own:] - whole[own:, :own] @ gain
        alpha = case.here.size
        kept = np.delete(np.arange(left.shape[0]), slice(alpha, alpha + case.struck))
        matrix = left[kept[:, None], kept]
        cross = left[kept, alpha] if case.struck else np.zeros(kept.size)
        square = float(left[alpha, alpha]) if case.struck else 0.0
        spreads = {}
        for name in names or case.gradients:
            if name not in case.gradients:
                continue
            gradient = np.zeros(size)
            gradient[:core] = case.gradients[name]
            solved = inverse @ gradient[:own]
            rest = gradient[own:] - gain.T @ gradient[:own]
            by_alpha = float(rest[alpha]) if case.struck else 0.0
            spreads[name] = (
                float(gradient[:own] @ solved) + by_alpha**2 / (1.0 + square),
                rest[kept] - cross * (by_alpha / (1.0 + square)),
            )
        place = np.append(case.here, shared + np.arange(BEAM * len(layout)))
        return cls(case, place, np.ix_(place, place), matrix, cross, square, spreads)

    @property
    def without_alpha(self) -> Array:
        """What the drop says of the session's unknowns by itself, with an α of its own."""
        found: Array = self.matrix - np.outer(self.cross, self.cross) / (1.0 + self.square)
        return found


def _coefficients(
    protocol: Protocol, parts: Sequence[_Part], size: int
) -> tuple[dict[str, float], frozenset[str]]:
    """Standard uncertainties of β, μ and a pile's β, and those that edges do not tell."""
    surface = protocol.surface
    if surface is None:
        return {}, frozenset()
    drops = [
        (protocol.chains[part.case.run.impact or ""].chain, part.case.run.incline_deg)
        for part in parts
    ]
    kept, stated, _ = described(protocol, drops)
    if not stated:
        return {}, frozenset()
    now = {name: quantity.value for name, quantity in stated.items()}
    given = given_alphas(protocol)
    total = np.eye(size + len(now))  # ±1 of a coefficient is as good as nothing known
    for part, (chain, incline), said in zip(parts, drops, kept, strict=True):
        if not said:
            continue
        slopes = alphas(surface, chain, incline, now, given.get(chain))[1].mean(axis=0)
        n = part.case.count
        total[part.grid] += n * part.matrix
        mixed = n * np.outer(part.cross, slopes)
        total[part.place, size:] += mixed
        total[size:, part.place] += mixed.T
        total[size:, size:] += n * part.square * np.outer(slopes, slopes)
    places = {name: size + n for n, name in enumerate(now)}

    def uncertainties() -> dict[str, float]:
        variances = np.diag(np.linalg.inv(total))
        return {name: math.sqrt(variances[place]) for name, place in places.items()}

    by_edges = found = uncertainties()
    held: set[str] = set()
    for name in first_held(now):  # as the estimate does
        unsure = {one for one, u in found.items() if u > KNOWN}
        if not unsure:
            break
        if name == MU and not unsure & {MU, BETA}:
            continue
        held.add(name)
        u = stated[name].u
        total[places[name], places[name]] += u**-2 if u else _EXACT
        found = uncertainties()
    held |= {one for one, u in found.items() if u > KNOWN}
    return found | {one: by_edges[one] for one in held}, frozenset(held)
