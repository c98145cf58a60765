"""Forecasts of sharp edges, exact priors and unknown ones, beside arithmetic with 60 digits."""

from __future__ import annotations

import re
from dataclasses import fields, replace
from decimal import Decimal, localcontext

import numpy as np
import pytest

from rig.analysis.components import priors
from rig.design.cases import BEAM, cases
from rig.design.forecast import GateLayout, forecast
from rig.estimate.hypotheses import model_alpha
from rig.protocol import reader
from rig.protocol.protocol import Priors
from tests.tables import protocol_text

TEXT = protocol_text("three-rods")
PLAIN = reader.parse(TEXT)
EXACT = reader.parse(
    re.sub(r" ± [^,}\n]+", "", TEXT).replace("uncertainty: 0.3 mm", "uncertainty: 0 mm")
)
"""Nothing uncertain of the rig itself: heights, drop, gravity and coefficients."""


def scaled(factor: float, **changes: float) -> Priors:
    """Every prior so many times as wide."""
    names = (field.name for field in fields(Priors))
    wide = {name: factor * getattr(PLAIN.priors, name) for name in names}
    return Priors(**wide | changes)


SHARP = replace(PLAIN, priors=replace(PLAIN.priors, jitter=1e-12))
RIGS = {
    "sharp": (SHARP, 1e-9),
    "everything zero": (replace(EXACT, priors=scaled(0.0)), 1e-9),
    "every prior huge": (replace(PLAIN, priors=scaled(1e5, jitter=2e-6, strings=5e4)), 1e-4),
    "sharp, the air unknown": (replace(SHARP, priors=replace(SHARP.priors, drag=1e6)), 1e-9),
}
"""Protocols, and how sharp their edges are, m."""


def exact(values: np.ndarray) -> np.ndarray:
    """The same numbers as decimals, not one digit rounded."""
    return np.vectorize(Decimal, otypes=[object])(values)


def variances(slopes: np.ndarray, gradients: np.ndarray) -> list[Decimal]:
    """Variance of each row of gradients, priors of ±1 beside: by elimination in 60 digits."""
    size = slopes.shape[1]
    normal = slopes.T @ slopes + exact(np.eye(size))
    whole = np.column_stack([normal, gradients.T])
    for n in range(size):
        whole[n + 1 :] -= np.outer(whole[n + 1 :, n] / whole[n, n], whole[n])
    # With normal = LDLᵀ, g·normal⁻¹·g is the sum of (L⁻¹g)² over D.
    return [
        sum(whole[n, size + k] ** 2 / whole[n, n] for n in range(size))
        for k in range(gradients.shape[0])
    ]


@pytest.mark.parametrize("name", RIGS)
def test_no_digit_is_lost_to_sharp_edges_or_extreme_priors(name):
    protocol, floor = RIGS[name]
    beams, surface = protocol.gates.gates, protocol.surface
    kinds = cases(protocol, replace(priors(protocol), floor=floor))
    found = forecast(protocol, GateLayout.of(kinds))
    # All unknowns of the session: each drop's own and its α, what is common, beams.
    common = sum(case.own + case.struck for case in kinds)
    size, first, rows, at_alpha, gradients = (
        common + kinds[0].shared + BEAM * len(beams),
        0,
        [],
        [],
        [],
    )
    for case in kinds:
        place = np.append(first + np.arange(case.own + case.struck), common + case.here)
        at_alpha.append(first + case.own)
        first += case.own + case.struck
        for gradient in case.gradients.values():
            gradients.append(np.zeros(size))
            gradients[-1][place] = gradient
        for n, block in enumerate(case.blocks):
            beam = common + kinds[0].shared + BEAM * n + np.arange(BEAM)
            for slopes in block.slopes:
                rows.append(np.zeros(size))
                rows[-1][np.append(place, beam)[block.columns]] = slopes
    now = {"restitution": surface.restitution.value, "friction": surface.friction.value}
    chain = protocol.chains["A"].chain
    ties = [model_alpha(protocol, chain, case.run.incline_deg, now)[1] for case in kinds]
    with localcontext(prec=60):
        slopes = exact(np.array(rows))
        u = [float(x.sqrt()) for x in variances(slopes, exact(np.array(gradients)))]
        said = [
            found.single[quantity][protocol.condition(case.run)]
            for case in kinds
            for quantity in case.gradients
        ]
        assert said == pytest.approx(u, rel=1e-9)
        # With α by β and μ, of which no more is known than ±1.
        tied = np.column_stack(
            [np.delete(slopes, at_alpha, axis=1), slopes[:, at_alpha] @ exact(np.array(ties))]
        )
        wanted = exact(np.eye(tied.shape[1])[-2:])
        u = [float(x.sqrt()) for x in variances(tied, wanted)]
    # What is held is given without any prior; where one alone is, the other is given with it.
    assert found.held in (set(), set(now))
    assert [found.coefficients[name] for name in now] == pytest.approx(u, rel=1e-9)
