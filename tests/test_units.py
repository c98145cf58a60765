import math
import warnings

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.units import DIMENSIONS, UNITS, Quantity, UnitError, format_quantity, parse, significant

PINT_NAMES = {"1": "", "%": "percent", "deg": "degree"}
BASES = ("m", "s", "degree", "m/s^2", "m/s", "kg", "kg/m^3", "Hz", "rad/s", "")
FINITE = st.floats(min_value=-1e12, max_value=1e12, allow_nan=False)


def read(text, dimension):
    return parse(text, DIMENSIONS[dimension])


@pytest.mark.parametrize(
    ("value", "text"),
    [(123.4, "120"), (0.0000123, "0.000012"), (-1.25, "-1.2"), (99.6, "100"), (0.0, "0")],
)
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
        assert read(f"3.7 {unit}", dimension).value == pytest.approx(oracle, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "dimension", "value", "u"),
    [
        ("180 mm", "LENGTH", 0.18, 0.0),
        ("180 ± 2 mm", "LENGTH", 0.18, 0.002),
        ("180 mm ± 2 mm", "LENGTH", 0.18, 0.002),
        ("1.2 m ± 2 mm", "LENGTH", 1.2, 0.002),
        ("1.2 m +/- 0.2 cm", "LENGTH", 1.2, 0.002),
        ("180+-2mm", "LENGTH", 0.18, 0.002),
        ("(180 ± 2) mm", "LENGTH", 0.18, 0.002),
        ("180(2) mm", "LENGTH", 0.18, 0.002),
        ("1.165(12) m", "LENGTH", 1.165, 0.012),
        ("48.5 mm", "LENGTH", 0.0485, 0.0),
        ("−3.5e1 um", "LENGTH", -3.5e-5, 0.0),
        ("12 µm", "LENGTH", 1.2e-5, 0.0),
        ("12 μm", "LENGTH", 1.2e-5, 0.0),
        ("0.50 ± 0.05", "NUMBER", 0.5, 0.05),
        ("5 %", "NUMBER", 0.05, 0.0),
        ("50 % ± 5 %", "NUMBER", 0.5, 0.05),
        (0.25, "NUMBER", 0.25, 0.0),
        (3, "NUMBER", 3.0, 0.0),
        ("40°", "ANGLE", 40.0, 0.0),
        ("9.81 m/s²", "ACCELERATION", 9.81, 0.0),
        ("9.81 m / s2", "ACCELERATION", 9.81, 0.0),
        ("1.2 kg/m³", "DENSITY", 1.2, 0.0),
        ("90 km/h", "SPEED", 25.0, 0.0),
    ],
)
def test_quantities_are_read_to_the_last_bit(text, dimension, value, u):
    assert read(text, dimension) == Quantity(value, u)


@pytest.mark.parametrize(
    ("text", "dimension", "said"),
    [
        ("30 cm", "TIME", "30 cm is a length; accepted: a time, such as 80 ms"),
        ("25", "LENGTH", "without a unit; a length is written in m, mm"),
        (25, "LENGTH", "without a unit"),
        ("25 MM", "LENGTH", "did you mean mm?"),
        ("25 degrees", "ANGLE", "did you mean deg?"),
        ("nan", "NUMBER", "found 'nan'"),
        (math.inf, "NUMBER", "found 'inf'"),
        (True, "NUMBER", "found 'True'"),
        ("1e999 m", "LENGTH", "too large or too small"),
        ("1e-999 m", "LENGTH", "too large or too small"),
        ("1e99999999999999999999 m", "LENGTH", "too large or too small"),
        ("5 mm ± -1 mm", "LENGTH", "at least 0"),
        ("5 mm ± 1", "LENGTH", "needs a unit too"),
        ("5 mm ± 1 ms", "LENGTH", "is a time"),
        ("5 mm ± 2 %", "LENGTH", "is a plain number"),
        ("0.5 ± 10 %", "NUMBER", "two meanings"),
        ("5(1) ± 1 mm", "LENGTH", "two uncertainties"),
        ("18(0 ± 1) mm", "LENGTH", "found '18(0 ± 1) mm'"),
        ("15,0 cm", "LENGTH", "not a comma: 15.0 cm"),
        ("1,5 ± 0,2 cm", "LENGTH", "not a comma: 1.5 ± 0.2 cm"),
        ("(1,5 ± 0,2) cm", "LENGTH", "not a comma: (1.5 ± 0.2) cm"),
        ("", "LENGTH", "found ''"),
        ("9" * 101, "NUMBER", "101 characters"),
    ],
)
def test_what_is_refused_and_how(text, dimension, said):
    with pytest.raises(UnitError) as caught:
        read(text, dimension)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@given(FINITE, st.sampled_from(["m", "1", "deg", "s", "kg"]))
def test_base_units_round_trip_exactly(value, unit):
    assert parse(f"{value!r} {unit}", UNITS[unit][0]).value == value


@given(st.decimals(min_value=-1000, max_value=1000, places=3))
def test_scaling_is_correctly_rounded(number):
    assert read(f"{number} mm", "LENGTH").value == float(number.scaleb(-3))


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
        quantity = read(text, dimension)
    except UnitError as error:
        said = str(error)
    assert len(said.splitlines()) == 1
    assert math.isfinite(quantity.value)
    assert quantity.u >= 0


@pytest.mark.parametrize(
    ("quantity", "unit", "text"),
    [
        (Quantity(0.18, 0.002), "mm", "180.0 ± 2.0 mm"),
        (Quantity(0.5, 0.0996), "1", "0.50 ± 0.10"),
        (Quantity(1234, 250), "m", "1230 ± 250 m"),
        (Quantity(0.0485), "mm", "48.5 mm"),
        (Quantity(0.05, 0.01), "%", "(5.0 ± 1.0) %"),
        (Quantity(math.nan), "m", "nan m"),
    ],
)
def test_formatting(quantity, unit, text):
    assert format_quantity(quantity, unit) == text
