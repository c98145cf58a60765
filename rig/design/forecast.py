"""What a session with given beams will tell: its square root, and uncertainties from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.square_root import triangle
from rig.analysis.summary import by_case
from rig.design.cases import BEAM, Block, Case
from rig.estimate.coefficients import KNOWN, held_back, stated_coefficients
from rig.estimate.hypotheses import alphas, given_alphas
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.arrays import Array, Index
    from rig.model.chain import Chain
    from rig.protocol.protocol import Condition, Protocol
    from rig.units import Quantity


@dataclass(frozen=True, slots=True)
class GateLayout:
    """Some beams, and what they say of every kind of drop.

    Attributes
    ----------
    cases
        Kinds of drop, with what each of many beams would say.
    beams
        How many there are.
    rows
        Observations of each kind of drop in standard deviations. Columns are those of `Case`, then
        `BEAM` a beam.
    """

    cases: tuple[Case, ...]
    beams: int
    rows: tuple[Array, ...]

    @classmethod
    def of(cls, cases: tuple[Case, ...], beams: Sequence[int]) -> GateLayout:
        """Choose beams by their numbers."""
        return cls(cases, 0, tuple(np.zeros((0, case.core)) for case in cases)).plus(*beams)

    def plus(self, *beams: int) -> GateLayout:
        """Return the layout with more beams."""
        pairs = zip(self.cases, self.rows, strict=True)
        rows = tuple(_stack(rows, [case.blocks[beam] for beam in beams]) for case, rows in pairs)
        return GateLayout(self.cases, self.beams + len(beams), rows)

    def triangles(self) -> GateLayout:
        """Return the same in no more rows than columns: for beams to be added again and again."""
        return replace(self, rows=tuple(map(triangle, self.rows)))


def _stack(rows: Array, blocks: Sequence[Block]) -> Array:
    """Put what beams say below what others said, each beam's own unknowns behind."""
    height = rows.shape[0] + sum(block.slopes.shape[0] for block in blocks)
    stack = np.zeros((height, rows.shape[1] + BEAM * len(blocks)))
    (end, beam), stack[: rows.shape[0], : rows.shape[1]] = rows.shape, rows
    for block in blocks:
        begin, end = end, end + block.slopes.shape[0]
        stack[begin:end, block.columns] = block.slopes[:, :-BEAM]
        stack[begin:end, beam : beam + BEAM] = block.slopes[:, -BEAM:]
        beam += BEAM
    return stack


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

    def goals(self) -> dict[str, float]:
        """All that a layout is judged by."""
        return {name: self.typical(name) for name in self.single} | dict(self.coefficients)


@one_thread
def forecast(
    protocol: Protocol,
    layout: GateLayout,
    names: Sequence[str] | None = None,
    *,
    sure: bool = False,
) -> Forecast:
    """Predict the uncertainties of a session.

    Parameters
    ----------
    layout
        The beams that there are.
    names
        Only these measurands, if given.
    sure
        Whether also coefficients are kept that the edges hardly tell.
    """
    size = layout.cases[0].shared + BEAM * layout.beams
    drops = list(map(_Drop.of, layout.cases, layout.rows))
    stated: dict[str, Quantity] = {}
    tied: list[_Drop] = []
    rest: list[_Drop] = []
    for drop in drops:
        depends_on: dict[str, Quantity] = {}
        if drop.case.struck:
            depends_on, _ = stated_coefficients(protocol, *_impact(protocol, drop.case))
        stated |= depends_on
        (tied if depends_on else rest).append(drop)
    # What needs no α of a drop is common to coefficients and measurands.
    root = _session([drop.given_alpha() for drop in tied], np.eye(size))
    observations = [*map(_Drop.given_alpha, rest), *map(_Drop.own_alpha, drops)]
    session_root = _session(observations, root)
    # Once a layout, then asked by every measurand and incline.
    inverse = np.linalg.inv(session_root)
    single: dict[str, dict[Condition, float]] = {}
    mean: dict[str, dict[Condition, float]] = {}
    for group in by_case(protocol, drops, lambda drop: drop.case.run):
        at = protocol.condition(group[0].case.run)
        n = sum(drop.case.count for drop in group)
        gradients = group[0].case.gradients
        for name in (name for name in gradients if name in (names or gradients)):
            by_one, by_mean, common = 0.0, 0.0, np.zeros(size)
            for drop in group:
                share = drop.case.count / n
                own, slopes = drop.spread(name)
                shared = slopes @ inverse[drop.place]
                chance = drop.case.gradients[name][drop.case.by_chance]
                by_one += share * (own + float(shared @ shared))
                by_mean += share * (own + float(chance @ chance)) / n
                common += share * shared
            single.setdefault(name, {})[at] = math.sqrt(by_one)
            mean.setdefault(name, {})[at] = math.sqrt(by_mean + float(common @ common))
    coefficients, held = _coefficients(protocol, tied, stated, root) if stated else ({}, set())
    reported = {name: u for name, u in coefficients.items() if sure or name not in held}
    return Forecast(single, mean, reported, frozenset(held))


