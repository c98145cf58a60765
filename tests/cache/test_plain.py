"""Plain records as text and back, to the last bit."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.analysis.result import Measured
from rig.cache.plain import from_text, to_text
from rig.clock.calibration import TimeScale
from rig.reasons import plain_reason
from tests.examples import examples
from tests.refusals import refused
from tests.tables import cases

SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
KEYS = st.text() | st.integers() | st.tuples(st.integers(), st.integers())
RECORDS = st.recursive(
    SCALARS
    | st.builds(TimeScale, st.floats(allow_nan=False), st.floats(allow_nan=False))
    | st.builds(plain_reason, st.text()),
    lambda inner: (
        st.lists(inner)
        | st.lists(inner).map(tuple)
        | st.dictionaries(KEYS, inner)
        | st.builds(Measured, SCALARS, SCALARS, SCALARS, st.dictionaries(KEYS, inner))
    ),
)


class Stranger(NamedTuple):
    value: int


def same(one, other):
    assert type(one) is type(other)
    if isinstance(one, list | tuple):
        assert len(one) == len(other)
        for mine, its in zip(one, other, strict=True):
            same(mine, its)
    elif isinstance(one, dict):
        same([*one], [*other])
        same([*one.values()], [*other.values()])
    elif isinstance(one, float):
        assert (one, math.copysign(1.0, one)) == (other, math.copysign(1.0, other))
    else:
        assert one == other


@examples(40)
@given(RECORDS)
def test_what_is_read_is_what_was_written(record):
    same(from_text(to_text(record)), record)


def test_numbers_that_json_lacks():
    assert math.isnan(from_text(to_text(math.nan)))
    assert type(from_text(to_text(np.float64(0.1)))) is float


@pytest.mark.parametrize("dtype", ["f8", "i8", "?"])
def test_arrays(dtype):
    array = np.arange(12).reshape(3, 4).astype(dtype).T
    other = from_text(to_text(array))
    assert other.dtype == array.dtype
    assert np.array_equal(other, array)
    other[0] = 0  # writable


def test_what_no_comparison_sees_is_left_out():
    assert from_text(to_text(Measured(1.0, 2.0, shared=np.ones(3)))).shared is None


@pytest.mark.parametrize("record", [Path(), object(), Stranger(1), {1, 2}, b"x", 1j])
def test_what_is_no_plain_record_is_not_written(record):
    refused(TypeError, "", to_text, [record])


@cases
def test_what_is_no_kept_text_is_refused(text):
    refused(ValueError, r".", from_text, text)
