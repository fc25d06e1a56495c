"""Designs: which point of the unit cube each sample of a task is, and the values that follow.

A design of N points gives every dimension, a varied number, one coordinate u in [0, 1] per sample; the quantile
function of the number's distribution makes it a value (`Varied.value`).

    random    u is drawn for each sample and path alone (`deviate`): N does not matter
    lhs       Latin hypercube: each of N equal intervals of each dimension has one sample (McKay et al. 1979)
    sobol     points of Sobol, with a digital shift drawn from the seed (Joe and Kuo 2008, scipy.stats.qmc)
    grid      all combinations of levels, at most N in all
    oat       one at a time: the task as written, then each number at its levels, at most N in all
    saltelli  for Sobol's first-order indices: N (d + 2) samples of d dimensions (Saltelli et al. 2010)

All of them are functions of design, N, seed, number and paths. The blocks of `saltelli` are A, B, AB_1 .. AB_d for each
of N base points; AB_j is A with dimension j of B.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal, get_args

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import did_you_mean, escape
from manipcli.judge.drawn import Drawn
from manipcli.task.vary import Varied, deviate

DesignWord = Literal["random", "grid", "lhs", "sobol", "oat", "saltelli"]
WORDS: Final[tuple[DesignWord, ...]] = get_args(DesignWord)
LARGEST: Final = 1 << 24
"""Largest N of a design."""
_COUNT: Final = re.compile("[0-9]{1,15}")
_BITS: Final = 30
Coordinates = tuple[float | None, ...]
"""One per dimension; None: the value in the file."""


@dataclass(frozen=True, slots=True)
class Design:
    """A design and its N; 0 for `random`, which has no last sample."""

    word: DesignWord = "random"
    count: int = 0

    def __str__(self) -> str:
        """`sobol:256`; `random`."""
        return self.word if self.word == "random" else f"{self.word}:{self.count}"

    @staticmethod
    def read(text: str) -> Design:
        """The design of a text such as `sobol:256`; "" is `random`.

        Raises:
            InvalidInput: it is not a design.
        """
        word, _, count = (text or "random").partition(":")
        for known in WORDS:
            if word == known == "random" and not count:
                return Design()
            if word == known != "random" and _COUNT.fullmatch(count):
                if 0 < int(count) <= LARGEST:
                    return Design(known, int(count))
                message = f"N of '{word}' is {count}; expected 1 to {LARGEST}"
                raise InvalidInput([Diagnostic("USE181", message)])
        hint = did_you_mean(word, WORDS, kind="designs") if word not in WORDS else None
        if word in WORDS:
            hint = "write --design random" if word == "random" else f"write the number of points: {word}:256"
        raise InvalidInput([Diagnostic("USE180", f"'{escape(text)}' is not a design", hint=hint)])

    @property
    def spreads(self) -> bool:
        """Whether samples are spread over the distributions, so that their success rate estimates that of the task.

        A `grid` has its levels at the ends, `oat` changes one number at a time, `saltelli` repeats numbers.
        """
        return self.word in ("random", "lhs", "sobol")

    def has(self, quantity: Varied, k: int) -> bool:
        """Whether component k of a quantity is a dimension: one with a single value is not, except for `oat`, which
        compares it with the value in the file."""
        return self.word in ("random", "oat") or quantity.values(k) > 1

    def total(self, varied: Sequence[Varied]) -> int | None:
        """Number of samples; None for `random`, which has no end.

        Raises:
            InvalidInput: the design has no such N.
        """
        dimensions = _dimensions(self, varied)
        match self.word:
            case "random":
                return None
            case "grid":
                return math.prod(_grid(self.count, dimensions))
            case "oat":
                return 1 + sum(_one_at_a_time(self.count, dimensions))
            case "saltelli":
                if self.count & (self.count - 1):
                    below = 1 << (self.count.bit_length() - 1)
                    message = f"N of 'saltelli' is {self.count}; expected a power of two"
                    raise InvalidInput([Diagnostic("USE181", message, hint=f"use N = {below} or N = {2 * below}")])
                return self.count * (len(dimensions) + 2)
        return self.count


@dataclass(frozen=True, slots=True)
class _Dimension:
    """One number that is drawn: the path of its quantity, its component, and how many values it has (`inf`)."""

    path: str
    component: int
    values: float
    ends: bool

    def level(self, k: int, of: int) -> float:
        """The coordinate of level k: from end to end of a `uniform`, else the middle of equal shares."""
        if self.ends and of > 1:
            return k / (of - 1)
        return (k + 0.5) / of


def draw(varied: Sequence[Varied], seed: int, sample: int, design: Design = Design()) -> Drawn:
    """Draws sample `sample` of all quantities, in their order. Quantities without a coordinate are left out.

    Raises:
        InvalidInput: the design has no such N.
        IndexError: the design has no such sample.
    """
    if design.word == "random":
        point = iter(_random(varied, seed, sample))
    else:
        point = iter(_point(design, tuple(varied), seed, sample))
    values = []
    for quantity in varied:
        own = [next(point) if design.has(quantity, k) else 0.5 for k in range(quantity.dimensions)]
        if any(u is not None for u in own):
            values.append((quantity.path, quantity.value(own)))
    return Drawn(sample, tuple(values), "" if design.word == "random" else str(design))


def _random(varied: Sequence[Varied], seed: int, sample: int) -> Coordinates:
    """Independent deviates; the items of each `grid` in turn, the last one fastest."""
    rest, point = sample, list[float]()
    for quantity in reversed(varied):
        for k in reversed(range(quantity.dimensions)):
            if quantity.law.word == "grid":
                rest, item = divmod(rest, len(quantity.law.rows))
                point.append((item + 0.5) / len(quantity.law.rows))
            else:
                point.append(deviate(seed, sample, quantity.path, k))
    return tuple(reversed(point))


def _point(design: Design, varied: tuple[Varied, ...], seed: int, sample: int) -> Coordinates:
    dimensions = _dimensions(design, varied)
    total = design.total(varied)
    if total is not None and sample >= total:
        raise IndexError(f"design '{design}' has samples 0 to {total - 1}")
    match design.word:
        case "grid":
            return _on_grid(_grid(design.count, dimensions), dimensions, sample)
        case "oat":
            return _at_one(_one_at_a_time(design.count, dimensions), dimensions, sample)
        case "lhs":
            ranks = _ranks(design.count, dimensions, seed)
            return tuple(
                (ranks[j][sample] + deviate(seed, sample, f"lhs/{dimension.path}", dimension.component)) / design.count
                for j, dimension in enumerate(dimensions)
            )
        case "saltelli":
            base, block = divmod(sample, len(dimensions) + 2)
            a, b = _sobol(dimensions, seed, base, twice=True)
            if block < 2:
                return (a, b)[block]
            return tuple(b[j] if j == block - 2 else u for j, u in enumerate(a))
    return _sobol(dimensions, seed, sample)[0]


def _dimensions(design: Design, varied: Sequence[Varied]) -> tuple[_Dimension, ...]:
    return tuple(
        _Dimension(
            quantity.path, k, quantity.values(k), ends=quantity.law.word == "uniform" and math.isinf(quantity.values(k))
        )
        for quantity in varied
        for k in range(quantity.dimensions)
        if design.has(quantity, k)
    )


def _levels(dimensions: Sequence[_Dimension], most: int) -> tuple[int, ...]:
    return tuple(int(min(dimension.values, most)) for dimension in dimensions)


def _grid(count: int, dimensions: Sequence[_Dimension]) -> tuple[int, ...]:
    """Levels per dimension: as many as fit into `count` combinations, but every item of a choice."""
    items = math.prod(int(dimension.values) for dimension in dimensions if math.isfinite(dimension.values))
    continuous = sum(math.isinf(dimension.values) for dimension in dimensions)
    least = items * 2**continuous
    if count < least:
        message = f"a grid of these {len(dimensions)} numbers has at least {least} samples; N is {count}"
        raise InvalidInput([Diagnostic("USE181", message, hint=f"use N = {least} or more, or the design lhs or sobol")])
    most = 2
    while continuous and items * (most + 1) ** continuous <= count:
        most += 1
    return tuple(int(each.values) if math.isfinite(each.values) else most for each in dimensions)


def _one_at_a_time(count: int, dimensions: Sequence[_Dimension]) -> tuple[int, ...]:
    """Levels per dimension."""
    most = (count - 1) // len(dimensions)
    if most < 1:
        least = 1 + len(dimensions)
        message = f"one-at-a-time of {len(dimensions)} numbers has at least {least} samples; N is {count}"
        raise InvalidInput([Diagnostic("USE181", message, hint=f"use N = {least} or more")])
    return _levels(dimensions, most)


def _on_grid(levels: Sequence[int], dimensions: Sequence[_Dimension], sample: int) -> Coordinates:
    """The last dimension varies fastest."""
    point = []
    for dimension, of in zip(reversed(dimensions), reversed(levels), strict=True):
        sample, k = divmod(sample, of)
        point.append(dimension.level(k, of))
    return tuple(reversed(point))


def _at_one(levels: Sequence[int], dimensions: Sequence[_Dimension], sample: int) -> Coordinates:
    point: list[float | None] = [None] * len(levels)
    k = sample - 1
    for j, of in enumerate(levels):
        if 0 <= k < of:
            point[j] = dimensions[j].level(k, of)
        k -= of
    return tuple(point)


@lru_cache(maxsize=4)
def _ranks(count: int, dimensions: tuple[_Dimension, ...], seed: int) -> tuple[tuple[int, ...], ...]:
    """A permutation of the intervals per dimension; forked runs inherit it."""
    ranks = []
    for dimension in dimensions:
        keys = [deviate(seed, k, f"lhs/rank/{dimension.path}", dimension.component) for k in range(count)]
        order = sorted(range(count), key=keys.__getitem__)
        ranks.append(tuple(order))
    return tuple(ranks)


def _sobol(
    dimensions: tuple[_Dimension, ...], seed: int, number: int, *, twice: bool = False
) -> tuple[tuple[float, ...], ...]:
    """Point `number`, with one block of coordinates, or two."""
    from scipy.stats import qmc

    halves = 2 if twice else 1
    engine = qmc.Sobol(halves * len(dimensions), scramble=False, bits=_BITS)
    if number:
        engine.fast_forward(number)
    point = iter(engine.random(1)[0])
    return tuple(
        tuple(
            ((int(next(point) * 2**_BITS) ^ _shift(seed, half, dimension)) + 0.5) / 2**_BITS for dimension in dimensions
        )
        for half in range(halves)
    )


def _shift(seed: int, half: int, dimension: _Dimension) -> int:
    return int(deviate(seed, half, f"sobol/{dimension.path}", dimension.component) * 2**_BITS)
