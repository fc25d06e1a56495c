"""Parsing of quantities (`"45 deg"`, `"5 mm"`, `"2 N m"`, `"-1.5e-3 rad/s"`) to SI with their dimension.

A unit is a product of symbols: a space, `*` or `·` multiplies, `/` divides by the symbol after it, and an exponent is
written `s2`, `s^2`, `s^-1` or `s²`. An angle is a dimension of its own, so that lengths and angles are distinct and
`rad/s` is not `Hz`.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from typing import ClassVar, Final

from manipcli.core.errors import Diagnostic, ExitCode, ManipcliError
from manipcli.core.text import any_of, nearest, shorten

EARTH_GRAVITY: Final = (0.0, 0.0, -9.81)
"""Default gravity in the world frame [m/s2]."""


class UnitError(ManipcliError):
    """A text is not a quantity, or has the wrong dimension."""

    exit_code: ClassVar[ExitCode] = ExitCode.USAGE
    code: ClassVar[str] = "USE110"

    def __init__(self, cause: str, *, hint: str | None = None) -> None:
        self.cause = cause
        self.hint = hint
        super().__init__(cause)

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return (Diagnostic(code=self.code, message=self.cause, hint=self.hint),)


@dataclass(frozen=True, slots=True)
class Dimension:
    """Exponents of the base units m, kg, s, rad and px."""

    length: int = 0
    mass: int = 0
    time: int = 0
    angle: int = 0
    pixel: int = 0

    def __mul__(self, other: Dimension) -> Dimension:
        return Dimension(*map(operator.add, astuple(self), astuple(other)))

    def __pow__(self, exponent: int) -> Dimension:
        return Dimension(*(exponent * each for each in astuple(self)))

    def __truediv__(self, other: Dimension) -> Dimension:
        return self * other**-1

    @property
    def name(self) -> str:
        """Name of a quantity of this dimension, with its article."""
        return _NAMES.get(self, f"a quantity in {self.symbol}")

    @property
    def symbol(self) -> str:
        """The SI unit, as `parse_unit` reads it; empty for a plain number."""
        if self in _SYMBOLS:
            return _SYMBOLS[self]
        parts = (("kg", self.mass), ("m", self.length), ("rad", self.angle), ("s", self.time), ("px", self.pixel))
        return " ".join(symbol if power == 1 else f"{symbol}^{power}" for symbol, power in parts if power)


NUMBER = Dimension()
LENGTH = Dimension(length=1)
ANGLE = Dimension(angle=1)
MASS = Dimension(mass=1)
TIME = Dimension(time=1)
PIXELS = Dimension(pixel=1)
FREQUENCY = TIME**-1
SPEED, ACCELERATION, JERK = LENGTH / TIME, LENGTH / TIME**2, LENGTH / TIME**3
ANGULAR_VELOCITY, ANGULAR_ACCELERATION, ANGULAR_JERK = ANGLE / TIME, ANGLE / TIME**2, ANGLE / TIME**3
FORCE = MASS * ACCELERATION
TORQUE = ENERGY = FORCE * LENGTH
"""Torque and energy share one dimension: the angle of rotational work is a plain number here."""
STIFFNESS, DAMPING = FORCE / LENGTH, FORCE / SPEED
ANGULAR_STIFFNESS, ANGULAR_DAMPING = TORQUE / ANGLE, TORQUE / ANGULAR_VELOCITY

_NAMES = {
    NUMBER: "a plain number", LENGTH: "a length", ANGLE: "an angle", MASS: "a mass", TIME: "a time",
    FREQUENCY: "a frequency", SPEED: "a speed", ACCELERATION: "an acceleration", JERK: "a jerk",
    ANGULAR_VELOCITY: "an angular velocity", ANGULAR_ACCELERATION: "an angular acceleration",
    ANGULAR_JERK: "an angular jerk", FORCE: "a force", TORQUE: "a torque or an energy",
    PIXELS: "a number of pixels", STIFFNESS: "a stiffness", ANGULAR_STIFFNESS: "an angular stiffness",
    DAMPING: "a damping", ANGULAR_DAMPING: "an angular damping",
}  # fmt: skip
_SYMBOLS = {
    NUMBER: "", LENGTH: "m", ANGLE: "rad", MASS: "kg", TIME: "s", FREQUENCY: "Hz", SPEED: "m/s",
    ACCELERATION: "m/s^2", JERK: "m/s^3", ANGULAR_VELOCITY: "rad/s", ANGULAR_ACCELERATION: "rad/s^2",
    ANGULAR_JERK: "rad/s^3", FORCE: "N", TORQUE: "N m", STIFFNESS: "N/m", ANGULAR_STIFFNESS: "N m/rad",
    DAMPING: "N s/m", ANGULAR_DAMPING: "N m s/rad",
}  # fmt: skip
_EXAMPLES = {
    NUMBER: ("0.5", "50 %"), LENGTH: ("m", "cm", "mm", "um", "km", "in"), ANGLE: ("rad", "deg", "mrad", "rev"),
    MASS: ("kg", "g", "mg", "t"), TIME: ("s", "ms", "us", "min", "h"), FREQUENCY: ("Hz", "kHz"),
    SPEED: ("m/s", "mm/s", "cm/s"), ACCELERATION: ("m/s^2", "mm/s^2"), JERK: ("m/s^3",),
    ANGULAR_VELOCITY: ("rad/s", "deg/s", "rpm"), ANGULAR_ACCELERATION: ("rad/s^2", "deg/s^2"),
    ANGULAR_JERK: ("rad/s^3", "deg/s^3"), FORCE: ("N", "mN", "kN"), TORQUE: ("N m", "mN m", "N mm", "J"),
    STIFFNESS: ("N/m", "N/mm"), ANGULAR_STIFFNESS: ("N m/rad", "N m/deg"), DAMPING: ("N s/m",),
    ANGULAR_DAMPING: ("N m s/rad",),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit whose SI value is `value * over / under`. Two factors: 36 / 1000 is exact, 36 * 0.001 is not."""

    over: float
    under: float
    dimension: Dimension

    def to_si(self, value: float) -> float:
        return value * self.over / self.under


