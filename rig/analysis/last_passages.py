"""V and Δz from the last passages alone: a cross-check without a model of impacts.

Once every rod below has struck, the top rod falls freely. The equations of its last edges and of
the free chain are solved without all other edges. α and the release times have no prior, so that
here they only stand for time and speed at the end of the fall.
"""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from rig.analysis.annealing import matched
from rig.analysis.chain_records import SIDES
from rig.analysis.fit import Fit
from rig.analysis.quantities import COMPUTED, AdjustedDrop
from rig.analysis.result import Measured
from rig.analysis.square_root import square_root
from rig.measurands import MEASURANDS
from rig.reasons import Reason, make_reason

APART = 3.0
"""Standard uncertainties beyond which two values differ: by chance in 1 of 370."""
CODES = {"speed_m_s": "last_speed_differs", "separation_raw_m": "last_separation_differs"}
"""Code of the reason that each quantity by the last passages differs, by JSON name."""


def last_passages(fit: Fit) -> dict[str, Measured]:
    """Return V and the raw Δz at the contact level from the last passages, by JSON name.

    Empty for fewer than two last edges of the top rod, and without Δz if there is no free chain.
    """
    model, estimate = fit.model, fit.estimate
    if "impact" not in model.records:
        return {}
    rows, sd = estimate.rows["impact"], estimate.sd
    last = model.expected["impact"].alone[matched(fit.matches["impact"])[0]]
    if last.sum() < SIDES:
        return {}
    end = rows._replace(slopes=rows.slopes[last], left=rows.left[last])
    root = square_root(
        [*{**estimate.rows, "impact": end}.values()], sd, model.unknowns.pull(estimate.x)
    )
    step, drop, values = root.step(), AdjustedDrop(model, estimate.x), dict[str, Measured]()
    for name in CODES:
        value = COMPUTED[name](drop)
        if value is not None:
            slopes = value.slopes * sd
            u = float(np.linalg.norm(np.linalg.solve(root.matrix.T, slopes)))
            values[name] = Measured(float(value.value + slopes @ step), u)
    return values


def disagreements(
    fitted: Mapping[str, Measured], direct: Mapping[str, Measured]
) -> Iterator[Reason]:
    """Yield reasons for values of the last passages that differ from those of the fit."""
    for name in [name for name in CODES if name in fitted and name in direct]:
        whole, alone = fitted[name], direct[name]
        # Both share the errors of the last edges, so that this limit is conservative.
        if abs(whole.value - alone.value) > APART * math.hypot(whole.u, alone.u):
            unit = name.removeprefix(MEASURANDS[name].stem)
            values = {f"alone{unit}": alone.value, f"whole{unit}": whole.value}
            values |= {"alone_U95": alone.expanded, "whole_U95": whole.expanded}
            yield make_reason(CODES[name], **values)
