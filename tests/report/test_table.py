"""Tables in the terminal and on the page, and the digits of numbers."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import pytest

from rig.analysis.result import Measured
from rig.measurands import SEPARATION
from rig.report.columns import table_parts, value_at
from rig.report.finding import clock_lines
from rig.report.numbers import decimals_for, fixed, plus_minus
from rig.report.parts import summary_table, tables
from rig.units import Quantity
from tests.report import fake_analysis
from tests.tables import cases


def test_zero_has_no_sign_and_an_uncertainty_two_digits() -> None:
    assert fixed(-0.0001, 2) == "0.00"
    assert [decimals_for(u) for u in (0.0096, 0.0996, 1.0, 9.96)] == [4, 2, 1, 0]


def test_summary_is_aligned() -> None:
    blocks = summary_table(fake_analysis.two_chains().summary).split("\n\n")
    for block, measured in zip(blocks, ("Δz ± U (cm)", "V ± U (m/s)"), strict=True):
        head, rule, *lines = block.splitlines()
        assert len(lines) == 7
        assert all(word in head for word in ("incline (°)", measured, "predicted ± U", "Eₙ"))
        assert len({line.index("±", 12) for line in lines}) == 1
        assert max(map(len, (head, rule, *lines))) <= 80


NUMBERS = {
    "expanded": lambda value, expanded: SimpleNamespace(value=value, expanded=expanded),
    "measured": Measured,
    "quantity": Quantity,
    "plain": lambda number: number,
}


@cases
def test_digits_follow_the_uncertainty(kind: str, numbers: list[float], text: str) -> None:
    assert plus_minus(NUMBERS[kind](*numbers)) == text


def test_where_nothing_is_struck_nothing_is_inclined() -> None:
    fence = fake_analysis.gravity()
    assert "incline" not in summary_table(fence.summary)
    void = replace(fence.runs[0], verdict="void", quantities={})
    (part,) = tables("runs", [void, fence.runs[1]])
    assert not {"incline (°)", "impact chain"} & {heading for heading, _ in part.head}
    (part,) = tables("runs", fake_analysis.two_chains().runs)
    assert "incline" in part.table[0]


def test_the_clock_is_told_in_plain_numbers() -> None:
    pings = {"source": "pings", "pings": 6, "rate_ppm": -1214.6, "notes": []}
    (line,) = clock_lines({**pings, "u_ppm": 74.0})
    assert line == "Board clock: 1215 ppm slow, corrected (± 148 ppm)."
    (line,) = clock_lines({**pings, "u_ppm": 0.00049})
    assert "(± 0.0010 ppm)" in line


def test_a_column_is_never_left_out_because_its_value_has_another_name():
    record = {"session": "a", "line": SimpleNamespace(n=3, means={})}
    sessions = partial(table_parts, "sessions", derived={"runs": lambda _: ""}, row=SEPARATION)
    (part,) = sessions([record])
    assert [heading for heading, _ in part.head] == ["session", "n"]
    with pytest.raises(KeyError, match="session"):
        [*sessions([{"name": "a", "line": record["line"]}])]
    record["line"] = SimpleNamespace(number=3, means={})
    with pytest.raises(AttributeError, match="'n'"):
        [*sessions([record])]


def test_a_place_may_lead_to_nothing():
    assert value_at((None, 1), "0.alpha") is None
    assert value_at(SimpleNamespace(means={}), "means.separation_m.value") is None
    assert value_at({}, "impact_chain?") is None


def test_a_prior_may_move_what_strikes_with_either_chain_alike():
    move = {"prior": "drag", "incline_deg": 40.0, "quantity": "speed_m_s", "wider": 1e-5}
    move |= {"narrower": 0.0, "U95_ratio_wider": 1.0, "U95_ratio_narrower": 1.02}
    (part,) = tables("priors", [move])
    assert part.rows == [("drag", "40", "V (mm/s)", "0.01", "0.00", "× 1.00", "× 1.02")]