@dataclass(frozen=True, slots=True)
class Quantity:
    """A value in SI and its dimension."""

    value: float
    dimension: Dimension


def _unit(dimension: Dimension, over: float = 1.0, under: float = 1.0) -> Unit:
    return Unit(over=over, under=under, dimension=dimension)


_UNITS: dict[str, Unit] = {
    "m": _unit(LENGTH), "km": _unit(LENGTH, 1e3), "dm": _unit(LENGTH, 1, 10), "cm": _unit(LENGTH, 1, 1e2),
    "mm": _unit(LENGTH, 1, 1e3), "um": _unit(LENGTH, 1, 1e6), "nm": _unit(LENGTH, 1, 1e9),
    "in": _unit(LENGTH, 254, 1e4), "ft": _unit(LENGTH, 3048, 1e4),
    "rad": _unit(ANGLE), "mrad": _unit(ANGLE, 1, 1e3),
    "deg": _unit(ANGLE, math.pi, 180), "°": _unit(ANGLE, math.pi, 180),
    "rev": _unit(ANGLE, math.tau), "turn": _unit(ANGLE, math.tau),
    "kg": _unit(MASS), "g": _unit(MASS, 1, 1e3), "mg": _unit(MASS, 1, 1e6), "t": _unit(MASS, 1e3),
    "s": _unit(TIME), "ms": _unit(TIME, 1, 1e3), "us": _unit(TIME, 1, 1e6), "ns": _unit(TIME, 1, 1e9),
    "min": _unit(TIME, 60), "h": _unit(TIME, 3600),
    "Hz": _unit(FREQUENCY), "kHz": _unit(FREQUENCY, 1e3), "MHz": _unit(FREQUENCY, 1e6),
    "rpm": _unit(ANGULAR_VELOCITY, math.tau, 60),
    "N": _unit(FORCE), "mN": _unit(FORCE, 1, 1e3), "kN": _unit(FORCE, 1e3),
    "J": _unit(TORQUE), "mJ": _unit(TORQUE, 1, 1e3), "kJ": _unit(TORQUE, 1e3),
    "Nm": _unit(TORQUE), "mNm": _unit(TORQUE, 1, 1e3), "kNm": _unit(TORQUE, 1e3), "Nmm": _unit(TORQUE, 1, 1e3),
    "%": _unit(NUMBER, 1, 100), "px": _unit(PIXELS),
}  # fmt: skip
_WORDS = {
    "degree": "deg", "degrees": "deg", "grad": "deg", "radian": "rad", "radians": "rad", "meter": "m", "meters": "m",
    "metre": "m", "metres": "m", "millimeter": "mm", "millimeters": "mm", "centimeter": "cm", "centimeters": "cm",
    "inch": "in", "inches": "in", "gram": "g", "grams": "g", "kilogram": "kg", "kilograms": "kg", "sec": "s",
    "second": "s", "seconds": "s", "msec": "ms", "minute": "min", "minutes": "min", "hour": "h", "newton": "N",
    "newtons": "N", "hertz": "Hz", "percent": "%",
}  # fmt: skip
_SUPERSCRIPT = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")

