"""Tables of effects, for the page and the terminal."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from rig.measurands import SEPARATION
from rig.report.columns import table_parts, value_at
from rig.report.parts import tables


def test_a_column_is_never_left_out_because_its_value_has_another_name():
    record = {"session": "a", "runs": "", "line": SimpleNamespace(n=3, means={})}
    (part,) = table_parts("sessions", [record], row=SEPARATION)
    assert [heading for heading, _ in part.head] == ["session", "n"]
    renamed = {"session": "a", "kinds": "", "line": record["line"]}
    with pytest.raises(KeyError, match="runs"):
        [*table_parts("sessions", [renamed], row=SEPARATION)]
    record["line"] = SimpleNamespace(number=3, means={})
    with pytest.raises(AttributeError, match="'n'"):
        [*table_parts("sessions", [record], row=SEPARATION)]


def test_a_place_may_lead_to_nothing():
    assert value_at((None, 1), "0.alpha") is None
    assert value_at(SimpleNamespace(means={}), "means.separation_m.value") is None
    assert value_at({}, "impact_chain?") is None


def test_a_prior_may_move_what_strikes_with_either_chain_alike():
    move = {"prior": "drag", "incline_deg": 40.0, "quantity": "speed_m_s", "wider": 1e-5}
    move |= {"narrower": 0.0, "U95_ratio_wider": 1.0, "U95_ratio_narrower": 1.02}
    (part,) = tables("priors", [move])
    assert part.rows == [("drag", "40", "V (mm/s)", "0.01", "0.00", "× 1.00", "× 1.02")]
