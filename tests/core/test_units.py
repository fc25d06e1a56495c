"""Quantities as text: what is read is what was written, in SI, and only in its own dimension."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.core import units
from manipcli.core.units import UnitError, format_quantity, parse_quantity, parse_unit, readable, to_si

DIMENSIONS = [
    units.NUMBER, units.LENGTH, units.ANGLE, units.MASS, units.TIME, units.FREQUENCY, units.SPEED, units.ACCELERATION,
    units.JERK, units.ANGULAR_VELOCITY, units.ANGULAR_ACCELERATION, units.ANGULAR_JERK, units.FORCE, units.TORQUE,
]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "value", "dimension"),
    [
        ("45 deg", math.pi / 4, units.ANGLE),
        ("120deg", 2 * math.pi / 3, units.ANGLE),
        ("-90°", -math.pi / 2, units.ANGLE),
        ("1 rev", math.tau, units.ANGLE),
        ("5 mm", 0.005, units.LENGTH),
        ("36 mm", 0.036, units.LENGTH),
        ("2 µm", 2e-6, units.LENGTH),
        ("1 in", 0.0254, units.LENGTH),
        ("250 ms", 0.25, units.TIME),
        ("80 g", 0.08, units.MASS),
        ("2 N m", 2.0, units.TORQUE),
        ("2 Nm", 2.0, units.TORQUE),
        ("2 N·mm", 0.002, units.TORQUE),
        ("1 kg m / s^2", 1.0, units.FORCE),
        ("-1.5e-3 rad/s", -1.5e-3, units.ANGULAR_VELOCITY),
        ("60 rpm", math.tau, units.ANGULAR_VELOCITY),
        ("2 rad/s^2", 2.0, units.ANGULAR_ACCELERATION),
        ("2 rad/s2", 2.0, units.ANGULAR_ACCELERATION),
        ("2 m/s²", 2.0, units.ACCELERATION),
        ("2 m s^-3", 2.0, units.JERK),
        ("1 kHz", 1000.0, units.FREQUENCY),
        ("50 %", 0.5, units.NUMBER),
        ("7", 7.0, units.NUMBER),
        (".5e1 m", 5.0, units.LENGTH),
    ],
)
def test_a_text_is_its_si_value_and_dimension(text: str, value: float, dimension: units.Dimension) -> None:
    quantity = parse_quantity(text)
    assert quantity.value == pytest.approx(value, rel=1e-15)  # one rounding of the factor
    assert quantity.dimension == dimension


@given(st.integers(-10_000, 10_000))
def test_decimal_units_leave_no_residue(millimetres: int) -> None:
    assert parse_quantity(f"{millimetres} mm").value == millimetres / 1000


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(DIMENSIONS))
def test_formatting_round_trips_exactly(value: float, dimension: units.Dimension) -> None:
    quantity = parse_quantity(format_quantity(value, dimension))
    assert quantity.value == value
    assert quantity.dimension == dimension


def test_a_dimension_of_no_name_round_trips() -> None:
    dimension = units.LENGTH**2 * units.MASS / units.TIME**3 / units.ANGLE
    assert parse_unit(dimension.symbol).dimension == dimension


@pytest.mark.parametrize(
    ("text", "cause", "hint"),
    [
        ("5 degres", "unknown unit 'degres'", "did you mean 'deg'?"),
        ("5 degrees", "unknown unit 'degrees'", "did you mean 'deg'?"),
        ("5 Kg", "unknown unit 'Kg'", "did you mean 'kg'?"),
        ("0,5 m", "'0,5 m' is not a number with a unit", "use a decimal point: 0.5, not 0,5"),
        ("nan m", "'nan m' is not a number with a unit", "numbers must be finite"),
        ("1e999 m", "'1e999 m' exceeds the largest number, 1.8e308", None),
        (
            "1 N/m s",
            "the unit 'N/m s' is ambiguous: a product after '/'",
            "write every divided symbol with its own '/': N/s/m",
        ),
        ("5 m^0", "the exponent '^0' is not between 1 and 9", None),
        ("", "'' is not a number with a unit", "write a number, a space and a unit: '45 deg', '5 mm', '2 N m'"),
    ],
)
def test_what_is_no_quantity_is_told_with_a_way_out(text: str, cause: str, hint: str | None) -> None:
    with pytest.raises(UnitError) as caught:
        parse_quantity(text)
    assert (caught.value.cause, caught.value.hint) == (cause, hint)


def test_another_dimension_is_named_beside_the_units_that_fit() -> None:
    with pytest.raises(UnitError) as caught:
        to_si("5 kg", units.ANGLE, units.LENGTH)
    assert caught.value.cause == (
        "'5 kg' is a mass; expected an angle (rad, deg, mrad, rev) or a length (m, cm, mm, um, km, in)"
    )


@pytest.mark.parametrize("text", ["5 W", "five", "1e999 J"])
def test_what_is_no_quantity_is_told_with_the_units_that_fit(text: str) -> None:
    with pytest.raises(UnitError) as caught:
        to_si(text, units.ENERGY)
    assert caught.value.cause.endswith("; expected a torque or an energy (N m, mN m, N mm, J)")
    assert "km" not in (caught.value.hint or "")


def test_nothing_has_no_sign() -> None:
    assert (units.readable(-0.0, "N"), units.readable(-0.0, "rad")) == ("0 N", "0 rad")


def test_a_text_without_a_unit_could_be_meant_either_way() -> None:
    with pytest.raises(UnitError, match="has no unit; expected a length") as caught:
        to_si("5", units.LENGTH)
    assert caught.value.hint == "write 5 without quotes for SI, or '5 m'"


@given(st.text(max_size=30))
def test_any_text_is_a_quantity_or_a_unit_error(text: str) -> None:
    try:
        assert math.isfinite(parse_quantity(text).value)
    except UnitError as error:
        assert "\n" not in error.cause


@pytest.mark.parametrize(
    ("value", "symbol", "text"),
    [
        (0.0042, "m", "4.2 mm"),
        (1.5, "m", "1.5 m"),
        (-0.05, "rad", "-2.86 deg"),
        (0.25, "s", "250 ms"),
        (0.99996, "s", "1 s"),
        (-0.99996e-3, "m", "-1 mm"),
        (3.0, "N", "3 N"),
        (0.0, "m", "0 m"),
    ],
)
def test_readable_takes_the_unit_that_people_use(value: float, symbol: str, text: str) -> None:
    assert readable(value, symbol) == text