NUMBER_PATTERN = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_ATOM = r"(?:[A-Za-zµμ]+|[°%])(?:\^-?\d{1,2}|\d{1,2}|[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]{1,3})?"
UNIT_PATTERN = rf"{_ATOM}(?:\s*[*·/]\s*{_ATOM}|[ ]+{_ATOM})*"
_QUANTITY = re.compile(rf"\s*([-+]?\s*{NUMBER_PATTERN})\s*({UNIT_PATTERN})?\s*")
_PART = re.compile(r"(\s*[*·/]\s*|\s+)?([A-Za-zµμ]+|[°%])(\^-?\d{1,2}|\d{1,2}|[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]{1,3})?")


def parse_unit(text: str) -> Unit:
    """Parses a unit.

    Raises:
        UnitError: an unknown symbol, or an ambiguous product after a `/`.
    """
    over, under, dimension = 1.0, 1.0, NUMBER
    position, divided = 0, False
    while position < len(text):
        part = _PART.match(text, position)
        if part is None:
            raise UnitError(f"'{shorten(text)}' is not a unit", hint="write a unit such as mm, rad/s^2 or N m")
        sign, symbol, exponent = (part.group(1) or "").strip(), part.group(2), part.group(3) or "1"
        unit = _symbol(symbol)
        power = _exponent(exponent)
        if divided and sign != "/":
            raise UnitError(
                f"the unit '{shorten(text)}' is ambiguous: a product after '/'",
                hint="write every divided symbol with its own '/': N/s/m",
            )
        if sign == "/":
            divided, power = True, -power
        for _ in range(abs(power)):
            up, down = (unit.over, unit.under) if power > 0 else (unit.under, unit.over)
            over, under = over * up, under * down
        dimension = dimension * unit.dimension**power
        position = part.end()
    return Unit(over=over, under=under, dimension=dimension)


def _symbol(symbol: str) -> Unit:
    plain = symbol.replace("µ", "u").replace("μ", "u")
    unit = _UNITS.get(plain)
    if unit is None:
        word = _WORDS.get(plain.casefold())
        close = (word,) if word else nearest(plain, _UNITS)
        raise UnitError(f"unknown unit '{shorten(symbol)}'", hint=f"did you mean {any_of(close)}?" if close else None)
    return unit


def _exponent(text: str) -> int:
    try:
        power = int(text.lstrip("^").translate(_SUPERSCRIPT))
    except ValueError:
        power = 0
    if not 1 <= abs(power) <= 9:
        raise UnitError(f"the exponent '{text}' is not between 1 and 9")
    return power


def parse_quantity(text: str) -> Quantity:
    """Parses a number with a unit to SI; a text without a unit is a plain number.

    Raises:
        UnitError: not a number, an unknown unit, or a value out of range.
    """
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise UnitError(f"'{shorten(text)}' is not a number with a unit", hint=_syntax_hint(text))
    number, unit_text = match.groups()
    unit = parse_unit(unit_text) if unit_text else _unit(NUMBER)
    value = unit.to_si(float(number.replace(" ", "").replace("\t", "")))
    if not math.isfinite(value):
        raise UnitError(f"'{shorten(text)}' exceeds the largest number, 1.8e308")
    return Quantity(value=value, dimension=unit.dimension)


_HOW = "write a number, a space and a unit: '45 deg', '5 mm', '2 N m'"


