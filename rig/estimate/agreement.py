"""Whether the drops agree with each other, and their inclines with the model."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.distributions import chi2_tail, coverage_factor
from rig.analysis.result import GOOD, normalized_error
from rig.analysis.summary import by_case, mean
from rig.measurands import averaged
from rig.predictions import predicted_parts, predicted_run
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from rig.analysis.result import DropResult, Measured
    from rig.model.surface import Surface
    from rig.protocol.protocol import Condition, Protocol

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Difference:
    """A mean less the model, under one condition.

    Attributes
    ----------
    n
        Drops in the mean.
    value, u
        Difference and its standard uncertainty, that of the model included, m or m/s.
    normalized_error
        E_n; `None` without any uncertainty.
    """

    condition: Condition
    n: int
    value: float
    u: float
    normalized_error: float | None

    @property
    def chi2(self) -> float:
        """Of this condition alone."""
        return (self.value / self.u) ** 2

    @property
    def p(self) -> float:
        """How often chance alone would make χ² as large."""
        return chi2_tail(self.chi2, 1)

    def json(self) -> dict[str, Any]:
        """One of ``inclines``."""
        return {
            **self.condition.json(),
            "n": self.n,
            "difference": self.value,
            "u": self.u,
            "normalized_error": self.normalized_error,
            "chi2": self.chi2,
            "p": self.p,
        }


@dataclass(frozen=True, slots=True)
class Comparison:
    """One measurand against the model.

    Attributes
    ----------
    quantity
        Its name in JSON.
    chi2
        Of all conditions together, with what they have in common.
    """

    quantity: str
    chi2: float
    differences: tuple[Difference, ...]

    @property
    def degrees(self) -> int:
        """Degrees of freedom of χ²."""
        return len(self.differences)

    @property
    def p(self) -> float:
        """How often chance alone would make χ² as large."""
        return chi2_tail(self.chi2, self.degrees)

    def json(self) -> dict[str, Any]:
        """One of ``comparison``."""
        return {
            "quantity": self.quantity,
            "chi2": self.chi2,
            "degrees": self.degrees,
            "p": self.p,
            "inclines": [one.json() for one in self.differences],
        }


def agreement(protocol: Protocol, results: Iterable[DropResult]) -> tuple[Comparison, ...]:
    """Compare Δz and V with the protocol's model, all inclines at once.

    Means of different inclines share the rig's errors, and predictions share the model's
    parameters: both stand in the covariance with which χ² is made, so that one wrong β counts once
    and not nine times.

    Returns
    -------
    tuple of Comparison
        One a measurand.
    """
    good = [result for result in results if result.verdict in GOOD]
    cases = by_case(protocol, good, lambda one: one.run)
    # Outside the model's domain there is nothing to compare with.
    cases = [runs for runs in cases if predicted_run(protocol, runs[0].run)]
    if not cases:
        return ()
    names = [row.name for row in averaged() if _tells(protocol, cases, row.name)]
    return tuple(_compared(protocol, cases, name) for name in names)


def _compared(protocol: Protocol, cases: Sequence[Sequence[DropResult]], name: str) -> Comparison:
    means = [mean([one.quantities[name] for one in runs]) for runs in cases]
    shared = _shared([[one.quantities[name] for one in runs] for runs in cases])
    # Scatter that is known from few runs counts for as much as its expanded uncertainty says.
    known = coverage_factor(np.inf)
    single = np.array(
        [max(0.0, (one.expanded / known) ** 2 - one.budget["common"] ** 2) for one in means]
    )
    predicted = np.array([_model(protocol, runs, name) for runs in cases])
    slopes = np.stack(
        [
            np.array([_model(high, runs, name) - _model(low, runs, name) for runs in cases])
            for low, high in _moved(protocol)
        ]
        or [np.zeros(len(cases))],
        axis=1,
    ) / 2.0  # fmt: skip
    measured = np.diag(single) + shared @ shared.T
    # Half the difference of two predictions is one input's part; outer products add them up.
    covariance = measured + slopes @ slopes.T
    off = np.array([one.value for one in means]) - predicted
    chi2 = float(off @ np.linalg.solve(covariance, off))
    u = np.sqrt(np.diag(covariance))
    models = np.sqrt(np.einsum("ij,ij->i", slopes, slopes))
    errors = [
        normalized_error(one, Quantity(*model), predicted_parts(protocol, runs[0].run).get(name))
        for one, model, runs in zip(means, zip(predicted, models, strict=True), cases, strict=True)
    ]
    lines = zip(cases, off.tolist(), u.tolist(), errors, strict=True)
    differences = (
        Difference(protocol.condition(runs[0].run), len(runs), *line) for runs, *line in lines
    )
    return Comparison(name, chi2, tuple(differences))


def _shared(values: Sequence[Sequence[Measured]]) -> Array:
    """What the means have in common, a row each: products of rows are covariances."""
    vectors = [[one.shared for one in runs if one.shared is not None] for runs in values]
    if all(len(found) == len(runs) for found, runs in zip(vectors, values, strict=True)):
        return np.array([np.mean(found, axis=0) for found in vectors])
    # Of drops by themselves only the size is known: taken as fully common.
    return np.array([[mean(runs).budget["common"]] for runs in values])


def _tells(protocol: Protocol, cases: Sequence[Sequence[DropResult]], name: str) -> bool:
    """Whether a quantity is measured and predicted everywhere."""
    return all(
        name in predicted_run(protocol, runs[0].run) and all(name in one.quantities for one in runs)
        for runs in cases
    )


def _model(protocol: Protocol, runs: Sequence[DropResult], name: str) -> float:
    """Prediction for these runs, which are of one case; not a number outside the domain."""
    found = predicted_run(protocol, runs[0].run)
    return found[name].value if name in found else math.nan


def _moved(protocol: Protocol) -> Iterator[tuple[Protocol, Protocol]]:
    """The protocol with one of the model's inputs at a time moved down and up by its u."""
    surface = protocol.surface
    assert surface is not None
    pile = surface.pile
    inputs: list[tuple[Quantity, Callable[[Quantity], Protocol]]] = [
        (protocol.drop, lambda to: replace(protocol, drop=to)),
        (protocol.gravity, lambda to: replace(protocol, gravity=to)),
        (surface.restitution, lambda to: _on(protocol, replace(surface, restitution=to))),
        (surface.friction, lambda to: _on(protocol, replace(surface, friction=to))),
    ]
    if pile is not None:
        softer = partial(replace, pile)
        inputs.append(
            (
                pile.restitution,
                lambda to: _on(protocol, replace(surface, pile=softer(restitution=to))),
            )
        )
    for stated, moved in inputs:
        if stated.u:
            low, high = (Quantity(stated.value + sign * stated.u) for sign in (-1, 1))
            yield moved(low), moved(high)


def _on(protocol: Protocol, surface: Surface) -> Protocol:
    return replace(protocol, surface=surface)
