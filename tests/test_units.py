import math
import warnings

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.units import UNITS, Dimension, Quantity, UnitError, format_quantity, parse, significant

PINT_NAMES = {"1": "", "%": "percent", "deg": "degree"}
BASES = {
    Dimension.LENGTH: "m",
    Dimension.TIME: "s",
    Dimension.ANGLE: "degree",
    Dimension.ACCELERATION: "m/s^2",
    Dimension.SPEED: "m/s",
    Dimension.MASS: "kg",
    Dimension.DENSITY: "kg/m^3",
    Dimension.FREQUENCY: "Hz",
    Dimension.TURNING: "rad/s",
    Dimension.NUMBER: "",
}
FINITE = st.floats(min_value=-1e12, max_value=1e12, allow_nan=False)


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


@pytest.mark.parametrize("unit", UNITS)
def test_every_unit_agrees_with_pint(registry, unit):
    dimension = UNITS[unit][0]
    oracle = registry.Quantity(3.7, PINT_NAMES.get(unit, unit)).to(BASES[dimension]).magnitude
    assert parse(f"3.7 {unit}", dimension).value == pytest.approx(oracle, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "dimension", "value", "u"),
    [
        ("180 mm", Dimension.LENGTH, 0.18, 0.0),
        ("180 ± 2 mm", Dimension.LENGTH, 0.18, 0.002),
        ("180 mm ± 2 mm", Dimension.LENGTH, 0.18, 0.002),
        ("1.2 m ± 2 mm", Dimension.LENGTH, 1.2, 0.002),
        ("1.2 m +/- 0.2 cm", Dimension.LENGTH, 1.2, 0.002),
        ("180+-2mm", Dimension.LENGTH, 0.18, 0.002),
        ("(180 ± 2) mm", Dimension.LENGTH, 0.18, 0.002),
        ("180(2) mm", Dimension.LENGTH, 0.18, 0.002),
        ("1.165(12) m", Dimension.LENGTH, 1.165, 0.012),
        ("48.5 mm", Dimension.LENGTH, 0.0485, 0.0),
        ("−3.5e1 um", Dimension.LENGTH, -3.5e-5, 0.0),
        ("12 µm", Dimension.LENGTH, 1.2e-5, 0.0),
        ("12 μm", Dimension.LENGTH, 1.2e-5, 0.0),
        ("0.50 ± 0.05", Dimension.NUMBER, 0.5, 0.05),
        ("5 %", Dimension.NUMBER, 0.05, 0.0),
        ("50 % ± 5 %", Dimension.NUMBER, 0.5, 0.05),
        (0.25, Dimension.NUMBER, 0.25, 0.0),
        (3, Dimension.NUMBER, 3.0, 0.0),
        ("40°", Dimension.ANGLE, 40.0, 0.0),
        ("9.81 m/s²", Dimension.ACCELERATION, 9.81, 0.0),
        ("9.81 m / s2", Dimension.ACCELERATION, 9.81, 0.0),
        ("1.2 kg/m³", Dimension.DENSITY, 1.2, 0.0),
        ("90 km/h", Dimension.SPEED, 25.0, 0.0),
    ],
)
def test_quantities_are_read_to_the_last_bit(text, dimension, value, u):
    assert parse(text, dimension) == Quantity(value, u)


@pytest.mark.parametrize(
    ("text", "dimension", "said"),
    [
        ("30 cm", Dimension.TIME, "30 cm is a length; accepted: a time, such as 80 ms"),
        ("25", Dimension.LENGTH, "without a unit; a length is written in m, mm"),
        (25, Dimension.LENGTH, "without a unit"),
        ("25 MM", Dimension.LENGTH, "did you mean mm?"),
        ("25 degrees", Dimension.ANGLE, "did you mean deg?"),
        ("nan", Dimension.NUMBER, "found 'nan'"),
        (math.inf, Dimension.NUMBER, "found 'inf'"),
        (True, Dimension.NUMBER, "found 'True'"),
        ("1e999 m", Dimension.LENGTH, "too large or too small"),
        ("1e-999 m", Dimension.LENGTH, "too large or too small"),
        ("1e99999999999999999999 m", Dimension.LENGTH, "too large or too small"),
        ("5 mm ± -1 mm", Dimension.LENGTH, "at least 0"),
        ("5 mm ± 1", Dimension.LENGTH, "needs a unit too"),
        ("5 mm ± 1 ms", Dimension.LENGTH, "is a time"),
        ("5 mm ± 2 %", Dimension.LENGTH, "is a plain number"),
        ("0.5 ± 10 %", Dimension.NUMBER, "two meanings"),
        ("5(1) ± 1 mm", Dimension.LENGTH, "two uncertainties"),
        ("18(0 ± 1) mm", Dimension.LENGTH, "found '18(0 ± 1) mm'"),
        ("15,0 cm", Dimension.LENGTH, "not a comma: 15.0 cm"),
        ("1,5 ± 0,2 cm", Dimension.LENGTH, "not a comma: 1.5 ± 0.2 cm"),
        ("(1,5 ± 0,2) cm", Dimension.LENGTH, "not a comma: (1.5 ± 0.2) cm"),
        ("", Dimension.LENGTH, "found ''"),
        ("9" * 101, Dimension.NUMBER, "101 characters"),
    ],
)
def test_what_is_refused_and_how(text, dimension, said):
    with pytest.raises(UnitError) as caught:
        parse(text, dimension)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@given(FINITE, st.sampled_from(["m", "1", "deg", "s", "kg"]))
def test_base_units_round_trip_exactly(value, unit):
    assert parse(f"{value!r} {unit}", UNITS[unit][0]).value == value


@given(st.decimals(min_value=-1000, max_value=1000, places=3))
def test_scaling_is_correctly_rounded(number):
    assert parse(f"{number} mm", Dimension.LENGTH).value == float(number.scaleb(-3))


@given(FINITE, st.floats(min_value=1e-9, max_value=1e6), st.sampled_from(list(UNITS)))
def test_what_is_formatted_can_be_read_again(value, u, unit):
    factor = float(UNITS[unit][1])
    again = parse(format_quantity(Quantity(value * factor, u * factor), unit), UNITS[unit][0])
    assert again.u == pytest.approx(u * factor, rel=0.051)
    assert again.value == pytest.approx(value * factor, abs=0.051 * u * factor, rel=1e-12)


@given(st.text(), st.sampled_from(Dimension))
def test_any_text_is_a_quantity_or_a_unit_error(text, dimension):
    said, read = "one line", Quantity(0.0)
    try:
        read = parse(text, dimension)
    except UnitError as error:
        said = str(error)
    assert len(said.splitlines()) == 1
    assert math.isfinite(read.value)
    assert read.u >= 0


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
