"""What the results of a sweep say: margins, ways of failing, and how much each number matters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from manipcli.sweep.one_at_a_time import Levels, levels
from manipcli.sweep.results import Margin, SampleResult
from manipcli.sweep.sampling import Column
from manipcli.sweep.statistics import Correlation, Indices, quantiles, rank_correlation, sobol_indices
from manipcli.sweep.sweep import Sweep

WORST: Final = 5
"""Number of samples listed as the worst."""
LEAST_BASE: Final = 8
"""Complete base points of `saltelli` from which indices are computed."""


@dataclass(frozen=True, slots=True)
class Spread:
    """The margins of an expectation over the samples: how many met it, of those that evaluated it, and `SHARES`."""

    name: str
    unit: str
    met: int
    evaluated: int
    quantiles: tuple[float, ...]
    telling: bool


@dataclass(frozen=True, slots=True)
class Influence:
    """How much a number matters; None where that cannot be computed.

    Attributes:
        correlation: with the smallest margin.
        passing: with whether the sample passed.
        indices: of the smallest margin, for `saltelli`.
        levels: at which it passes, for `oat`.
    """

    column: Column
    correlation: Correlation | None
    passing: Correlation | None
    indices: Indices | None
    levels: Levels | None = None

    @property
    def size(self) -> float:
        """To sort by."""
        if self.indices is not None:
            return self.indices.whole.value
        if self.levels is not None:
            return -self.levels.smallest
        return max((abs(found.rho) for found in (self.correlation, self.passing) if found is not None), default=-1.0)

    @property
    def matters(self) -> bool:
        """Whether more than chance."""
        return any(found is not None and found.matters for found in (self.correlation, self.passing))


@dataclass(frozen=True, slots=True)
class Failure:
    """A way of failing: the outcome, the step and the expectation, with the samples that fail so."""

    outcome: str
    step: str
    broken: str
    samples: tuple[int, ...]

    def __str__(self) -> str:
        """`step 'place_1'; expectation "..."`, or the outcome."""
        step = f"step '{self.step}'" if self.step else ""
        parts = [part for part in (step, self.broken) if part]
        if self.outcome != "failed" or not parts:
            parts.insert(0, self.outcome)
        return "; ".join(parts)


class Analysis:
    """The statistics of a sweep."""

    def __init__(self, sweep: Sweep) -> None:
        self.sweep = sweep
        self.values = {result.number: sweep.sampling.values(result.number) for result in sweep.results}

    @cached_property
    def spreads(self) -> tuple[Spread, ...]:
        """The expectations, in the order in which the first sample has them."""
        margins: dict[str, list[Margin]] = {}
        for result in self.sweep.results:
            for margin in result.margins:
                margins.setdefault(margin.name, []).append(margin)
        return tuple(_spread(name, found) for name, found in margins.items())

    @cached_property
    def failures(self) -> tuple[Failure, ...]:
        """The ways of failing, the most frequent first."""
        found: dict[tuple[str, str, str], list[int]] = {}
        for result in self.sweep.results:
            if not result.passed:
                found.setdefault((result.outcome, result.step, result.broken), []).append(result.number)
        ways = [Failure(*way, tuple(samples)) for way, samples in found.items()]
        return tuple(sorted(ways, key=lambda way: (-len(way.samples), way.samples)))

    @cached_property
    def worst(self) -> tuple[SampleResult, ...]:
        """The samples with the smallest margins, those that did not pass first."""
        order = sorted(self.sweep.results, key=lambda result: (result.passed, result.smallest, result.number))
        return tuple(order[:WORST])

    @cached_property
    def influences(self) -> tuple[Influence, ...]:
        """The numbers with more than one value, those that matter most first."""
        varied = [k for k in range(len(self.columns)) if len({values[k] for values in self.values.values()}) > 1]
        if self.sweep.sampling.design.word == "oat":
            return tuple(sorted(map(self._one_at_a_time, varied), key=lambda influence: -influence.size))
        indices = self._indices
        results = [(result.smallest, result.passed) for result in self.sweep.results]
        several = sum(len(set(column)) > 1 for column in zip(*results, strict=True))  # with margin, with passing
        correlations = [self._correlations(k, of=several * len(varied)) for k in varied]
        found = [
            Influence(self.columns[k], *pair, indices.get(self.columns[k].dimension))
            for k, pair in zip(varied, correlations, strict=True)
        ]
        return tuple(sorted(found, key=lambda influence: -influence.size))

    @property
    def indistinct(self) -> bool:
        """Whether no result differs from another, so that nothing can be said of the numbers."""
        return all(
            one.correlation is None and one.passing is None and one.indices is None and one.levels is None
            for one in self.influences
        )

    @property
    def columns(self) -> tuple[Column, ...]:
        return self.sweep.sampling.columns

    @property
    def outcomes(self) -> Counter[str]:
        """Number of samples by outcome."""
        return Counter(result.outcome for result in self.sweep.results)

    def _correlations(self, k: int, *, of: int) -> tuple[Correlation | None, Correlation | None]:
        """Of column k with smallest margin and passing, over the independent samples: A and B of `saltelli`."""
        used: Sequence[SampleResult] = self.sweep.results
        if self.sweep.sampling.design.word == "saltelli":
            used = [result for result in used if result.number % (self.sweep.sampling.dimensions + 2) < 2]
        x = [self.values[result.number][k] for result in used]
        results = ([result.smallest for result in used], [float(result.passed) for result in used])
        return rank_correlation(x, results[0], of=of), rank_correlation(x, results[1], of=of)

    def _one_at_a_time(self, k: int) -> Influence:
        values = {number: own[k] for number, own in self.values.items()}
        return Influence(self.columns[k], None, None, None, levels(self.columns[k], values, self.sweep.results))

    @cached_property
    def _indices(self) -> dict[int, Indices]:
        """By dimension; empty for other designs than `saltelli`."""
        if self.sweep.sampling.design.word != "saltelli":
            return {}
        block = self.sweep.sampling.dimensions + 2
        scores = {result.number: result.score for result in self.sweep.results}
        bases = [k for k in range(self.sweep.asked // block) if all(k * block + j in scores for j in range(block))]
        if len(bases) < LEAST_BASE:
            return {}
        rows = np.array([[scores[k * block + j] for j in range(block)] for k in bases])
        found = sobol_indices(rows[:, 0], rows[:, 1], rows[:, 2:])
        return {} if found is None else dict(enumerate(found))


def _spread(name: str, margins: Sequence[Margin]) -> Spread:
    evaluated = [margin for margin in margins if margin.value is not None]
    values = [value for margin in evaluated if (value := margin.finite) is not None]
    return Spread(
        name,
        evaluated[0].unit if evaluated else "",
        sum(not margin.missed for margin in evaluated),
        len(evaluated),
        quantiles(values) if values else (),
        bool(values) and any(margin.telling for margin in margins),
    )