def _syntax_hint(text: str) -> str:
    if re.fullmatch(r"\s*[-+]?\d+,\d+.*", text):
        return "use a decimal point: 0.5, not 0,5"
    if re.fullmatch(r"\s*[-+]?\.?(nan|inf(inity)?)\b.*", text, re.IGNORECASE):
        return "numbers must be finite"
    return _HOW


def to_si(text: str, *wanted: Dimension, read: Callable[[str], Quantity] = parse_quantity) -> float:
    """The SI value of `text`, which must have one of the `wanted` dimensions.

    Raises:
        UnitError: from `read`; a wrong dimension; or a missing unit.
    """
    try:
        quantity = read(text)
    except UnitError as error:
        hint = None if error.hint == _HOW and wanted == (NUMBER,) else error.hint
        raise UnitError(f"{error.cause}; expected {describe(*wanted)}", hint=hint) from None
    if quantity.dimension in wanted:
        return quantity.value
    if quantity.dimension == NUMBER and "%" not in text:
        hint = f"write {text.strip()} without quotes for SI, or '{text.strip()} {wanted[0].symbol}'"
        if _QUANTITY.fullmatch(text) is None:
            hint = "add units to its numbers"
        raise UnitError(f"'{shorten(text)}' has no unit; expected {describe(*wanted)}", hint=hint)
    raise UnitError(f"'{shorten(text)}' is {quantity.dimension.name}; expected {describe(*wanted)}")


def describe(*wanted: Dimension) -> str:
    """Names and usual units of dimensions: `a length (m, cm, mm, um, km, in)`, joined by `or`."""
    return " or ".join(f"{each.name} ({', '.join(fitting_units(each))})" for each in wanted)


def fitting_units(dimension: Dimension) -> tuple[str, ...]:
    """Usual units of a dimension, the SI unit first."""
    return _EXAMPLES.get(dimension, (dimension.symbol,))


def symbols_of(dimension: Dimension) -> tuple[str, ...]:
    """All single symbols of this dimension; empty for compound units such as those of speed."""
    return tuple(symbol for symbol, unit in _UNITS.items() if unit.dimension == dimension)


def format_quantity(value: float, dimension: Dimension) -> str:
    """`value` [SI] as text that `parse_quantity` reads back to the same float."""
    symbol = dimension.symbol
    return f"{value!r} {symbol}" if symbol else repr(value)


_READABLE: dict[str, tuple[tuple[float, str, float], ...]] = {
    "m": ((1.0, "m", 1.0), (1e-3, "mm", 1e3), (0.0, "um", 1e6)),
    "rad": ((0.0, "deg", 180.0 / math.pi),),
    "rad/s": ((0.0, "deg/s", 180.0 / math.pi),),
    "kg": ((1.0, "kg", 1.0), (0.0, "g", 1e3)),
    "s": ((1.0, "s", 1.0), (0.0, "ms", 1e3)),
    "m/s": ((1.0, "m/s", 1.0), (0.0, "mm/s", 1e3)),
    "J": ((1.0, "J", 1.0), (0.0, "mJ", 1e3)),
}


def readable(value: float, symbol: str, *, digits: int = 3) -> str:
    """`value` [SI unit `symbol`] in a readable unit: `readable(0.0042, "m")` is `4.2 mm`; angles in degrees."""
    if not math.isfinite(value):
        return f"{value:g} {symbol}".rstrip()
    if value == 0.0:
        return f"0 {symbol}".rstrip()  # never -0
    rounded = float(f"{value:.{digits}g}")  # as shown: 0.9999 s is 1 s, not 1e+03 ms
    shown, factor = readable_unit(rounded, symbol)
    return f"{value * factor:.{digits}g} {shown}".rstrip()


def readable_unit(value: float, symbol: str) -> tuple[str, float]:
    """A readable unit for values [SI unit `symbol`] up to `value`, and its factor: `("mm", 1000.0)` for 0.0042 m."""
    return next(
        ((shown, factor) for least, shown, factor in _READABLE.get(symbol, ()) if abs(value) >= least), (symbol, 1.0)
    )


def names_of(dimensions: Sequence[Dimension]) -> str:
    """Names of dimensions: `an angle or a length`."""
    return " or ".join(dimension.name for dimension in dimensions)
