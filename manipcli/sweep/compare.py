"""Comparison of two sweeps by their CSV files: the same samples before and after a change of code, gains or engine."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput, Place
from manipcli.core.text import escape, listed
from manipcli.report.display_quantity import quantity
from manipcli.report.table import table
from manipcli.sweep.statistics import Rate, Shift, shift, two_sided
from manipcli.sweep.table import FIXED, MARGIN

MOST_SHOWN: Final = 10
"""Number of samples named in the text."""
SMALLEST: Final = "smallest_margin"


@dataclass(frozen=True, slots=True)
class _Side:
    """A CSV file: the rows by sample, and the names of its columns."""

    path: Path
    rows: Mapping[int, Mapping[str, str]]
    margins: tuple[str, ...]
    numbers: tuple[str, ...]


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
    numbers = sorted(one.rows.keys() & other.rows.keys())
    if not numbers:
        raise InvalidInput([Diagnostic("USE188", f"'{a}' and '{b}' have no sample in common")])
    _refuse_other_samples(one, other, numbers)
    pairs = [(one.rows[number], other.rows[number]) for number in numbers]
    verdicts = [(first["outcome"] == "passed", second["outcome"] == "passed") for first, second in pairs]
    worse = tuple(n for n, (before, after) in zip(numbers, verdicts, strict=True) if before and not after)
    better = tuple(n for n, (before, after) in zip(numbers, verdicts, strict=True) if after and not before)
    shifts = {}
    for name in (SMALLEST, *(name for name in one.margins if name in other.margins)):
        both = [(float(x[name]), float(y[name])) for x, y in pairs if x[name] and y[name]]
        if both:
            shifts[name] = shift([after - before for before, after in both])
    return Comparison(
        Rate(sum(before for before, _ in verdicts), len(pairs)),
        Rate(sum(after for _, after in verdicts), len(pairs)),
        len(one.rows.keys() ^ other.rows.keys()),
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
    word = "worse" if compared.is_worse else "not significantly different"
    if not compared.is_worse and compared.significant:
        word = "better"
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
    label = name.removeprefix(MARGIN)
    head, mark, unit = label.rpartition(" [")
    return (head, unit.removesuffix("]")) if mark and unit.endswith("]") else (label, "")


def _signed(value: float, unit: str) -> str:
    text = quantity(value, unit)
    return f"+{text}" if value > 0.0 else text.replace("-", "−")


def _read(path: Path) -> _Side:
    """
    Raises:
        InvalidInput: it is not the CSV of a sweep; names the line.
    """
    with path.open(encoding="utf-8", newline="") as stream:
        reader = csv.reader(stream)
        try:
            names = tuple(next(reader, []))
            if names[: len(FIXED)] != FIXED:
                raise ValueError(f"expected the columns {', '.join(FIXED)} first")
            margins = tuple(name for name in names if name.startswith(MARGIN))
            rows = {}
            for row in reader:
                cells = dict(zip(names, row, strict=True))
                for name in (SMALLEST, *margins):
                    float(cells[name] or 0.0)
                rows[int(cells["sample"])] = cells
        except (ValueError, csv.Error) as error:
            message = f"not the CSV of a sweep: {escape(str(error))}"
            hint = "write one with `manipcli sweep TASK --csv FILE`"
            raise InvalidInput(
                [Diagnostic("USE187", message, Place(str(path), max(1, reader.line_num), 1), hint=hint)]
            ) from None
    return _Side(path, rows, margins, tuple(name for name in names[len(FIXED) :] if name not in margins))


def _refuse_other_samples(one: _Side, other: _Side, numbers: Sequence[int]) -> None:
    """
    Raises:
        InvalidInput: a number that both vary has other values in a sample; they are not pairs.
    """
    shared = [name for name in one.numbers if name in other.numbers]
    cause = ""
    if not shared:
        cause = "they vary no number in common"
    for number in numbers:
        for name in shared:
            a, b = one.rows[number][name], other.rows[number][name]
            if a != b and not cause:
                cause = f"'{escape(name)}' is {float(a):.4g} and {float(b):.4g} in sample {number}"
    if cause:
        message = f"'{one.path}' and '{other.path}' are not sweeps of the same samples: {cause}"
        raise InvalidInput([Diagnostic("USE188", message, hint="use the same design, seed and `vary:` for both")])
