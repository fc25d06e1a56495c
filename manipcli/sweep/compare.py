"""Comparison of two sweeps by their CSV files: the same samples before and after a change of code, gains or engine."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from manipcli.conditions.robustness import EDGE
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput, Place
from manipcli.core.text import any_of, distinguished, escape, listed, shorten
from manipcli.report.display_quantity import quantity
from manipcli.report.table import table
from manipcli.sweep.results import WORDS
from manipcli.sweep.statistics import Rate, Shift, shift, two_sided
from manipcli.sweep.table import FIXED, MARGIN

MOST_SHOWN: Final = 10
"""Number of samples named in the text."""
SMALLEST: Final = "smallest_margin"


ROUNDING: Final = 1e-6
"""Relative difference of two margins that counts as equal: processors and libraries round differently."""


@dataclass(frozen=True, slots=True)
class _Row:
    """A sample: its margins by the name of their column, None where not evaluated, and the values of its numbers."""

    passed: bool
    margins: Mapping[str, float | None]
    numbers: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two sweeps, paired by sample.

    Attributes:
        a, b: the rate of each over the paired samples.
        alone: number of samples that only one of them has.
        worse, better: samples that passed in a only, and in b only.
        p: of McNemar's test, exact and two-sided.
        shifts: of each margin, b minus a, by the name of its column.
        alpha: level of significance.
        with_margins: a margin that is significantly smaller makes the result worse, too.
    """

    a: Rate
    b: Rate
    alone: int
    worse: tuple[int, ...]
    better: tuple[int, ...]
    p: float
    shifts: Mapping[str, Shift]
    alpha: float
    with_margins: bool

    @property
    def significant(self) -> bool:
        """Whether the success rates differ significantly."""
        return self.p < self.alpha

    @property
    def smaller(self) -> tuple[str, ...]:
        """The margins that are significantly smaller in b, by sign tests with Holm's correction."""
        order = sorted(self.shifts.items(), key=lambda item: item[1].p)
        found = []
        for k, (name, of) in enumerate(order):
            if of.p * (len(order) - k) >= self.alpha:
                break
            found += [name] if of.less > of.more else []
        return tuple(name for name in self.shifts if name in found)

    @property
    def is_worse(self) -> bool:
        rates = self.significant and len(self.worse) > len(self.better)
        return rates or (self.with_margins and bool(self.smaller))

    @property
    def exit_code(self) -> ExitCode:
        return ExitCode.FAILED if self.is_worse else ExitCode.PASSED


def compare_sweeps(a: Path, b: Path, *, alpha: float, with_margins: bool = False) -> Comparison:
    """Compares two CSV files of sweeps.

    Raises:
        InvalidInput: a file is not the CSV of a sweep, or they have no samples in common, or other values in a sample.
    """
    one, other = _read(a), _read(b)
    pairs = {number: (one[number], other[number]) for number in sorted(one.keys() & other.keys())}
    if cause := _difference_of_samples(pairs):
        message = f"'{a}' and '{b}' are not sweeps of the same samples: {cause}"
        raise InvalidInput([Diagnostic("USE188", message, hint="use the same design, seed and `vary:` for both")])
    worse = tuple(number for number, (before, after) in pairs.items() if before.passed and not after.passed)
    better = tuple(number for number, (before, after) in pairs.items() if after.passed and not before.passed)
    shifts = {}
    for name in next(iter(pairs.values()))[0].margins:
        both = [(before.margins[name], after.margins.get(name)) for before, after in pairs.values()]
        if found := [_change(a, b) for a, b in both if a is not None and b is not None]:
            shifts[name] = shift(found)
    return Comparison(
        Rate(sum(before.passed for before, _ in pairs.values()), len(pairs)),
        Rate(sum(after.passed for _, after in pairs.values()), len(pairs)),
        len(one.keys() ^ other.keys()),
        worse,
        better,
        two_sided(len(worse), len(better)),
        shifts,
        alpha,
        with_margins,
    )


def render_text(compared: Comparison) -> str:
    """Rates, the test, the samples that changed, and the shift of each margin."""
    a, b = compared.a, compared.b
    word = "not significantly different"
    if compared.significant:
        word = "worse" if len(compared.worse) > len(compared.better) else "better"
    if compared.is_worse and word != "worse":
        word = "smaller margins" if not compared.significant else f"{word}, but smaller margins"
    lines = [
        f"{word}: {b.passed} of {b.count} samples passed, {a.passed} before",
        f"McNemar's test: p = {compared.p:.2g} (alpha {compared.alpha:g}); "
        f"{len(compared.worse)} pass no more, {len(compared.better)} pass now",
    ]
    for label, samples in (("pass no more", compared.worse), ("pass now", compared.better)):
        if samples:
            lines.append(f"{label}: samples {listed(map(str, samples), most=MOST_SHOWN)}")
    if compared.alone:
        lines.append(f"not compared: {compared.alone} samples that only one file has")
    rows = []
    for name, of in compared.shifts.items():
        label, unit = _split(name)
        low, high = of.interval
        interval = "-" if of.count < 6 else f"{_signed(low, unit)} to {_signed(high, unit)}"
        mark = "smaller" if name in compared.smaller else ""
        rows.append((label, _signed(of.median, unit), interval, str(of.less), str(of.more), f"{of.p:.2g}", mark))
    headers = ("margin", "median shift", "95 % interval", "smaller", "greater", "p", "")
    return "\n".join([*lines, "", table(headers, rows, right=headers[1:6])])


