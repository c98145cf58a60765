"""What stands behind ``--vary``."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import InputError
from rig.sweep.layout import linspace, read_vary
from rig.sweep.variables import VARIABLES
from tests.tables import cases

NAMES = tuple(VARIABLES)
SPACES = st.sampled_from(["", " ", "  "])


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.integers(2, 40), st.lists(SPACES, min_size=5))
def test_a_range_is_read_as_written(one, other, count, spaces):
    low, high = sorted((one, other))
    if low == high:
        low, high = -1.0, 1.0
    parts = ["restitution", "=", repr(low), "..", repr(high), ":", str(count)]
    for place, space in enumerate(spaces[:4]):
        parts[2 * place] = f"{space}{parts[2 * place]}{spaces[-1]}"
    assert read_vary(["".join(parts)], NAMES) == {"restitution": linspace(low, high, count)}


@given(st.text(alphabet="restiuon=.:0123456789-e mdg±", max_size=30))
def test_any_text_is_read_or_refused_in_one_line(text):
    try:
        found = read_vary([text], NAMES)
    except InputError as error:
        problem = error.message
    else:
        assert all(len(values) > 1 for values in found.values())
        return
    assert len(problem.splitlines()) == 1


def test_units_lead_to_si_and_degrees():
    found = read_vary(["drop=100mm..300 mm:3", "incline=0deg..80deg:3", "friction=0.1"], NAMES)
    assert found == {"drop": (0.1, 0.2, 0.3), "incline": (0.0, 40.0, 80.0), "friction": (0.1,)}
    assert list(found) == ["drop", "incline", "friction"]


@cases
def test_a_fault_is_told_at_its_column(text, column, said):
    with pytest.raises(InputError) as caught:
        read_vary([text], NAMES)
    assert caught.value.exit_code == 2
    assert f", column {column}: " in caught.value.message
    assert said in caught.value.message


def test_all_faults_are_told_at_once():
    with pytest.raises(InputError) as caught:
        read_vary(["drop=1", "friction=0..0.5:3", "friction=0.1", "mu=1"], NAMES)
    first, second, third = caught.value.message.splitlines()
    assert "'drop=1'" in first
    assert "given twice" in second
    assert "'mu=1'" in third


def test_something_must_vary():
    with pytest.raises(InputError, match="nothing is varied"):
        read_vary(["friction=0.1"], NAMES)
