"""What a session with given beams will tell: its square root, and uncertainties from it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from typing import NamedTuple

import numpy as np

from rig.analysis.averages import by_case
from rig.analysis.square_root import Elimination, EquationRows, eliminate, square_root, triangle
from rig.arrays import Array, Index
from rig.design.cases import BEAM, Case
from rig.estimate.coefficients import KNOWN, coefficients_of, held_back
from rig.estimate.hypotheses import model_alpha
from rig.protocol.protocol import Condition, Protocol
from rig.threads import one_thread
from rig.units import Quantity


class GateLayout(NamedTuple):
    """Some beams, and what they say of every kind of drop.

    Attributes
    ----------
    cases
        Kinds of drop, with what each of many beams would say.
    beams
        How many there are.
    blocks
        What they say of each kind of drop. Columns are those of `Case`, then `BEAM` a beam.
    """

    cases: tuple[Case, ...]
    beams: int
    blocks: tuple[tuple[EquationRows, ...], ...]

    @classmethod
    def of(cls, cases: tuple[Case, ...], beams: Iterable[int] | None = None) -> GateLayout:
        """Choose beams by their numbers, or all that there are."""
        numbers = range(len(cases[0].blocks)) if beams is None else beams
        return cls(cases, 0, ((),) * len(cases)).plus(*numbers)

    @property
    def size(self) -> int:
        """Number of the session's unknowns."""
        return self.cases[0].shared + BEAM * self.beams

    def places(self, case: Case) -> Index:
        """Where what a kind of drop leaves of them is in the session's vector."""
        return np.append(case.here, np.arange(case.shared, self.size))

    def plus(self, *beams: int) -> GateLayout:
        """Return the layout with more beams."""
        blocks = tuple(
            (*present, *(case.block(beam, n) for n, beam in enumerate(beams, self.beams)))
            for case, present in zip(self.cases, self.blocks, strict=True)
        )
        return GateLayout(self.cases, self.beams + len(beams), blocks)

    def without(self, count_of: Callable[[Case], int]) -> Iterator[tuple[Case, Elimination]]:
        """Eliminate so many of the first unknowns of each kind of drop, priors included."""
        for case, blocks in zip(self.cases, self.blocks, strict=True):
            yield case, _eliminate_first(count_of(case), blocks, case.core + BEAM * self.beams)

    def triangles(self) -> GateLayout:
        """Return the same in no more rows than columns: for beams to be added again and again."""
        reduced = self.without(lambda _: 0)
        return self._replace(blocks=tuple((drop.rest,) for _, drop in reduced))


class Forecast(NamedTuple):
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
    held: Set[str]

    def typical(self, name: str) -> float:
        """Root mean square over inclines of one run's uncertainty."""
        values = self.single[name].values()
        return math.sqrt(sum(u * u for u in values) / len(values))


@one_thread
def forecast(
    protocol: Protocol, layout: GateLayout, names: Sequence[str] | None = None
) -> Forecast:
    """Predict the uncertainties of a session.

    Parameters
    ----------
    layout
        The beams that there are.
    names
        Only these measurands, if given.
    """
    size = layout.size
    # First without α, which coefficients may take the place of; then α goes too.
    with_alpha = list(layout.without(lambda case: case.own))
    drops = []
    for case, drop in with_alpha:
        left = np.arange(drop.rest.slopes.shape[1])
        alpha = _eliminate_first(case.struck, [drop.rest._replace(columns=left)], left.size)
        drops.append((case, drop, alpha))
    rows = [_of_all_runs(case, last.rest.slopes, layout.places(case)) for case, _, last in drops]
    # Once a layout, then asked by every measurand and incline.
    inverse = np.linalg.inv(square_root(rows, np.ones(size), np.zeros(size)).matrix)
    single: dict[str, dict[Condition, float]] = {}
    mean: dict[str, dict[Condition, float]] = {}
    for at, group in by_case(protocol, drops, lambda drop: drop[0].run).items():
        n = sum(case.count for case, _, _ in group)
        gradients = group[0][0].gradients
        for name in (name for name in gradients if name in (names or gradients)):
            by_one, by_mean, common = 0.0, 0.0, np.zeros(size)
            for case, *stages in group:
                share, gradient = case.count / n, case.gradients[name]
                chance, own, slopes = gradient[case.by_chance], 0.0, gradient
                for stage in stages:
                    by_own, by_others = np.split(slopes, [len(stage.inverse)])
                    scatter, slopes = by_own @ stage.inverse, -by_own @ stage.gain
                    slopes[: by_others.size] += by_others
                    own += float(scatter @ scatter)
                shared = slopes @ inverse[layout.places(case)]
                by_one += share * (own + float(shared @ shared))
                by_mean += share * (own + float(chance @ chance)) / n
                common += share * shared
            single.setdefault(name, {})[at] = math.sqrt(by_one)
            mean.setdefault(name, {})[at] = math.sqrt(by_mean + float(common @ common))
    return Forecast(single, mean, *_coefficients(protocol, layout, with_alpha))


