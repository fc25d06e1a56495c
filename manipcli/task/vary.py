"""Binding of `vary:` to numbers in the files of a task, and drawing of samples.

A sample is a pure function of seed, sample number and path: the uniform deviate of component k of a path is

    u = (first 52 bits of SHA-256("seed/sample/path/k") + 1/2) / 2^52

so that draws are independent of other paths and of library versions; other designs (`task/designs.py`) choose u
otherwise. From it `uniform` is a + (b - a) u,
`normal` the quantile of F(least) + (F(most) - F(least)) u, where F is its distribution and least and most
are the field's bounds, `choice` item floor(n u).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from statistics import NormalDist
from typing import Final

from pydantic import BaseModel

from manipcli.core.errors import Diagnostic, Loc
from manipcli.core.text import did_you_mean, escape
from manipcli.core.units import NUMBER, Dimension, UnitError, to_si
from manipcli.judge.drawn import Number
from manipcli.spec.block_fields import bounds_of, children, unit_of
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.expression import quantity_of
from manipcli.spec.located import Area, Located
from manipcli.spec.quantity import Unit
from manipcli.spec.robot import RobotSpec
from manipcli.spec.task import TaskSpec
from manipcli.spec.vary import Amount, DistributionSpec, Value, VarySpec

SENSORS: Final = "sensors"
EVERY: Final = "*"
"""Wildcard in a path: all names of a mapping, or all items of a list."""
LARGEST: Final = 1e100
"""Bound on amounts [SI], so that drawn values stay finite."""
RAREST: Final = 1e-3
"""Minimum share of a normal distribution within the bounds of the field."""
_TASK_KEYS: Final = ("scene", "frames", "simulation", SENSORS)
_MEASURING: Final = frozenset({"noise", "delay", "rate", "filter", "limits"})
_CONTACT: Final = frozenset({"mass", "friction", "rolling_friction", "spinning_friction", "restitution"})

Path = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Law:
    """A distribution bound to a path.

    Attributes:
        word: `uniform`, `normal`, `choice` or `grid`.
        rows: amounts [SI], one per component: least and most of `uniform`, mean and standard deviation of `normal`,
            the items of `choice` and `grid`.
        together: whether the components of an item are drawn together, because items are lists.
        between: bounds of `normal` per component, from the bounds of the field.
    """

    word: str
    rows: tuple[tuple[float, ...], ...]
    together: bool
    between: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Varied:
    """A number or vector of a file that is drawn.

    Attributes:
        key: the key in `vary:`, where `*` may match several paths.
        path: path as for `--set`.
        area, parts: the file, and the path in it.
        nominal: the value in the file, one number per component.
        vector: whether the value is a list.
        whole: whether it is a whole number.
        how: `offset`, `scale`, or "" if the value itself is drawn.
        law: the distribution.
        unit: SI unit of the value; "" for a plain number, and where the joint decides between two.
    """

    key: str
    path: str
    area: Area
    parts: Path
    nominal: tuple[float, ...]
    vector: bool
    whole: bool
    how: str
    law: Law
    unit: str = ""

    @property
    def only_world(self) -> bool:
        """Whether only the simulation uses the drawn value: it changes dynamics, not geometry, so the planner and the
        models of controllers keep the value in the file."""
        match self.area, self.parts:
            case ("CTRL", _) | ("TASK", ("simulation", "gravity", *_)) | ("ROBOT", ("friction" | "actuators", *_)):
                return True
            case "TASK", ("scene", _, field, *_):
                return field in _CONTACT
            case _, ("sensors", _, field, *_):
                return field in _MEASURING
        return False

    @property
    def dimensions(self) -> int:
        """How many numbers are drawn: one per component, or one in all where items are lists."""
        return 1 if self.law.together else len(self.nominal)

    def values(self, k: int) -> float:
        """How many values component k can have; `inf` for a continuous one."""
        match self.law.word:
            case "choice" | "grid":
                return len(self.law.rows)
            case "uniform":
                least, most = self.law.rows[0][k], self.law.rows[1][k]
                return 1 if least == most else most - least + 1.0 if self._steps else math.inf
        return math.inf

    @property
    def _steps(self) -> bool:
        """Whether a `uniform` has whole numbers only."""
        return self.whole and self.how != "scale"

    def ends(self, inside: float = 0.0) -> tuple[Number, ...]:
        """The ends of `uniform`, moved inward by the share `inside`; the items of `choice`, `grid`; () for `normal`."""
        rows = self.law.rows
        if self.law.word == "normal":
            return ()
        if self.law.word == "uniform" and not self.whole:
            shares = (inside, 1.0 - inside)
            rows = tuple(tuple((1.0 - u) * a + u * b for a, b in zip(*rows, strict=True)) for u in shares)
        return tuple(self._written(row) for row in rows)

    def value(self, point: Sequence[float | None]) -> Number:
        """The value at a coordinate in [0, 1] per dimension; None: the amount of the value in the file."""
        return self._written(
            [self._component(k, point[0 if self.law.together else k]) for k in range(len(self.nominal))]
        )

    def _written(self, drawn: Sequence[float]) -> Number:
        """The value for the file, from the drawn components."""
        if self.how == "offset":
            drawn = [a + b for a, b in zip(self.nominal, drawn, strict=True)]
        elif self.how == "scale":
            drawn = [a * b for a, b in zip(self.nominal, drawn, strict=True)]
        values = [round(number) if self.whole else number for number in drawn]
        return tuple(values) if self.vector else values[0]

    def _component(self, k: int, u: float | None) -> float:
        rows = self.law.rows
        if u is None:
            return {"offset": 0.0, "scale": 1.0}.get(self.how, self.nominal[k])
        match self.law.word:
            case "uniform":
                least, most = rows[0][k], rows[1][k]
                if self._steps:
                    return min(least + math.floor(u * (most - least + 1.0)), most)
                return least + (most - least) * u
            case "normal":
                law = NormalDist(rows[0][k], rows[1][k])
                low, high = map(law.cdf, self.law.between[k])
                return law.inv_cdf(min(low + (high - low) * u, math.nextafter(1.0, 0.0)))
        return rows[min(math.floor(u * len(rows)), len(rows) - 1)][k]


def deviate(seed: int, sample: int, path: str, component: int) -> float:
    """The deterministic uniform deviate in (0, 1) of a component; see the module."""
    digest = sha256(f"{seed}/{sample}/{path}/{component}".encode()).digest()
    return ((int.from_bytes(digest[:8], "big") >> 12) + 0.5) / 2.0**52


@dataclass(frozen=True, slots=True)
class _Problem(Exception):
    """An invalid path or amount; `loc`: location in the path's block, () for the path itself."""

    message: str
    hint: str | None = None
    loc: Loc = ()


