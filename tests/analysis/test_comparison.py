"""What is measured less what is predicted: one difference, with one covariance."""

import math
from dataclasses import replace

import pytest

from rig.analysis.comparison import compare
from rig.analysis.curves import model_curves
from rig.analysis.distributions import coverage_factor
from rig.analysis.result import Deviation, Measured, good_runs
from rig.units import Quantity
from tests.analysis.drops import UNIFORM
from tests.analysis.test_summary import results
from tests.estimate.sessions import analysis

Z = 1.959963984540054
EXACT = replace(
    UNIFORM,
    surface=replace(
        UNIFORM.surface,
        restitution=Quantity(UNIFORM.surface.restitution.value),
        friction=Quantity(UNIFORM.surface.friction.value),
    ),
)


def differing(scatter: float, values: list[float]) -> list[Measured]:
    """Values measured exactly, of falls that are foretold to scatter so much."""
    return [Measured(x, 0.0, deviation=Deviation(scatter**2, math.inf, (0.0,), (0.0,)))
            for x in values]  # fmt: skip


def compared(values: list[Measured]):
    drops = results(EXACT, {40.0: [0.0] * len(values)})
    drops = [replace(drop, quantities={"separation_m": one})
             for drop, one in zip(drops, values, strict=True)]  # fmt: skip
    (comparison,) = compare(EXACT, good_runs(drops))
    return comparison.differences[0]


def test_one_fall_is_off_by_its_own_scatter_and_n_by_its_share_but_by_no_less_than_is_seen():
    model = 0.11546810526538031
    assert compared(differing(0.002, [model + 0.002])).u == pytest.approx(0.002, rel=1e-9)
    assert compared(differing(0.002, [model])).value == pytest.approx(0.0, abs=1e-12)
    # Four that scatter as foretold: their standard deviation is 2 mm.
    step = 0.002 * math.sqrt(3.0) / 2.0
    four = compared(differing(0.002, [model + way * step for way in (-1, -1, 1, 1)]))
    # 8 degrees of freedom are foretold and 3 seen: the scale's are 11²/3, see GUM G.4.
    widened = coverage_factor(11.0**2 / 3.0) / Z
    assert four.u == pytest.approx(0.001 * widened, rel=2e-6)
    # Ten times more than is foretold is believed.
    wild = [model + 0.02 * way for way in (-1, -1, 1, 1)]
    assert compared(differing(0.002, wild)).u > 4.0 * 0.001


def test_drops_of_unlike_fits_share_what_is_common_to_each():
    model = 0.11546810526538031
    kinds = [Deviation(4e-6, math.inf, plus, minus)
             for plus, minus in (((3e-3,), (0.0,)), ((3e-3, 4e-3), (0.0, 4e-3)))]  # fmt: skip
    each = [compared([Measured(model, 0.0, deviation=kind)]) for kind in kinds]
    both = compared([Measured(model, 0.0, deviation=kind) for kind in kinds])
    assert [one.u for one in each] == pytest.approx([math.sqrt(13e-6)] * 2)
    # 8 degrees of freedom are foretold, and 1 is seen, without any scatter.
    own = 2e-6 * 8.0 / 9.0 * (coverage_factor(81.0) / Z) ** 2
    assert both.u == pytest.approx(math.sqrt(9e-6 + own), rel=2e-6)


def test_what_the_protocol_states_of_coefficients_counts_once():
    """Against a model that is wrong by its own β, many inclines are no more than one."""
    found = analysis((30.0, 50.0, 70.0))
    whole = {one.quantity: one for one in compare(UNIFORM, good_runs(found.runs))}
    assert set(whole) == {"separation_m", "speed_m_s"}
    for one in whole.values():
        assert one.degrees == 3
        assert one.chi2 != pytest.approx(sum(line.chi2 for line in one.differences), rel=0.01)
        half = one.chi2 / 2.0
        tail = math.erfc(math.sqrt(half)) + 2.0 * math.sqrt(half / math.pi) * math.exp(-half)
        assert one.p == pytest.approx(tail, rel=1e-9)  # of χ² with three degrees of freedom
    # Of the summary's lines each has the same difference, whatever else is compared.
    for line in found.summary:
        (other,) = [
            one for one in whole["speed_m_s"].differences if one.condition == line.condition
        ]
        assert line.differences["speed_m_s"] == other


def test_curves_of_exact_coefficients_have_no_width():
    known = replace(EXACT, drop=Quantity(0.18), gravity=Quantity(9.81))
    curves = model_curves(replace(known, surface=replace(EXACT.surface, pile=None)))
    assert {*curves["separation_U95_m"], *curves["speed_U95_m_s"]} == {0.0}
