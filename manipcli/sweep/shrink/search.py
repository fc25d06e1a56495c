"""The search for the failing point nearest to the origin.

1. `outward`, if no failing point is known: along the worst sample and the axes, to and beyond the declared spread.
2. `nearest`: bisection towards the origin, then in turns: coordinates set to the value as written, single coordinates
   halved, and directions near the best one, of which the first is the normal of a plane between passed and failed
   trials: the point of a plane nearest to the origin is along its normal, as in first-order reliability (Hasofer and
   Lind 1974).
3. `confirmed`: the same change at 0.9 of the distance must not fail; if it does, the search goes on from there.

Nothing assumes that failures are monotone: each accepted point was run and fails. The points of a batch do not depend
on the number of workers, so that the result does not.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from manipcli.sweep.shrink.space import Point, Space
from manipcli.sweep.shrink.trial import Evaluate, Fails, Trial

PARTS: Final = (0.25, 0.5, 0.75)
"""Points between a passed and a failed one that are run together."""
FIRST_PARTS: Final = (0.5, 0.8, 0.92)
"""The same between the task as written and a failed one."""
COARSE: Final = 0.1
"""Width of the interval of a bisection while searching, in distances of the failing point."""
FINE: Final = 0.01
"""The same at the end."""
NEARER: Final = 0.9
"""Share of the distance at which the change must not fail."""
RADII: Final = (1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0)
"""Distances of `outward`, in reaches of the declared spread."""
RETREATS: Final = 3
"""Attempts between the last point that runs and one that is refused."""
DIRECTIONS: Final = 5
"""Random directions near the best that are tried together."""
WIDEST: Final = 0.6
"""Deviation of these directions at first, relative to the distance."""
NARROWEST: Final = 0.1
"""The search ends below this deviation."""
GAIN: Final = 0.97
"""Share of the distance at which they are tried."""
SMALL: Final = 0.2
"""Share of the distance below which a coordinate is small."""
NEWTON: Final = 8
"""Iterations of the regression."""
RIDGE: Final = 0.01
"""Its ridge."""
STARTS: Final = 3
"""Failing points from which the search begins."""


class Search:
    """A search; `best` is the nearest failing trial so far, also after an interrupt."""

    def __init__(self, space: Space, evaluate: Evaluate, fails: Fails, *, seed: int) -> None:
        """
        Args:
            space: the coordinates.
            evaluate: runs the task.
            fails: which trials count.
            seed: of the directions.
        """
        self.best: Trial | None = None
        self._space, self._run, self._fails = space, evaluate, fails
        self._seen: dict[Point, Trial] = {}
        self._rng = random.Random(seed)

    def outward(self, first: Sequence[Sequence[float]]) -> tuple[Point, ...]:
        """Goes along directions until something fails.

        Args:
            first: directions to try first; the axes follow.

        Returns:
            The failing points, the nearest first; empty if all directions end without one.

        Raises:
            Spent: the budget ended before.
        """
        d = len(self._space.coordinates)
        axes = [[sign * (k == j) for k in range(d)] for j in range(d) for sign in (1.0, -1.0)]
        rays = [_Ray(_unit(u), self._space.reach(_unit(u))) for u in (*first, *axes) if any(u)]
        for _ in range(len(RADII) + RETREATS):
            going = [ray for ray in rays if not ray.ended]
            if not going:
                break
            points = [self._space.point([ray.next * c for c in ray.direction]) for ray in going]
            trials = self._evaluate(points, "going outward")
            failed = [trial for trial in trials if self._fails(trial)]
            for ray, trial in zip(going, trials, strict=True):
                ray.advance(refused=trial.outcome != "passed")
            if failed:
                return tuple(sorted((trial.point for trial in failed), key=lambda point: point.distance))
        return ()

    def nearest(self, starts: Sequence[Point]) -> None:
        """Searches from failing points until nothing nearer is found.

        Raises:
            Spent: the budget ended before.
        """
        for trial in self._evaluate(starts[:STARTS], "starting"):
            if self.consider([trial]):
                self._bisect(COARSE)
        if self.best is None:
            return
        self._each(lambda x, k: 0.0, "dropping numbers")
        self._each(lambda x, k: 0.5 * x[k], "halving numbers")
        self._bisect(COARSE)
        width = WIDEST
        while len(self._space.coordinates) > 1 and width >= NARROWEST:
            way = self.best.way
            if self.consider(self._evaluate([*self._around(width)], "trying directions")):
                self._bisect(COARSE)
            else:
                width *= 0.6
            if self.best.way != way:  # other numbers matter
                self._each(lambda x, k: 0.0, "dropping numbers")
            self._drop_small()
        self._each(lambda x, k: 0.0, "dropping numbers")

    def confirmed(self) -> Trial | None:
        """Narrows the best trial, and returns that at 0.9 of its distance, which does not fail; None without a best.

        Raises:
            Spent: the budget ended before.
        """
        while self.best is not None:
            self._bisect(FINE)
            (nearer,) = self._evaluate([self._scaled(self.best.point, NEARER)], "confirming")
            if not self.consider([nearer]):
                return nearer
        return None

    def _evaluate(self, points: Sequence[Point], doing: str) -> list[Trial]:
        trials = self._run(points, doing)
        self._seen |= {trial.point: trial for trial in trials}
        return trials

    def consider(self, trials: Sequence[Trial]) -> bool:
        """Whether one of the trials fails nearer than the best, which it then is."""
        failing = [trial for trial in trials if self._fails(trial)]
        found = min(failing, key=lambda trial: trial.point.distance, default=None)
        if found is None or (self.best is not None and found.point.distance >= self.best.point.distance):
            return False
        self.best = found
        return True

    def _bisect(self, width: float) -> None:
        """Moves the best towards the origin until a point that does not fail is close before it."""
        assert self.best is not None
        low, high, end = 0.0, 1.0, self.best
        while high - low > width * high:
            # Most often the nearest failure on the ray is close to the best.
            shares = [low + (high - low) * part for part in (PARTS if low else FIRST_PARTS)]
            points = [self._scaled(end.point, share) for share in shares]
            if len({end.point, self._scaled(end.point, low), *points}) < len(points) + 2:
                return  # as fine as the amounts are rounded
            trials = self._evaluate(points, "bisecting")
            first = next((k for k, trial in enumerate(trials) if self._fails(trial)), len(points))
            low, high = [low, *shares][first], [*shares, high][first]
            self.consider(trials[first : first + 1])

    def _each(self, changed: Callable[[Sequence[float], int], float], doing: str) -> None:
        """Changes one coordinate of the best at a time, as long as that is still a failure."""
        while self.best is not None and len(self.best.point.changed) > 1:
            x = self.best.point.x
            points = [
                self._space.point([changed(x, k) if j == k else u for j, u in enumerate(x)])
                for k in self.best.point.changed
            ]
            if not self.consider(self._evaluate(points, doing)):
                return

    def _drop_small(self) -> None:
        """Sets the coordinates that are small in the best to the value as written, if it still fails."""
        assert self.best is not None
        x, r = self.best.point.x, self.best.point.distance
        small = self._space.point([u if abs(u) > SMALL * r else 0.0 for u in x])
        if small != self.best.point:
            self.consider(self._evaluate([small], "dropping numbers"))

    def _around(self, width: float) -> Iterator[Point]:
        """Points a little nearer than the best, in other directions."""
        assert self.best is not None
        x, r = self.best.point.x, self.best.point.distance
        directions = [self._normal()]
        while len(directions) < DIRECTIONS:
            scale = width * r / math.sqrt(len(x))
            directions.append([u + scale * self._rng.gauss(0.0, 1.0) for u in x])
        for direction in directions:
            unit = _unit(direction)
            yield self._space.point([GAIN * r * u for u in unit])

    def _normal(self) -> list[float]:
        """Normal of the plane that divides the trials near the best into failing ones and others (logistic regression
        with a small ridge, by Newton's method)."""
        import numpy as np

        assert self.best is not None
        r = self.best.point.distance
        near = [trial for trial in self._seen.values() if math.dist(trial.point.x, self.best.point.x) < r]
        rows = np.array([[*trial.point.x, r] for trial in near]) / r
        fails = np.array([float(self._fails(trial)) for trial in near])
        weights = np.zeros(rows.shape[1])
        for _ in range(NEWTON):
            p = 1.0 / (1.0 + np.exp(-rows @ weights))
            gradient = rows.T @ (p - fails) + RIDGE * weights
            hessian = (rows.T * (p * (1.0 - p))) @ rows + RIDGE * np.eye(len(weights))
            weights = weights - np.linalg.solve(hessian, gradient)
        normal = [float(u) for u in weights[:-1]]
        return (
            normal if sum(u * x for u, x in zip(normal, self.best.point.x, strict=True)) > 0.0 else [*self.best.point.x]
        )

    def _scaled(self, point: Point, share: float) -> Point:
        return self._space.point([share * u for u in point.x])


class _Ray:
    """A direction of `outward`: the next distance, and the retreat from what is refused."""

    def __init__(self, direction: Sequence[float], reach: float) -> None:
        self.direction = direction
        self.ended = False
        self._distances = [radius * reach for radius in RADII]
        self._ran, self._refused, self._k, self._retreats = 0.0, math.inf, 0, 0
        self.next = self._distances[0]

    def advance(self, *, refused: bool) -> None:
        """Chooses the next distance: farther, or halfway back where something was refused."""
        self._ran, self._refused = (self._ran, self.next) if refused else (self.next, self._refused)
        if self._refused < math.inf:
            self._retreats += 1
            self.next = 0.5 * (self._ran + self._refused)
            self.ended = self._retreats > RETREATS
            return
        self._k += 1
        self.ended = self._k == len(self._distances)
        self.next = self._distances[min(self._k, len(self._distances) - 1)]


def _unit(x: Sequence[float]) -> list[float]:
    size = math.hypot(*x)
    return [u / size for u in x] if size > 0.0 else [*x]
