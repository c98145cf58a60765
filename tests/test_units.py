import math
import warnings

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.units import DIMENSIONS, UNITS, Quantity, UnitError, format_quantity, parse, significant
from tests.refusals import refused
from tests.tables import cases

PINT_NAMES = {"1": "", "%": "percent", "deg": "degree"}
BASES = ("m", "s", "degree", "m/s^2", "m/s", "kg", "kg/m^3", "Hz", "rad/s", "")
FINITE = st.floats(min_value=-1e12, max_value=1e12, allow_nan=False)


@cases
def test_significant_digits_need_no_exponent(value, text):
    assert significant(value) == text


@pytest.fixture(scope="module")
def registry():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import pint

        return pint.UnitRegistry()


@pytest.mark.parametrize(("dimension", "base"), [*zip(DIMENSIONS, BASES, strict=True)])
def test_every_unit_agrees_with_pint(registry, dimension, base):
    for unit in DIMENSIONS[dimension].factors:
        oracle = registry.Quantity(3.7, PINT_NAMES.get(unit, unit)).to(base).magnitude
        assert parse(f"3.7 {unit}", DIMENSIONS[dimension]).value == pytest.approx(oracle, rel=1e-14)


@cases
def test_quantities_are_read_to_the_last_bit(text, dimension, value, u):
    assert parse(text, DIMENSIONS[dimension]) == Quantity(value, u)


@cases
def test_what_is_refused_and_how(text, dimension, said):
    error = str(refused(UnitError, "", parse, text, DIMENSIONS[dimension]))
    assert said in error
    assert "\n" not in error


@given(FINITE, st.sampled_from(["m", "1", "deg", "s", "kg"]))
def test_base_units_round_trip_exactly(value, unit):
    assert parse(f"{value!r} {unit}", UNITS[unit][0]).value == value


@given(st.decimals(min_value=-1000, max_value=1000, places=3))
def test_scaling_is_correctly_rounded(number):
    assert parse(f"{number} mm", DIMENSIONS["LENGTH"]).value == float(number.scaleb(-3))


@given(FINITE, st.floats(min_value=1e-9, max_value=1e6), st.sampled_from(list(UNITS)))
def test_what_is_formatted_can_be_read_again(value, u, unit):
    factor = float(UNITS[unit][1])
    again = parse(format_quantity(Quantity(value * factor, u * factor), unit), UNITS[unit][0])
    assert again.u == pytest.approx(u * factor, rel=0.051)
    assert again.value == pytest.approx(value * factor, abs=0.051 * u * factor, rel=1e-12)


@given(st.text(), st.sampled_from([*DIMENSIONS]))
def test_any_text_is_a_quantity_or_a_unit_error(text, dimension):
    said, quantity = "one line", Quantity(0.0)
    try:
        quantity = parse(text, DIMENSIONS[dimension])
    except UnitError as error:
        said = str(error)
    assert len(said.splitlines()) == 1
    assert math.isfinite(quantity.value)
    assert quantity.u >= 0


@cases
def test_formatting(quantity, unit, text):
    assert format_quantity(Quantity(*quantity), unit) == text
