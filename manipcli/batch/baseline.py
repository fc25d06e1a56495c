"""What a run of a task measured when it was good, beside the task (`pour.baseline.json`); and what is worse now.

A baseline holds how long the task and each step took, the work of the joints and every margin: nothing of the machine,
so that it belongs into version control. How much worse a run may be is `baseline: {tolerance: ...}` of the task.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from manipcli.batch.first_look import SUFFIXES
from manipcli.batch.job import own_stem
from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import listed
from manipcli.core.whole_file import write_whole
from manipcli.judge.verdict import Verdict
from manipcli.report.quantity import quantity
from manipcli.spec.baseline import ToleranceSpec

DIGITS: Final = 6
"""Significant digits that are kept."""
FLOORS: Final[Mapping[str, float]] = {"s": 0.05, "J": 1.0, "m": 1e-3, "rad": math.radians(0.5), "N": 0.5}
"""Differences that never count, by unit."""

ALWAYS: Final = ("duration", "margins", "steps")
"""Keys that every baseline has."""

Key = tuple[str, ...]
"""`("duration",)`, `("steps", id)`, `("energy",)`, `("margins", name)`: as in the file."""


@dataclass(frozen=True, slots=True)
class Measure:
    """One number of a run, in `unit`."""

    value: float
    unit: str

    def __str__(self) -> str:
        """`14.55 s`, `4.1 mm`."""
        return f"{self.value:.2f} s" if self.unit == "s" else quantity(self.value, self.unit)


Measures = dict[Key, Measure]


@dataclass(frozen=True, slots=True)
class Change:
    """A number that is not what it was; `new` None: it is not measured any more. `worse` by more than is tolerated, or
    not to be compared, which could hide that.

    The margin of a condition of several parts has the unit of the one that decides, which may be another one now.
    """

    key: Key
    old: Measure
    new: Measure | None
    worse: bool

    @property
    def word(self) -> str:
        """How the new one is, before the name of the old."""
        if self.new is not None and self.new.unit != self.old.unit:
            return "unlike"
        return "worse than" if self.worse else "better than"

    def __str__(self) -> str:
        """`step 'pour_1' takes 7.1 s; its baseline is 6.5 s (8.9 % longer)`."""
        what, verb, more, less = _WORDS[self.key[0]]
        name = f"{what} '{self.key[1]}'" if len(self.key) > 1 else what
        old = self.old
        if self.new is None:
            return f"{name} is in the baseline ({old}) and was not measured; `manipcli bless` writes a new one"
        if self.new.unit != self.old.unit:
            why = (
                "another part of it decides now, so that the two cannot be compared; `manipcli bless` writes a new one"
            )
            return f"{name} {verb} {self.new}; its baseline is {old}: {why}"
        share = abs(self.new.value / self.old.value - 1.0) if self.old.value else math.inf
        by = f"{100.0 * share:{'.0f' if share > 0.1 else '.2g'}} % " if share < 10.0 else ""
        word = more if self.new.value > self.old.value else less
        return f"{name} {verb} {self.new}; its baseline is {old} ({by}{word})"


_WORDS: Final[Mapping[str, tuple[str, str, str, str]]] = {
    "duration": ("the task", "takes", "longer", "shorter"),
    "steps": ("step", "takes", "longer", "shorter"),
    "energy": ("the work of the joints", "is", "more", "less"),
    "margins": ("the margin of", "is", "more", "less"),
}


def baseline_path(task: Path) -> Path:
    """Where the baseline of a task file is written."""
    return task.with_name(f"{own_stem(task)}.baseline.json")


def kept_baseline(task: Path) -> Path:
    """Where the baseline of a task file is read, if it has one.

    That is `baseline_path`, or else `a.baseline.json`, which earlier versions wrote for `a.yml`, too, where no other
    task file beside it is meant by that.
    """
    own, plain = baseline_path(task), task.with_name(f"{task.stem}.baseline.json")
    if own.exists() or not plain.exists():
        return own
    others = (file for file in task.parent.iterdir() if file.suffix.lower() in SUFFIXES and file.name != task.name)
    return own if any(task.stem in (file.stem, own_stem(file)) for file in others) else plain


def measured(verdict: Verdict, log: Path) -> Measures:
    """What a run took.

    Args:
        verdict: of the run.
        log: of the run.
    """
    from manipcli.judge.measures.step_measures import step_measures
    from manipcli.logs.recorded_files import recorded_robot
    from manipcli.record.read.reading import open_recording

    found: Measures = {("duration",): Measure(verdict.simulated_time, "s")}
    for step in verdict.steps:
        if step.started is not None and step.ended is not None:
            found["steps", step.id] = Measure(step.ended - step.started, "s")
    recording = open_recording(log)
    works = [one.work for one in step_measures(recording, recorded_robot(recording, log), verdict.steps)]
    known = [work for work in works if work is not None]
    if known:
        found["energy",] = Measure(math.fsum(known), "J")
    for expected in verdict.expectations:
        if expected.margin is not None and math.isfinite(expected.margin):
            found["margins", expected.name] = Measure(expected.margin, expected.unit)
    return found


def compared(old: Measures, new: Measures, tolerance: ToleranceSpec) -> tuple[Change, ...]:
    """What is worse or better than it was by more than is tolerated, and what is not or cannot be compared any more.

    A time or energy may grow, and a margin shrink, by its share of the old value, and by what `FLOORS` says.
    """
    return tuple(_compared(old, new, tolerance))


def _compared(old: Measures, new: Measures, tolerance: ToleranceSpec) -> Iterator[Change]:
    shares = {"duration": tolerance.duration, "steps": tolerance.duration, "energy": tolerance.energy,
              "margins": tolerance.margin}  # fmt: skip
    for key, before in old.items():
        now = new.get(key)
        if now is None or now.unit != before.unit:
            yield Change(key, before, now, worse=True)
            continue
        allowed = max(shares[key[0]] * abs(before.value), FLOORS.get(before.unit, 0.0))
        loss = before.value - now.value if key[0] == "margins" else now.value - before.value
        if abs(loss) > allowed:
            yield Change(key, before, now, worse=loss > 0.0)


def write_baseline(path: Path, measures: Measures) -> None:
    """Keys sorted, numbers rounded: the same run gives the same bytes.

    Raises:
        OSError: it cannot be written.
    """
    tree: dict[str, object] = dict(zip(ALWAYS, (0.0, {}, {}), strict=True))
    for key, one in measures.items():
        value = float(f"{one.value:.{DIGITS}g}")
        inner = tree[key[0]] if len(key) > 1 else None
        if isinstance(inner, dict):
            inner[key[1]] = {"unit": one.unit, "value": value} if key[0] == "margins" else value
        else:
            tree[key[0]] = value
    write_whole(path, (json.dumps(tree, indent=1, sort_keys=True, ensure_ascii=False) + "\n").encode())


def read_baseline(path: Path) -> Measures | None:
    """None where there is none.

    Raises:
        InvalidInput: this is no baseline.
    """
    try:
        tree = json.loads(path.read_bytes(), parse_constant=_refuse)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidInput([_no_baseline(path, str(error))]) from None
    lacking = [key for key in ALWAYS if isinstance(tree, dict) and key not in tree]
    if lacking:
        raise InvalidInput([_no_baseline(path, f"it lacks {listed([f'`{key}`' for key in lacking])}")])
    try:
        return dict(_measures(tree))
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        raise InvalidInput([_no_baseline(path, "keys or numbers are not those of a baseline")]) from None


def is_baseline(path: Path) -> bool:
    """Whether `read_baseline` reads one there."""
    try:
        return read_baseline(path) is not None
    except InvalidInput:
        return False


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is no number")


def _measures(tree: dict[str, object]) -> Iterator[tuple[Key, Measure]]:
    for key, value in tree.items():
        match key, value:
            case "duration", _:
                yield (key,), Measure(_number(value), "s")
            case "energy", _:
                yield (key,), Measure(_number(value), "J")
            case "steps", dict():
                yield from (((key, str(name)), Measure(_number(one), "s")) for name, one in value.items())
            case "margins", dict():
                for name, one in value.items():
                    yield (key, str(name)), Measure(_number(one["value"]), str(one["unit"]))
            case _:
                raise ValueError(key)


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(value)
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(number)
    return number


def _no_baseline(path: Path, why: str) -> Diagnostic:
    hint = "`manipcli bless` writes a new one"
    return Diagnostic("USE087", f"this is no baseline: {why}", Place(str(path), 0, 0), hint=hint)