def _eliminate_first(count: int, blocks: Sequence[EquationRows], size: int) -> Elimination:
    """Eliminate the first of so many unknowns, priors included, in units of these."""
    own, others = np.split(np.arange(size), [count])
    return eliminate(blocks, np.ones(size), np.zeros(size), own, others)


def _of_all_runs(case: Case, slopes: Array, columns: Index) -> EquationRows:
    """Return what all runs of a kind say together of the session's unknowns."""
    return EquationRows(math.sqrt(case.count) * slopes, np.zeros(len(slopes)), columns)


def _coefficients(
    protocol: Protocol, layout: GateLayout, with_alpha: Sequence[tuple[Case, Elimination]]
) -> tuple[dict[str, float], set[str]]:
    """Standard uncertainties of β, μ and a pile's β, and those that edges do not tell.

    Parameters
    ----------
    with_alpha
        What each kind of drop leaves of α and of the session's unknowns.
    """
    stated: dict[str, Quantity] = {}
    tied = []
    for case, drop in with_alpha:
        if case.struck:
            struck = protocol.chains[case.run.impact or ""].chain, case.run.incline_deg
            depends_on, _ = coefficients_of(protocol, *struck)
            stated |= depends_on
            if depends_on:
                tied.append((case, drop.rest.slopes, struck))
    if not stated:
        return {}, set()
    values = {name: quantity.value for name, quantity in stated.items()}
    size, count = layout.size, len(values)
    behind, rows = size + np.arange(count), []
    for case, slopes, struck in tied:
        _, by_value = model_alpha(protocol, *struck, values)
        # α, the first of what is left, follows from the coefficients.
        by_values = np.outer(slopes[:, 0], by_value)
        observed = np.column_stack([slopes[:, 1:], by_values])
        rows.append(_of_all_runs(case, observed, np.append(layout.places(case), behind)))
    nothing = np.zeros(size + count)
    edges = eliminate(rows, nothing + 1.0, nothing, np.arange(size), behind).rest.slopes

    def uncertainties(priors: Mapping[str, float]) -> dict[str, float]:
        """With some held within these uncertainties; 0 is exact, which is no unknown."""
        free = [n for n, name in enumerate(values) if priors.get(name) != 0.0]
        # ±1 of a coefficient is as good as nothing known.
        weights = [math.hypot(1.0, 1.0 / (priors.get(name) or math.inf)) for name in values]
        inverse = np.linalg.inv(triangle(np.vstack([edges, np.diag(weights)])[:, free]))
        by_place = dict(zip(free, np.linalg.norm(inverse, axis=1).tolist(), strict=True))
        return {name: by_place.get(n, 0.0) for n, name in enumerate(values)}

    held = held_back(stated, uncertainties)
    by_edges, present = uncertainties({}), uncertainties(held)
    unknown = held.keys() | {name for name, u in present.items() if u > KNOWN}
    return present | {name: by_edges[name] for name in unknown}, unknown
