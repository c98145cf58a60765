"""Tables in the terminal, and the digits of numbers."""

import pytest

from rig.report.numbers import decimals_for, fixed, plus_minus
from rig.report.table import summary_table
from tests.report import fake_analysis


def test_summary_is_aligned() -> None:
    lines = summary_table(fake_analysis.two_chains()).splitlines()
    assert len(lines) == 9
    assert [word in lines[0] for word in ("incline (°)", "Δz ± U (cm)", "V ± U (m/s)", "Eₙ")]
    ends = {line.index("±", 20) for line in lines[2:]}
    assert len(ends) == 1


def test_gravity_summary() -> None:
    heading, _, line = summary_table(fake_analysis.gravity()).splitlines()
    assert "Δz" not in heading
    assert "9.8188 ± 0.0028" in line
    assert line.endswith("−0.42")


def test_no_summary() -> None:
    assert summary_table({"runs": []}) == "No accepted runs, so no summary."


@pytest.mark.parametrize(
    ("quantity", "text"),
    [
        ({"value": 0.123456, "U95": 0.00234}, "0.1235 ± 0.0023"),
        ({"value": -1.0, "U95": 0.0996}, "−1.00 ± 0.10"),
        ({"value": 5.0, "U95": 250.0}, "5 ± 250"),
        ({"value": 5.0}, "5.000"),
        ({"value": 5.0, "U95": 0.0}, "5.000 ± 0.000"),
        ({"value": None}, ""),
        ({"value": float("nan"), "U95": 1.0}, ""),
        (1, "1.000"),
        (None, ""),
    ],
)
def test_digits_follow_the_uncertainty(quantity: object, text: str) -> None:
    assert plus_minus(quantity) == text


def test_small_helpers() -> None:
    assert fixed(-0.0001, 2) == "0.00"
    assert [decimals_for(u) for u in (0.0094, 0.0096, 0.0996, 1.0, 9.96)] == [4, 4, 2, 1, 0]