def render_json(compared: Comparison) -> str:
    """The comparison as one JSON object."""
    rates = {
        name: {"passed": rate.passed, "count": rate.count, "interval": rate.interval}
        for name, rate in (("a", compared.a), ("b", compared.b))
    }
    shifts = {
        name: {**asdict(of), "interval": None if of.count < 6 else of.interval} for name, of in compared.shifts.items()
    }
    found = {
        "result": "worse" if compared.is_worse else "better" if compared.significant else "same",
        **rates,
        "not_compared": compared.alone,
        "worse": compared.worse,
        "better": compared.better,
        "p": compared.p,
        "alpha": compared.alpha,
        "shifts": shifts,
        "smaller": compared.smaller,
    }
    return json.dumps(found, indent=2)


def _split(name: str) -> tuple[str, str]:
    """A column of margins as its expectation and unit."""
    if name == SMALLEST:
        return "smallest, in tolerances", ""
    label = escape(name.removeprefix(MARGIN))
    head, mark, unit = label.rpartition(" [")
    return (head, unit.removesuffix("]")) if mark and unit.endswith("]") else (label, "")


def _signed(value: float, unit: str) -> str:
    text = quantity(value, unit)
    return f"+{text}" if value > 0.0 else text.replace("-", "−")


def _change(before: float, after: float) -> float:
    """The change of a margin; 0 where it is a difference of rounding."""
    return 0.0 if math.isclose(before, after, rel_tol=ROUNDING, abs_tol=EDGE) else after - before


def _read(path: Path) -> dict[int, _Row]:
    """The rows of a sweep by sample.

    Raises:
        InvalidInput: it is not the CSV of a sweep; names the line.
    """
    with path.open(encoding="utf-8", newline="") as stream:
        reader = csv.reader(stream, strict=True)
        rows: dict[int, _Row] = {}
        try:
            names = next(reader, [])
            if tuple(names[: len(FIXED)]) != FIXED:
                raise ValueError(f"expected the columns {', '.join(FIXED)} first")
            if double := next((name for k, name in enumerate(names) if name in names[:k]), None):
                raise ValueError(f"two columns '{double}'")
            for cells in reader:
                number, row = _row(names, cells)
                if number in rows:
                    raise ValueError(f"sample {number} is there twice")
                rows[number] = row
        except (ValueError, csv.Error) as error:
            cause = "not UTF-8 text" if isinstance(error, UnicodeDecodeError) else escape(str(error))
            place = Place(str(path), max(1, reader.line_num), 1)
            hint = "write one with `manipcli sweep TASK --csv FILE`"
            message = f"not the CSV of a sweep: {cause}"
            raise InvalidInput([Diagnostic("USE187", message, place, hint=hint)]) from None
    return rows


def _row(names: Sequence[str], cells: Sequence[str]) -> tuple[int, _Row]:
    """
    Raises:
        ValueError: it is not a row of a sweep.
    """
    if len(cells) != len(names):
        raise ValueError(f"{len(cells)} cells, expected {len(names)}; the file may be cut off")
    by_name = dict(zip(names, cells, strict=True))
    number, outcome = by_name["sample"], by_name["outcome"]
    if not (number.isascii() and number.isdecimal()):
        raise ValueError(f"'{shorten(number)}' is not the number of a sample")
    if outcome not in WORDS:
        raise ValueError(f"'{shorten(outcome)}' is not an outcome, expected {any_of(WORDS)}")
    margins = [name for name in names if name == SMALLEST or name.startswith(MARGIN)]
    return int(number), _Row(
        outcome == "passed",
        {name: _finite(name, by_name[name]) if by_name[name] else None for name in margins},
        {name: _finite(name, by_name[name]) for name in names[len(FIXED) :] if name not in margins},
    )


def _finite(name: str, cell: str) -> float:
    """
    Raises:
        ValueError: it is not a finite number.
    """
    with suppress(ValueError):
        if math.isfinite(value := float(cell)):
            return value
    raise ValueError(f"'{shorten(cell)}' is not a number, in column '{name}'")


def _difference_of_samples(pairs: Mapping[int, tuple[_Row, _Row]]) -> str:
    """Why the rows are not pairs, "" if they are: a number that both vary has the same value in each."""
    if not pairs:
        return "they have no sample in common"
    for number, (before, after) in pairs.items():
        shared = [name for name in before.numbers if name in after.numbers]
        if not shared:
            return "they vary no number in common"
        for name in shared:
            if before.numbers[name] != after.numbers[name]:
                a, b = distinguished(before.numbers[name], after.numbers[name])
                return f"'{escape(name)}' is {a} and {b} in sample {number}"
    return ""