@dataclass(frozen=True, slots=True)
class _Leaf:
    """The value at the end of a path, with its unit and bounds."""

    parts: Path
    value: object
    unit: Unit | None
    bounds: tuple[float, float]


def bind(
    task: Located[TaskSpec], robot: Located[RobotSpec], controllers: Located[ControllersSpec]
) -> tuple[tuple[Varied, ...], tuple[Diagnostic, ...]]:
    """All varied quantities of a task, in the order of its file, and the errors of invalid entries."""
    found: list[Varied] = []
    findings: list[Diagnostic] = []
    for key, spec in task.spec.vary.items():
        try:
            new = _bound(key, spec, task.spec, robot.spec, controllers.spec)
            for quantity in new:
                _refuse_overlap(quantity, found)
        except _Problem as problem:
            loc = ("vary", key, *problem.loc)
            findings.append(task.source.finding(234, loc, problem.message, hint=problem.hint, key=not problem.loc))
        else:
            found += new
    return tuple(found), tuple(findings)


def _bound(
    key: str, spec: VarySpec, task: TaskSpec, robot: RobotSpec, controllers: ControllersSpec
) -> tuple[Varied, ...]:
    first, *rest = key.split(".")
    area: Area
    if first == "robot":
        area, prefix, leaves = "ROBOT", "robot.", _leaves(robot, tuple(rest))
    elif first == "controllers":
        area, prefix, leaves = "CTRL", "", _leaves(controllers, (first, *rest))
    elif first in _TASK_KEYS:
        area, prefix, leaves = "TASK", "", _leaves(task, (first, *rest))
    else:
        known = (*_TASK_KEYS, "robot", "controllers")
        message = f"'{escape(first)}' cannot be varied, only {', '.join(known[:-1])} and {known[-1]}"
        raise _Problem(message, did_you_mean(first, known) if first not in TaskSpec.model_fields else None)
    return tuple(_varied(key, f"{prefix}{'.'.join(leaf.parts)}", area, leaf, spec) for leaf in leaves)


