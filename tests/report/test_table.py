"""Tables in the terminal and on the page, and the digits of numbers."""

from functools import partial
from types import SimpleNamespace

from rig.analysis.result import Measured
from rig.measurands import SEPARATION
from rig.report.columns import table_parts, value_at
from rig.report.numbers import decimals_for, fixed, plus_minus
from rig.text_table import text_table
from rig.units import Quantity
from tests.refusals import refused
from tests.tables import cases


def test_zero_has_no_sign_and_an_uncertainty_two_digits() -> None:
    assert fixed(-0.0001, 2) == "0.00"
    assert [decimals_for(u) for u in (0.0096, 0.0996, 1.0, 9.96)] == [4, 2, 1, 0]


NUMBERS = {
    "expanded": lambda value, expanded: SimpleNamespace(value=value, expanded=expanded),
    "measured": Measured,
    "quantity": Quantity,
    "plain": lambda number: number,
}


@cases
def test_digits_follow_the_uncertainty(kind: str, numbers: list[float], text: str) -> None:
    assert plus_minus(NUMBERS[kind](*numbers)) == text


def test_a_column_is_never_left_out_because_its_value_has_another_name():
    record = {"session": "a", "line": SimpleNamespace(n=3, means={})}
    sessions = partial(table_parts, "sessions", derived={"runs": lambda _: ""}, row=SEPARATION)
    (part,) = sessions([record])
    assert [heading for heading, _ in part.head] == ["session", "n"]
    refused(KeyError, "session", list, sessions([{"name": "a", "line": record["line"]}]))
    record["line"] = SimpleNamespace(number=3, means={})
    refused(AttributeError, "'n'", list, sessions([record]))


def test_a_place_may_lead_to_nothing():
    assert value_at((None, 1), "0.alpha") is None
    assert value_at(SimpleNamespace(means={}), "means.separation_m.value") is None
    assert value_at({}, "impact_chain?") is None


def test_signs_stand_under_each_other_whatever_stands_behind():
    heading, rule, *lines = text_table([["Δz ± U"], ["1.5 ± 0.12"], ["−0.25 ± 3"], [""]], rule=True)
    assert heading.endswith("Δz ± U")
    assert set(rule) == {"─"}
    assert lines[0].index("±") == lines[1].index("±")
    assert lines[2] == ""


def test_rows_of_other_lengths_are_refused():
    refused(ValueError, "zip", text_table, [["a", "b"], ["1"]])
