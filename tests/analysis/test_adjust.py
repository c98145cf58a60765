"""Least squares with priors against the same written directly, and the budget that follows."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from mpmath import mp

from rig.analysis.adjust import DONE, adjust, length
from rig.analysis.equations import Equations, Residuals, standardise

HUBER = 4.0
PRIOR = np.array([0.3, 2.0, 50.0, 0.0, 0.7])  # one is known exactly


class Linear:
    """Two sides whose residuals are linear in five unknowns."""

    def __init__(self, seed: int, noise: float = 0.5, outlier: float = 0.0) -> None:
        rng = np.random.default_rng(seed)
        self.unknowns = SimpleNamespace(sd=PRIOR)
        self.jacobian = {role: rng.normal(size=(12, 5)) for role in ("impact", "free")}
        self.sigma = {role: rng.uniform(0.5, 2.0, 12) for role in ("impact", "free")}
        true = PRIOR * rng.normal(size=5) * 0.5
        self.offset = {
            role: -slopes @ true + noise * self.sigma[role] * rng.normal(size=12)
            for role, slopes in self.jacobian.items()
        }
        self.offset["free"][3] += outlier

    def equations(self, role: str, x, match) -> Equations:
        residuals = self.offset[role] + self.jacobian[role] @ x
        sigma = self.sigma[role][match]
        ones = np.ones_like(sigma)
        left = Residuals(residuals[match], sigma, ones, ones > 0.0, ones < 0.0)
        return Equations(left, 0.0 * ones, self.jacobian[role][match], np.arange(5))

    def stacked(self) -> tuple[np.ndarray, np.ndarray]:
        """All rows in standard deviations: J/σ and r(0)/σ."""
        roles = ("impact", "free")
        sigma = np.concatenate([self.sigma[role] for role in roles])
        jacobian = np.concatenate([self.jacobian[role] for role in roles]) / sigma[:, None]
        return jacobian, np.concatenate([self.offset[role] for role in roles]) / sigma


ALL = {"impact": np.arange(12), "free": np.arange(12)}


def posterior(model: Linear) -> tuple[np.ndarray, np.ndarray]:
    """Bayes directly, in 40 digits: covariance (JᵀJ + P⁻¹)⁻¹, mean −C Jᵀr.

    What is known exactly is left out.
    """
    jacobian, offset = model.stacked()
    free = PRIOR > 0.0
    with mp.workdps(40):
        rows = mp.matrix(jacobian[:, free].tolist())
        prior = mp.diag([1 / mp.mpf(sd) ** 2 for sd in PRIOR[free].tolist()])
        inverse = (rows.T * rows + prior) ** -1
        centre = -inverse * (rows.T * mp.matrix(offset.tolist()))
        mean, covariance = np.zeros(5), np.zeros((5, 5))
        mean[free] = [float(value) for value in centre]
        covariance[np.ix_(free, free)] = np.array(inverse.tolist(), dtype=float)
    return mean, covariance


@pytest.mark.parametrize("seed", range(4))
def test_a_linear_problem_has_the_posterior_of_bayes(seed):
    model = Linear(seed)
    mean, covariance = posterior(model)
    found = adjust(model, ALL, PRIOR * 0.9)
    assert found.settled
    assert found.scatter == 1.0
    np.testing.assert_allclose(found.x, mean, rtol=1e-9, atol=1e-12)
    for gradient in np.eye(5):
        assert found.u(gradient) == pytest.approx(
            math.sqrt(gradient @ covariance @ gradient), rel=1e-10
        )


def test_fewer_matches_are_fewer_equations():
    model = Linear(1)
    some = {"impact": np.array([0, 5, 7]), "free": np.array([], dtype=int)}
    found = adjust(model, some, np.zeros(5))
    rows = model.jacobian["impact"][some["impact"]] / model.sigma["impact"][some["impact"], None]
    information = (rows * PRIOR).T @ (rows * PRIOR) + np.eye(5)
    np.testing.assert_allclose(found.root.T @ found.root, information, rtol=1e-12)
    nothing = adjust(model, {"impact": np.array([], dtype=int)}, PRIOR)
    assert not nothing.x.any()
    assert nothing.u(np.eye(5)[1]) == PRIOR[1]


def test_degrees_of_freedom_are_edges_less_what_they_determine():
    model = Linear(2)
    found = adjust(model, ALL, np.zeros(5))
    jacobian, offset = model.stacked()
    _, covariance = posterior(model)
    hat = jacobian @ covariance @ jacobian.T
    assert found.degrees == pytest.approx(24 - np.trace(hat), rel=1e-10)
    residuals = offset + jacobian @ found.x
    assert found.chi2 == pytest.approx(residuals @ residuals, rel=1e-6)


@pytest.mark.parametrize("outlier", [-60.0, 25.0, 1000.0])
def test_an_outlier_pulls_with_bounded_force(outlier):
    """At the optimum of Huber's loss its gradient is zero."""
    model = Linear(3, noise=0.1, outlier=outlier)
    found = adjust(model, ALL, np.zeros(5), done=1e-6)
    assert found.settled
    usual = adjust(model, ALL, np.zeros(5))
    assert usual.settled
    assert length(standardise(usual.x - found.x, usual.sd), usual.root) < DONE
    jacobian, offset = model.stacked()
    residuals = (offset + jacobian @ found.x) / found.scatter
    assert np.abs(residuals).max() > HUBER
    pull = jacobian.T @ np.clip(residuals, -HUBER, HUBER) / found.scatter
    force = PRIOR * pull + np.divide(found.x, PRIOR, out=np.zeros(5), where=PRIOR > 0.0)
    # The last step was shorter than 1e-6 standard uncertainties.
    assert np.abs(force).max() < 1e-6 * np.abs(found.root.T @ found.root).sum(axis=1).max()


@pytest.mark.parametrize("factor", [1.5, 3.0, 20.0])
def test_edges_that_scatter_more_count_less(factor):
    """What is left over, in the enlarged standard deviations, is what one expects."""
    model = Linear(4, noise=factor)
    jacobian, offset = model.stacked()
    found = adjust(model, ALL, np.zeros(5))
    assert found.settled
    assert factor / 1.6 < found.scatter < factor * 1.6
    residuals = (offset + jacobian @ found.x) / found.scatter
    assert 1 / 1.1 < math.sqrt(residuals @ residuals / found.degrees) < 1.05
    # The uncertainty is that of Bayes with all σ so enlarged.
    rows = jacobian[:, PRIOR > 0.0] / found.scatter
    covariance = np.linalg.inv(rows.T @ rows + np.diag(PRIOR[PRIOR > 0.0] ** -2.0))
    assert found.u(np.eye(5)[1]) == pytest.approx(math.sqrt(covariance[1, 1]), rel=1e-9)
