"""The quadrature rules against integrals known exactly."""

from __future__ import annotations

import numpy as np
import pytest

from rig.model.quadrature import gauss


@pytest.mark.parametrize("count", [1, 2, 3, 8, 16, 40, 100])
def test_gauss_is_exact_for_polynomials(count):
    rule = gauss(count)
    for degree in {0, 1, count, 2 * count - 2, 2 * count - 1}:
        exact = 0.0 if degree % 2 else 2 / (degree + 1)
        assert float(rule.weights @ rule.nodes**degree) == pytest.approx(
            exact, rel=1e-13, abs=1e-14
        )


@pytest.mark.parametrize("count", [1, 2, 3, 8, 16, 40, 100])
def test_running_integrals_are_exact_for_polynomials(count):
    rule = gauss(count)
    for degree in {0, count // 2, count - 1}:
        exact = (rule.nodes ** (degree + 1) - (-1) ** (degree + 1)) / (degree + 1)
        np.testing.assert_allclose(rule.running @ rule.nodes**degree, exact, rtol=0, atol=5e-15)