@dataclass(frozen=True, slots=True)
class _Drop:
    """One kind of drop, with all that is its own eliminated.

    Attributes
    ----------
    place
        Where its other unknowns are in the session's vector, beams included.
    inverse, cross
        R⁻¹ of its own unknowns and α, their priors included; and what the same rows say of others.
    alpha
        What the edges say of α (0 where nothing is struck), and of others with it.
    rest
        What they say of others with α known.
    """

    case: Case
    place: Index
    inverse: Array
    cross: Array
    alpha: Array
    rest: Array

    @classmethod
    def of(cls, case: Case, rows: Array) -> _Drop:
        """Eliminate a drop's own unknowns, and α as far as its prior goes."""
        own, size = case.own, rows.shape[1]
        # A last row of zeros: α has a row also where there is no edge.
        stack = triangle(np.vstack([rows, np.eye(own, size), np.zeros((1, size))]))
        alpha = stack[own, own:] if case.struck else np.zeros(1 + size - own)
        of_others = stack[: own + case.struck, own + case.struck :].copy()
        root = stack[: own + case.struck, : own + case.struck].copy()
        if case.struck:  # turned against the row of its prior, 1
            root[own, own] = math.hypot(1.0, alpha[0])
            of_others[own] *= alpha[0] / root[own, own]
        inverse = np.linalg.inv(root).astype(np.float64, copy=False)
        place = np.append(case.here, case.shared + np.arange(size - case.core))
        rest = stack[own + case.struck :, own + case.struck :]
        return cls(case, place, inverse, of_others, alpha, rest)

    def given_alpha(self) -> tuple[Array, Index]:
        """Return what all such drops say of the session's unknowns with α known."""
        return math.sqrt(self.case.count) * self.rest, self.place

    def own_alpha(self) -> tuple[Array, Index]:
        """Return what they say besides, each with an α of its own."""
        scale = math.sqrt(self.case.count) / math.hypot(1.0, self.alpha[0])
        return scale * self.alpha[None, 1:], self.place

    def tied_alpha(self, slopes: Array, behind: int) -> tuple[Array, Index]:
        """Return what they say besides where α follows from coefficients with these slopes."""
        row = np.append(self.alpha[1:], self.alpha[0] * slopes)
        return math.sqrt(self.case.count) * row[None], np.append(
            self.place, behind + np.arange(slopes.size)
        )

    def spread(self, name: str) -> tuple[float, Array]:
        """Variance of a measurand given the session's unknowns, and its slopes by them."""
        ends = self.inverse.shape[0]
        gradient = np.zeros(ends + self.place.size)
        gradient[: self.case.core] = self.case.gradients[name]
        own = gradient[:ends] @ self.inverse
        return float(own @ own), gradient[ends:] - own @ self.cross


def _session(observations: Sequence[tuple[Array, Index]], root: Array) -> Array:
    """Return the square root of observations of some unknowns each, above that of all."""
    height = sum(rows.shape[0] for rows, _ in observations)
    stack = np.zeros((height + root.shape[0], root.shape[1]))
    end = 0
    for rows, columns in observations:
        begin, end = end, end + rows.shape[0]
        stack[begin:end, columns] = rows
    stack[end:] = root
    return triangle(stack)


def _impact(protocol: Protocol, case: Case) -> tuple[Chain, float]:
    return protocol.chains[case.run.impact or ""].chain, case.run.incline_deg


def _coefficients(
    protocol: Protocol, drops: Sequence[_Drop], stated: Mapping[str, Quantity], root: Array
) -> tuple[dict[str, float], set[str]]:
    """Standard uncertainties of β, μ and a pile's β, and those that edges do not tell."""
    assert protocol.surface is not None
    values = {name: quantity.value for name, quantity in stated.items()}
    alpha_names = given_alphas(protocol)
    size, count = root.shape[0], len(values)
    stack = np.eye(size + count)  # ±1 of a coefficient is as good as nothing known
    stack[:size, :size] = root
    tied = []
    for drop in drops:
        chain, incline = _impact(protocol, drop.case)
        _, slopes = alphas(protocol.surface, chain, incline, values, alpha_names.get(chain))
        tied.append(drop.tied_alpha(slopes.mean(axis=0), size))
    edges = _session(tied, stack)[size:, size:]

    def uncertainties(priors: Mapping[str, float]) -> dict[str, float]:
        """With some held within these uncertainties; 0 is exact, which is no unknown."""
        free = [n for n, name in enumerate(values) if priors.get(name) != 0.0]
        weights = [1.0 / priors[name] if priors.get(name) else 0.0 for name in values]
        inverse = np.linalg.inv(triangle(np.vstack([edges, np.diag(weights)])[:, free]))
        by_place = dict(zip(free, np.linalg.norm(inverse, axis=1).tolist(), strict=True))
        return {name: by_place.get(n, 0.0) for n, name in enumerate(values)}

    held = held_back(stated, uncertainties)
    by_edges, present = uncertainties({}), uncertainties(held)
    unknown = held.keys() | {name for name, u in present.items() if u > KNOWN}
    return present | {name: by_edges[name] for name in unknown}, unknown
