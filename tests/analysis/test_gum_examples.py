"""Examples of the GUM (JCGM 100, annex H) by the code that works out results."""

import math

import numpy as np
import pytest

from rig.analysis.adjust import least_squares
from rig.analysis.budget_lines import effective_degrees
from rig.analysis.distributions import coverage_factor
from tests.analysis.least_squares import plain_equations


def u_of(found, gradient):
    return float(np.linalg.norm((gradient * found.sd) @ found.inverse))


def test_end_gauge():
    """H.1.6: components in nm, ν_eff = 16.7, taken as 16; U for 99 % is 93 nm."""
    budget = {"standard": 25.0, "comparison": 9.7, "expansion": 2.9, "temperature": 16.6}
    u = math.hypot(*budget.values())
    assert u == pytest.approx(32.0, abs=0.5)
    degrees = effective_degrees(
        u, budget, {"standard": 18.0, "comparison": 25.6, "expansion": 50.0, "temperature": 2.0}
    )
    assert degrees == pytest.approx(16.7, abs=0.1)
    assert coverage_factor(math.floor(degrees), 0.99) * 32.0 == pytest.approx(93.0, abs=0.5)


def test_impedance():
    """H.2: five sets of V, I and φ observed together; correlated means, correlated results."""
    observed = np.array(
        [
            [5.007, 4.994, 5.005, 4.990, 4.999],
            [19.663e-3, 19.639e-3, 19.640e-3, 19.685e-3, 19.678e-3],
            [1.0456, 1.0438, 1.0468, 1.0428, 1.0433],
        ]
    )
    means, covariance = observed.mean(axis=1), np.cov(observed) / 5
    whiten = np.linalg.inv(np.linalg.cholesky(covariance))
    sd = 1e4 * np.sqrt(np.diag(covariance))
    found = least_squares(
        lambda x, _: plain_equations(whiten @ (x - means), whiten), sd, np.zeros(3)
    )
    v, i, phi = found.x
    z = v / i
    r, x = z * math.cos(phi), z * math.sin(phi)
    gradients = {
        "R": (r, 0.071, 127.732, np.array([r / v, -r / i, -x])),
        "X": (x, 0.295, 219.847, np.array([x / v, -x / i, r])),
        "Z": (z, 0.236, 254.260, np.array([z / v, -z / i, 0.0])),
    }
    for value, u, stated, gradient in gradients.values():
        assert value == pytest.approx(stated, abs=6e-4)
        assert u_of(found, gradient) == pytest.approx(u, abs=6e-4)
    rows = np.array([gradient for *_, gradient in gradients.values()]) * sd
    whole = rows @ (found.inverse @ found.inverse.T) @ rows.T
    scale = np.sqrt(np.diag(whole))
    correlations = (whole / np.outer(scale, scale))[[0, 0, 1], [1, 2, 2]]
    np.testing.assert_allclose(correlations, [-0.588, -0.485, 0.993], atol=6e-4)


def test_thermometer():
    """H.3: corrections of a thermometer, a line through eleven of them, read at 30 °C."""
    t = np.array([
        21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511,
    ])  # fmt: skip
    b = -np.array([0.171, 0.169, 0.166, 0.159, 0.164, 0.165, 0.156, 0.157, 0.159, 0.161, 0.160])
    slopes = np.column_stack([np.ones(11), t - 20.0])
    sd, scatter = np.array([10.0, 10.0]), 0.0035
    for _ in range(2):  # the scatter is that of the residuals themselves
        found = least_squares(
            lambda y, _, s=scatter: plain_equations((slopes @ y - b) / s, slopes / s),
            sd,
            np.zeros(2),
        )
        scatter = float(np.linalg.norm(slopes @ found.x - b)) / math.sqrt(11 - 2)
    assert scatter == pytest.approx(0.0035, abs=5e-5)
    assert found.x == pytest.approx([-0.1712, 0.00218], abs=5e-5)
    u = [u_of(found, row) for row in np.eye(2)]
    assert u == pytest.approx([0.0029, 0.00067], rel=0.02)
    correlation = (found.inverse @ found.inverse.T)[0, 1] / math.sqrt(
        (found.inverse @ found.inverse.T)[0, 0] * (found.inverse @ found.inverse.T)[1, 1]
    )
    assert correlation == pytest.approx(-0.930, abs=6e-4)
    at = np.array([1.0, 10.0])
    assert float(at @ found.x) == pytest.approx(-0.1494, abs=6e-5)
    assert u_of(found, at) == pytest.approx(0.0041, abs=6e-5)
