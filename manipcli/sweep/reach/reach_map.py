"""A map: for each point of a grid whether the task can be planned with the object there, and why not."""

from __future__ import annotations

import shlex
from collections import Counter
from dataclasses import dataclass
from functools import cached_property

from manipcli.sweep.reach.grid import Grid
from manipcli.sweep.reach.placement import Placement
from manipcli.sweep.reach.question import PointResult, Question


@dataclass(frozen=True)
class ReachMap:
    """The results of a map.

    Attributes:
        task: its name.
        question: what its points have in common.
        placement: of the object.
        grid: the points.
        results: by number of the point; missing where it was interrupted.
    """

    task: str
    question: Question
    placement: Placement
    grid: Grid
    results: dict[int, PointResult]

    @cached_property
    def ordered(self) -> tuple[PointResult, ...]:
        """The results by number."""
        return tuple(self.results[number] for number in sorted(self.results))

    @property
    def planned(self) -> int:
        """Number of points with a plan."""
        return sum(result.planned for result in self.ordered)

    @property
    def missing(self) -> int:
        """Number of points that were not planned yet."""
        return self.grid.count - len(self.results)

    @cached_property
    def reasons(self) -> tuple[tuple[str, str, int], ...]:
        """Code, reason and number of points of each refusal, the commonest first."""
        counts = Counter((result.code, result.reason) for result in self.ordered if not result.planned)
        return tuple((*key, count) for key, count in sorted(counts.items(), key=lambda item: (-item[1], item[0])))

    @cached_property
    def cells(self) -> dict[tuple[int, int], tuple[PointResult, ...]]:
        """The results of each cell (row of y, column of x), one for each yaw."""
        found: dict[tuple[int, int], list[PointResult]] = {}
        for result in self.ordered:
            found.setdefault(self.grid.cell(result.number), []).append(result)
        return {cell: tuple(results) for cell, results in found.items()}

    @property
    def roomiest(self) -> PointResult | None:
        """The first planned point with the most clearance; None where none has one."""
        known = [result for result in self.ordered if result.clearance is not None]
        return max(known, key=lambda result: result.clearance or 0.0, default=None)

    @property
    def most_dexterous(self) -> PointResult | None:
        """The first planned point with the most manipulability; None where none has one."""
        known = [result for result in self.ordered if result.manipulability is not None]
        return max(known, key=lambda result: result.manipulability or 0.0, default=None)

    def first_refusal(self) -> PointResult | None:
        """The first point with the commonest reason."""
        first = next(iter(self.reasons), None)
        return next((one for one in self.ordered if first and (one.code, one.reason) == first[:2]), None)

    def command(self, number: int) -> str:
        """The shell command that plans a point alone."""
        question = self.question
        file = str(question.path)
        words = ["manipcli", "plan", f"./{file}" if file.startswith("-") else file, "--until", question.step]
        options = question.options
        if options.get("seed") is not None:
            words += ["--seed", str(options["seed"])]
        for override in (*options.get("overrides", ()), *self.placement.overrides(*self.grid.point(number))):
            words += ["--set", override]
        for place in options.get("package_path", ()):
            words += ["--package-path", str(place)]
        words += ["--allow-outside"] if options.get("allow_outside") else []
        return shlex.join(words)
