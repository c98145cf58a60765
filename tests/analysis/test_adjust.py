"""An outlier pulls with bounded force: against the gradient of Huber's loss written directly."""

from types import SimpleNamespace

import numpy as np
import pytest

from rig.analysis.adjust import DONE, adjust, length
from rig.analysis.equations import Equations, Residuals, standardise

HUBER = 4.0
PRIOR = np.array([0.3, 2.0, 50.0, 0.0, 0.7])  # one is known exactly


class Linear:
    """Two sides whose residuals are linear in five unknowns."""

    def __init__(self, seed: int, noise: float = 0.5, outlier: float = 0.0) -> None:
        rng = np.random.default_rng(seed)
        self.unknowns = SimpleNamespace(sd=PRIOR, flat=np.zeros(5, np.bool_))
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

    def stacked(self, matches: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """The matched rows in standard deviations: J/σ and r(0)/σ."""
        sigma, jacobian, offset = (
            np.concatenate([rows[role][match] for role, match in matches.items()])
            for rows in (self.sigma, self.jacobian, self.offset)
        )
        return jacobian / sigma[:, None], offset / sigma


ALL = {"impact": np.arange(12), "free": np.arange(12)}


@pytest.mark.parametrize("outlier", [-60.0, 25.0, 1000.0])
def test_an_outlier_pulls_with_bounded_force(outlier):
    """At the optimum of Huber's loss its gradient is zero."""
    model = Linear(3, noise=0.1, outlier=outlier)
    found = adjust(model, ALL, np.zeros(5), done=1e-6)
    assert found.settled
    usual = adjust(model, ALL, np.zeros(5))
    assert usual.settled
    assert length(standardise(usual.x - found.x, usual.sd), usual.root) < DONE
    jacobian, offset = model.stacked(ALL)
    residuals = (offset + jacobian @ found.x) / found.scatter
    assert np.abs(residuals).max() > HUBER
    pull = jacobian.T @ np.clip(residuals, -HUBER, HUBER) / found.scatter
    force = PRIOR * pull + np.divide(found.x, PRIOR, out=np.zeros(5), where=PRIOR > 0.0)
    # The last step was shorter than 1e-6 standard uncertainties.
    assert np.abs(force).max() < 1e-6 * np.abs(found.root.T @ found.root).sum(axis=1).max()