def _varied(key: str, path: str, area: Area, leaf: _Leaf, spec: VarySpec) -> Varied:
    vector = isinstance(leaf.value, tuple)
    values = leaf.value if isinstance(leaf.value, tuple) else (leaf.value,)
    nominal = tuple(number for number in values if isinstance(number, int | float) and not isinstance(number, bool))
    if leaf.value is None:
        raise _Problem(f"there is no value at '{path}'", _to_write(leaf.parts))
    if len(nominal) != len(values) or not nominal:
        raise _Problem(f"'{path}' is not a number or a list of numbers")
    whole = all(isinstance(number, int) for number in nominal)
    how = spec.word if spec.word in ("offset", "scale") else ""
    dimensions = (NUMBER,) if how == "scale" or leaf.unit is None else leaf.unit.dimensions
    law = _law(spec.distribution, len(nominal), vector, dimensions, (how,) if how else ())
    if whole and how != "scale" and law.word != "normal":
        broken = next((amount for row in law.rows for amount in row if not float(amount).is_integer()), None)
        if broken is not None:
            loc = (*((how,) if how else ()), law.word)
            raise _Problem(f"{broken:g} is not a whole number, as '{path}' must be", loc=loc)
    _refuse_too_large(law, nominal, how)
    if law.word == "normal":
        law = replace(law, between=tuple(_between(leaf.bounds, value, how) for value in nominal))
        _refuse_too_rare(law, path, how)
    own = leaf.unit.dimensions if leaf.unit is not None else ()
    unit = own[0].symbol if len(own) == 1 else ""
    return Varied(key, path, area, leaf.parts, nominal, vector, whole, how, law, unit)


def _refuse_too_large(law: Law, nominal: Sequence[float], how: str) -> None:
    """Refuses amounts whose drawn values could be infinite."""
    for row in law.rows:
        for amount, value in zip(row, nominal, strict=True):
            reach = amount * value if how == "scale" else amount + (value if how == "offset" else 0.0)
            if not max(abs(amount), abs(reach)) < LARGEST:
                raise _Problem(
                    f"{amount:g} exceeds the largest magnitude, {LARGEST:g}", loc=(*((how,) if how else ()), law.word)
                )


def _between(bounds: tuple[float, float], nominal: float, how: str) -> tuple[float, float]:
    """Bounds of an amount for which the value in the file keeps its bounds."""
    if how == "offset":
        return bounds[0] - nominal, bounds[1] - nominal
    if how == "scale":
        ends = sorted(bound / nominal for bound in bounds) if nominal else (-math.inf, math.inf)
        return ends[0], ends[1]
    return bounds


def _refuse_too_rare(law: Law, path: str, how: str) -> None:
    """Refuses a normal distribution with almost no share within the bounds of the field."""
    for mean, sd, (least, most) in zip(*law.rows, law.between, strict=True):
        normal = NormalDist(mean, sd)
        if normal.cdf(most) - normal.cdf(least) < RAREST:
            message = f"less than {RAREST:.1%} of this distribution is in the range of '{path}'"
            raise _Problem(message, loc=(*((how,) if how else ()), law.word))


