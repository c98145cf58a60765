"""Columns of a table in a terminal."""

from rig.text_table import text_table
from tests.refusals import refused


def test_signs_stand_under_each_other_whatever_stands_behind():
    heading, rule, *lines = text_table([["Δz ± U"], ["1.5 ± 0.12"], ["−0.25 ± 3"], [""]], rule=True)
    assert heading.endswith("Δz ± U")
    assert set(rule) == {"─"}
    assert lines[0].index("±") == lines[1].index("±")
    assert lines[2] == ""


def test_rows_of_other_lengths_are_refused():
    refused(ValueError, "zip", text_table, [["a", "b"], ["1"]])
