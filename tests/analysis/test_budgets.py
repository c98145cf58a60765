"""Where an uncertainty comes from, against dense algebra of all a drop's equations at once."""

import math

import numpy as np
import pytest

from rig.analysis.budgets import Budgets
from rig.analysis.drop import DropCase
from rig.analysis.joint_fit import by_itself
from rig.analysis.quantities import measurands
from tests.analysis.drops import FENCE, SINGLE, UNIFORM, case

SCENES = {"uniform": UNIFORM, "single": SINGLE, "fence": FENCE}


@pytest.mark.parametrize("scene", SCENES)
def test_each_line_is_what_its_source_adds(scene):
    """The estimate is −C(Jᵀr − x₀): linear in the edges r and in the prior means x₀."""
    protocol = SCENES[scene]
    one = case(protocol, incline=None if scene == "fence" else 40.0)
    fit = DropCase(one.protocol, one.run, one.drop, one.scale).read()[1]
    size, at = fit.x.size, fit.model.unknowns
    jacobian = np.zeros((0, size))
    for rows in fit.estimate.rows.values():
        whole = np.zeros((rows.left.size, size))
        whole[:, rows.columns] = rows.slopes * at.sd[rows.columns]
        jacobian = np.vstack([jacobian, whole])
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(size))
    joint = by_itself(fit)
    for name, found in Budgets(joint).measure_all(joint.drops[0]).items():
        gradient = measurands(fit.model, fit.x)[name].slopes * at.sd
        influence = covariance @ gradient
        lines = {
            line: math.sqrt(sum(float(np.sum(influence[block] ** 2)) for block in blocks))
            for line, blocks in at.groups.items()
        }
        lines["edges"] = math.hypot(lines["edges"], float(np.linalg.norm(jacobian @ influence)))
        assert found.u == pytest.approx(math.sqrt(gradient @ influence), rel=1e-6)
        assert found.u == pytest.approx(fit.estimate.u(gradient / at.sd.clip(1e-99)), rel=1e-9)
        assert found.u == pytest.approx(math.hypot(*found.budget.values()), rel=1e-12)
        for line, part in lines.items():
            assert found.budget.get(line, 0.0) == pytest.approx(part, rel=1e-5, abs=1e-6 * found.u)