def _law(
    spec: DistributionSpec, count: int, vector: bool, dimensions: tuple[Dimension, ...], loc: tuple[str, ...]
) -> Law:
    word = spec.word
    written: tuple[tuple[Value, Loc], ...]
    if spec.normal is not None:
        written = ((spec.normal.mean, (*loc, word, "mean")), (spec.normal.sd, (*loc, word, "sd")))
    else:
        written = tuple((value, (*loc, word, k)) for k, value in enumerate(getattr(spec, word)))
    rows = tuple(_row(value, count, vector, dimensions, at) for value, at in written)
    for least, most in zip(*rows, strict=True) if word == "uniform" else ():
        if least > most:
            raise _Problem(
                f"the least value, {least:g}, is above the most, {most:g}", "write [least, most]", (*loc, word)
            )
    if word == "normal" and not all(sd > 0.0 for sd in rows[1]):
        raise _Problem("the standard deviation must be above 0", loc=(*loc, word))
    lists = word in ("choice", "grid") and any(isinstance(value, tuple) for value, _ in written)
    return Law(word, rows, together=lists)


def _row(value: Value, count: int, vector: bool, dimensions: tuple[Dimension, ...], loc: Loc) -> tuple[float, ...]:
    """One amount per component, in SI."""
    if not isinstance(value, tuple):
        return (_si(value, dimensions, loc),) * count
    if not vector:
        raise _Problem("expected a single amount, got a list", "write a number, or a text with a unit", loc)
    if len(value) != count:
        raise _Problem(f"expected {count} amounts, got {len(value)}", loc=loc)
    return tuple(_si(amount, dimensions, (*loc, k)) for k, amount in enumerate(value))


def _si(amount: Amount, dimensions: tuple[Dimension, ...], loc: Loc) -> float:
    if not isinstance(amount, str):
        return amount
    try:
        return to_si(amount, *dimensions, read=quantity_of)
    except UnitError as error:
        raise _Problem(error.cause, error.hint, loc) from None


def _refuse_overlap(quantity: Varied, before: Sequence[Varied]) -> None:
    for other in before:
        shorter = min(len(quantity.parts), len(other.parts))
        if quantity.area == other.area and quantity.parts[:shorter] == other.parts[:shorter]:
            raise _Problem(f"'{quantity.path}' is already varied by '{other.key}'")


def _leaves(root: BaseModel, parts: Path) -> list[_Leaf]:
    """The values at the end of a path; with `*`, of all matching paths.

    Raises:
        _Problem: there is no value.
    """
    return list(_below(root, type(root), (), (), parts))


def _below(value: object, annotation: object, metadata: Sequence[object], done: Path, rest: Path) -> Iterator[_Leaf]:
    if not rest:
        yield _Leaf(done, value, unit_of(annotation, metadata), bounds_of(annotation, metadata))
        return
    part, further = rest[0], rest[1:]
    known = children(value, annotation)
    if part == EVERY and not isinstance(value, BaseModel):
        there = [leaf for name, child in known.items() for leaf in _tried(*child, (*done, name), further)]
        if not there:
            raise _Problem(f"there is no value at '{'.'.join((*done, *rest))}'", _to_write((*done, *rest)))
        yield from there
        return
    if part not in known:
        where = f"'{'.'.join(done)}'" if done else "the file"
        if not known:
            raise _Problem(f"{where} is empty", _to_write((*done, *rest)) if value in (None, {}) else None)
        raise _Problem(f"there is no '{escape(part)}' in {where}", did_you_mean(part, known, kind="known"))
    yield from _below(*known[part], (*done, part), further)


def _to_write(parts: Path) -> str:
    """Hint for a missing value: `add it to the robot file first, as actuators: {NAME: {latency: ...}}`."""
    file = "task" if parts[0] in _TASK_KEYS else "controllers" if parts[0] == "controllers" else "robot"
    *above, last = ("NAME" if part == EVERY else escape(part) for part in parts)
    written = f"{last}: ..."
    for part in reversed(above):
        written = f"{part}: {{{written}}}"
    return f"add it to the {file} file first, as `{written}`"


def _tried(value: object, annotation: object, metadata: Sequence[object], done: Path, rest: Path) -> list[_Leaf]:
    """The values below one match of `*`; empty if the rest of the path does not exist there."""
    try:
        return [leaf for leaf in _below(value, annotation, metadata, done, rest) if leaf.value is not None]
    except _Problem:
        return []
