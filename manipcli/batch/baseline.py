"""Baselines: measures of a good run, next to the task (`pour.baseline.json`), and comparison of later runs with them.

A baseline holds the durations of task and steps, the work of the joints and every margin. It does not depend on the
machine, so it belongs in version control. `baseline: {tolerance: ...}` of the task limits how much worse a run may be.
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
from manipcli.judge.measures.floors import share_of
from manipcli.judge.verdict import Verdict
from manipcli.report.display_quantity import quantity
from manipcli.spec.baseline import ToleranceSpec

DIGITS: Final = 6
"""Significant digits in the file."""

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
    """A number that differs from the baseline; `new` is None where it is missing in the new run.

    `worse`: by more than the tolerance, or not comparable, which could hide that. The margin of a combined condition
    has the unit of the part that decides, which may change.
    """

    key: Key
    old: Measure
    new: Measure | None
    worse: bool

    @property
    def word(self) -> str:
        """The comparison, to be followed by "the baseline"."""
        if self.new is not None and self.new.unit != self.old.unit:
            return "not comparable with"
        return "worse than" if self.worse else "better than"

    def __str__(self) -> str:
        """`step 'pour_1' takes 7.1 s; its baseline is 6.5 s (8.9 % longer)`."""
        what, verb, more, less = _WORDS[self.key[0]]
        name = f"{what} '{self.key[1]}'" if len(self.key) > 1 else what
        old = self.old
        if self.new is None:
            return f"{name} is missing; its baseline is {old}; `manipcli bless` writes a new baseline"
        if self.new.unit != self.old.unit:
            reason = "another part of the condition decides; `manipcli bless` writes a new baseline"
            return f"{name} {verb} {self.new}; its baseline is {old}: {reason}"
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
    """The path at which the baseline of a task file is written."""
    return task.with_name(f"{own_stem(task)}.baseline.json")


def kept_baseline(task: Path) -> Path:
    """The path from which the baseline of a task file is read.

    This is `baseline_path`, or else `a.baseline.json`, which earlier versions also wrote for `a.yml`, unless it belongs
    to another task file in the folder.
    """
    own, plain = baseline_path(task), task.with_name(f"{task.stem}.baseline.json")
    if own.exists() or not plain.exists():
        return own
    others = (file for file in task.parent.iterdir() if file.suffix.lower() in SUFFIXES and file.name != task.name)
    return own if any(task.stem in (file.stem, own_stem(file)) for file in others) else plain


def measured(verdict: Verdict, log: Path) -> Measures:
    """Durations, work and margins of a run.

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
    works = [step.work for step in step_measures(recording, recorded_robot(recording, log), verdict.steps)]
    known = [work for work in works if work is not None]
    if known:
        found["energy",] = Measure(math.fsum(known), "J")
    for expected in verdict.expectations:
        if expected.margin is not None and math.isfinite(expected.margin):
            found["margins", expected.name] = Measure(expected.margin, expected.unit)
    return found


def compared(old: Measures, new: Measures, tolerance: ToleranceSpec) -> tuple[Change, ...]:
    """Changes beyond the tolerance, worse or better, and numbers that cannot be compared.

    A time or an energy may grow, and a margin shrink, by its share of the old value, or by its floor if that is more.
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
        allowed = share_of(shares[key[0]], before.value, before.unit)
        loss = before.value - now.value if key[0] == "margins" else now.value - before.value
        if abs(loss) > allowed:
            yield Change(key, before, now, worse=loss > 0.0)


def write_baseline(path: Path, measures: Measures) -> None:
    """Writes a baseline, with sorted keys and rounded numbers: the same run gives the same bytes.

    Raises:
        OSError: the file cannot be written.
    """
    tree: dict[str, object] = dict(zip(ALWAYS, (0.0, {}, {}), strict=True))
    for key, measure in measures.items():
        value = float(f"{measure.value:.{DIGITS}g}")
        inner = tree[key[0]] if len(key) > 1 else None
        if isinstance(inner, dict):
            inner[key[1]] = {"unit": measure.unit, "value": value} if key[0] == "margins" else value
        else:
            tree[key[0]] = value
    write_whole(path, (json.dumps(tree, indent=1, sort_keys=True, ensure_ascii=False) + "\n").encode())


def read_baseline(path: Path) -> Measures | None:
    """The measures in a baseline file; None where the file is missing.

    Raises:
        InvalidInput: the file is not a baseline.
    """
    try:
        tree = json.loads(path.read_bytes(), parse_constant=_refuse)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidInput([_no_baseline(path, str(error))]) from None
    lacking = [key for key in ALWAYS if isinstance(tree, dict) and key not in tree]
    if lacking:
        raise InvalidInput([_no_baseline(path, f"it has no {listed([f'`{key}`' for key in lacking])}")])
    try:
        return dict(_measures(tree))
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        raise InvalidInput([_no_baseline(path, "a key or a number is invalid")]) from None


def is_baseline(path: Path) -> bool:
    """Whether `path` is a valid baseline."""
    try:
        return read_baseline(path) is not None
    except InvalidInput:
        return False


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not a number")


def _measures(tree: dict[str, object]) -> Iterator[tuple[Key, Measure]]:
    for key, value in tree.items():
        match key, value:
            case "duration", _:
                yield (key,), Measure(_number(value), "s")
            case "energy", _:
                yield (key,), Measure(_number(value), "J")
            case "steps", dict():
                yield from (((key, str(name)), Measure(_number(time), "s")) for name, time in value.items())
            case "margins", dict():
                for name, margin in value.items():
                    yield (key, str(name)), Measure(_number(margin["value"]), str(margin["unit"]))
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
    hint = "run `manipcli bless` to write a new one"
    return Diagnostic("USE087", f"the file is not a baseline: {why}", Place(str(path), 0, 0), hint=hint)
