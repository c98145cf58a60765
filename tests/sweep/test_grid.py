"""Grids: evenly spaced values, and pieces that leave nothing out."""

from __future__ import annotations

from decimal import Decimal

from hypothesis import given
from hypothesis import strategies as st

from rig.sweep.layout import Axis, Grid, spaced

FINITE = st.floats(-1e6, 1e6)
LEAST = Decimal("5e-324")


@given(st.lists(st.integers(1, 5), min_size=1, max_size=4), st.integers(1, 300))
def test_pieces_are_the_points_in_order(lengths, length):
    grid = Grid(tuple(Axis("drop", (0.1,) * each) for each in lengths))
    chunks = list(grid.chunks(length))
    assert [point for chunk in chunks for point in chunk] == list(range(grid.size))
    assert all(len(chunk) == length for chunk in chunks[:-1])
    assert 0 < len(chunks[-1]) <= length


@given(FINITE, FINITE, st.integers(2, 50))
def test_values_go_from_end_to_end_in_even_steps(one, other, count):
    low, high = sorted((one, other))
    values = spaced(low, high, count)
    assert len(values) == count
    assert (values[0], values[-1]) == (low, high)
    assert list(values) == sorted(values)
    size = max(abs(low), abs(high))
    start, end = Decimal(repr(low)), Decimal(repr(high))
    for number, value in enumerate(values):
        exact = start + (end - start) * number / (count - 1)
        assert abs(Decimal(value) - exact) <= Decimal(size) * Decimal(2) ** -53 + LEAST


def test_values_are_those_a_person_writes():
    assert spaced(0.0, 0.9, 10) == (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
    assert spaced(0.0, 80.0, 81) == tuple(map(float, range(81)))
