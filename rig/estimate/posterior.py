"""The posterior of the coefficients, with the protocol's own values as prior.

Given μ, everything else enters linearly, so that its posterior is normal; over μ it is a sum on
evenly spaced nodes, which for a smooth density that vanishes at both ends converges faster than
any power of their number. Nothing is drawn at random.
"""

import math
from typing import NamedTuple

import numpy as np

from rig.analysis.distributions import special
from rig.analysis.result import Measured
from rig.arrays import Array
from rig.estimate.coefficients import CoefficientProblem, best
from rig.estimate.hypothesis_fit import HypothesisFit, Parameter
from rig.model.impact import MU
from rig.protocol.protocol import Protocol

NODES = 41
_REACH = 6.0  # standard uncertainties on either side


class Posterior(NamedTuple):
    """A sum of normal distributions.

    Attributes
    ----------
    names
        Of the coefficients.
    weights
        Of each node, shape ``(nodes,)``.
    means, sds
        Shape ``(nodes, coefficients)``; where the coefficient is that of the nodes, the width of
        one node.
    """

    names: tuple[str, ...]
    weights: Array
    means: Array
    sds: Array

    def summary(self, name: str) -> dict[str, float]:
        """Moments, and the ends of the probabilistically symmetric interval of 95 %."""
        n = self.names.index(name)
        means, sds = self.means[:, n], self.sds[:, n]
        mean = float(self.weights @ means)
        sd = math.sqrt(float(self.weights @ (sds**2 + (means - mean) ** 2)))
        record = {"value": mean, "u": sd}
        for end, probability in (("low", 0.025), ("high", 0.975)):
            low, high = mean - 20.0 * sd, mean + 20.0 * sd
            while high - low > 1e-9 * sd and low < (middle := 0.5 * (low + high)) < high:
                below = float(self.weights @ special().ndtr((middle - means) / sds))
                low, high = (middle, high) if below < probability else (low, middle)
            record[end] = 0.5 * (low + high)
        return record


def posterior(protocol: Protocol, problem: CoefficientProblem, centre: HypothesisFit) -> Posterior:
    """Work the posterior out.

    Parameters
    ----------
    centre
        The least-squares fit of the same scene, around which the nodes lie.
    """
    priors = {
        name: Parameter(name, centre[name].value, (stated.value, stated.u) if stated.u else None)
        for name, stated in problem.stated.items()
    }
    names, prior = tuple(priors), priors[MU].prior if MU in priors else None
    grid = _nodes(centre[MU], prior) if MU in priors else np.zeros(0)
    # A node holds μ; what was known of it is counted below, not twice.
    nodes = [{MU: Parameter(MU, mu, (mu, 0.0))} for mu in grid.tolist()] or [{}]
    logs, estimates = [], []
    for node in nodes:
        at = best(protocol, problem, [*(priors | node).values()])
        off = (node[MU].start - prior[0]) / prior[1] if prior else 0.0
        logs.append(at.log_volume - 0.5 * (at.chi2 + off**2))
        estimates.append([(at[name].value, at[name].u) for name in names])
    weights = np.exp(np.array(logs) - max(logs))  # of the largest: no exponent overflows
    means, widths = np.moveaxis(np.reshape(estimates, (len(nodes), len(names), 2)), 2, 0)
    if MU in priors:
        widths[:, names.index(MU)] = 0.5 * (grid[1] - grid[0])
    return Posterior(names, weights / weights.sum(), means, widths)


def _nodes(measured: Measured, prior: tuple[float, float] | None) -> Array:
    """Return even nodes around what edges and prior say together; friction has no negative side."""
    values, us = np.transpose([(measured.value, measured.u), *([prior] if prior else ())])
    mean, sd = float(us**-2 @ values / (us**-2).sum()), float((us**-2).sum()) ** -0.5
    low = max(0.0, mean - _REACH * sd)
    return np.linspace(low, max(mean, low) + _REACH * sd, NODES)
