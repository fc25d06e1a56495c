"""Closed linkages: pins between links of different branches, and how passive joints follow the joint that drives them.

A pin closes a loop of links: its point of one link stays on its point of the other. With the driving joint at x and the
passive joints of the loop at y, the closure is r(x, y) = p_A(x, y) - p_B(x, y) = 0. It is solved once, by Newton's
method along the range of the driving joint, each position from the one before; planning interpolates the table (cubic
Hermite, slopes dy/dx = -r_y^+ r_x). Engines with physics get the pins themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.core.text import did_you_mean, listed, number_of
from manipcli.core.units import readable
from manipcli.description.elements import Curve, Joint, Mimic, Pin
from manipcli.model.reporter import Reporter
from manipcli.spec.loops import LoopSpec

STEPS: Final = 200
"""Intervals of the table over the range of the driving joint."""
CLOSED: Final = 1e-7
"""[m] Largest distance of the two points of a closed pin."""
ITERATIONS: Final = 30
SEEDS: Final = 30
"""Random starts, within the limits, of the first solution."""
FREE: Final = 1e-6
"""[m/rad] Smaller singular values of the closure leave a passive joint free."""
JUMP: Final = 0.3
"""[rad or m] A passive joint that moves more between two entries of the table has come to another branch."""
NUDGE: Final = 1e-6


def passive_joints(reporter: Reporter, loops: Sequence[LoopSpec], joints: Sequence[Joint]) -> tuple[Joint, ...]:
    """The joints, with those of loops but their driving joint marked as mimic joints of it."""
    passive = {
        name: _leader(loop.driven_by, joints)
        for k, loop in enumerate(loops)
        for name in _passive(reporter, loop, joints, k)
    }
    return tuple(
        replace(joint, mimic=Mimic(passive[joint.name])) if joint.name in passive else joint for joint in joints
    )


def closed_loops(
    reporter: Reporter, loops: Sequence[LoopSpec], joints: Sequence[Joint]
) -> tuple[tuple[Joint, ...], tuple[Pin, ...]]:
    """The joints with the curves along which passive ones follow, within the limits of the joints; and the pins."""
    linkages: dict[str, list[int]] = {}
    for k, loop in enumerate(loops):
        linkages.setdefault(loop.driven_by, []).append(k)
    curves: dict[str, Mimic] = {}
    pins: list[Pin] = []
    for driver, numbers in linkages.items():
        own = [_pin(loops[k], joints) for k in numbers]
        pins += own
        found = _Linkage(driver, own, joints).solved()
        loc = ("loops", numbers[0])
        if isinstance(found, str):
            reporter.error("ROBOT361", found, loc, hint=_HINT.format(driver=driver))
            continue
        table, error = found
        for name, curve in table.items():
            curve = _of_leader(curve, next(joint for joint in joints if joint.name == driver).mimic)
            slope = float((curve.y[-1] - curve.y[0]) / (curve.x[-1] - curve.x[0]))
            offset = float(curve.y[0] - slope * curve.x[0])
            curves[name] = Mimic(_leader(driver, joints), slope, offset, curve)
        pinned = f"{number_of(len(own), 'pin')}, closed within {readable(max(error, CLOSED), 'm')} over its range"
        reporter.note("ROBOT362", f"{listed(list(table))} follow '{driver}' by {pinned}", loc, hint=None)
    made = tuple(replace(joint, mimic=curves[joint.name]) if joint.name in curves else joint for joint in joints)
    return made, tuple(pins)


_HINT: Final = (
    "check `at` and `at_other`, or narrow the driving joint to where the loop closes: "
    "`limits: {{{driver}: {{lower: ..., upper: ...}}}}`"
)


def _passive(reporter: Reporter, loop: LoopSpec, joints: Sequence[Joint], k: int) -> list[str]:
    """The joints of a loop that follow; [] after an error."""
    links = {joint.parent for joint in joints} | {joint.child for joint in joints}
    for j, link in enumerate(loop.between):
        if link not in links:
            hint = did_you_mean(link, sorted(links))
            reporter.error("ROBOT306", f"link '{link}' is not in the robot", ("loops", k, "between", j), hint=hint)
            return []
    around = [joint for joint in _around(loop.between, joints) if joint.moves]
    names = [joint.name for joint in around]
    if loop.driven_by not in names:
        message = f"joint '{loop.driven_by}' is not in the loop of '{loop.between[0]}' and '{loop.between[1]}'"
        hint = f"its joints: {listed(names)}" if names else "the two links are fixed to each other"
        reporter.error("ROBOT360", message, ("loops", k, "driven_by"), hint=hint)
        return []
    if len(names) < 2:
        message = f"no joint of the loop can follow '{loop.driven_by}': it has no other"
        reporter.error("ROBOT360", message, ("loops", k), hint="check the links under `between`")
        return []
    for joint in around:
        if joint.mimic is not None and joint.name != loop.driven_by:
            message = f"joint '{joint.name}' of the loop mimics '{joint.mimic.joint}' in the description, too"
            hint = "remove the <mimic>, or the loop: each states how the joint moves"
            reporter.error("ROBOT360", message, ("loops", k), hint=hint)
            return []
    return [name for name in names if name != loop.driven_by]


def _leader(name: str, joints: Sequence[Joint]) -> str:
    """The independent joint that moves a driving joint."""
    mimic = next((joint.mimic for joint in joints if joint.name == name), None)
    return name if mimic is None else mimic.joint


def _of_leader(curve: Curve, mimic: Mimic | None) -> Curve:
    """The curve of a driving joint as one of the joint that it mimics."""
    if mimic is None:
        return curve
    x, slopes = (curve.x - mimic.offset) / mimic.multiplier, curve.slopes * mimic.multiplier
    order = slice(None, None, 1 if mimic.multiplier > 0.0 else -1)
    return Curve(x[order], curve.y[order], slopes[order])


def _around(links: tuple[str, str], joints: Sequence[Joint]) -> list[Joint]:
    """The joints between two links, through their common ancestor."""
    first, second = (_above(link, joints) for link in links)
    return [*(joint for joint in first if joint not in second), *(joint for joint in second if joint not in first)]


def _above(link: str, joints: Sequence[Joint]) -> list[Joint]:
    """The joints from the root to a link."""
    mover = {joint.child: joint for joint in joints}
    found: list[Joint] = []
    while link in mover:
        found.append(mover[link])
        link = mover[link].parent
    return found[::-1]


def _pin(loop: LoopSpec, joints: Sequence[Joint]) -> Pin:
    first, second = loop.between
    at = np.array(loop.at)
    if loop.at_other is not None:
        other = np.array(loop.at_other)
    else:
        other = _pose(second, joints, {}).inverse().apply(_pose(first, joints, {}).apply(at))
    return Pin(loop.between, (at, np.asarray(other)), loop.driven_by)


def _pose(link: str, joints: Sequence[Joint], positions: dict[str, float]) -> Transform:
    """The pose of a link in the root's frame; other joints are at zero."""
    X = Transform.identity()
    for joint in _above(link, joints):
        X = X @ joint.X_PJ
        q = positions.get(joint.name, 0.0)
        if joint.type == "prismatic":
            X = X @ Transform.of(xyz=q * joint.axis)
        elif q:
            X = X @ Transform.of(R=matrix_from_axis_angle(joint.axis, q))
    return X


class _Linkage:
    """The loops that one joint drives."""

    def __init__(self, driver: str, pins: Sequence[Pin], joints: Sequence[Joint]) -> None:
        self._pins, self._joints = pins, joints
        around = {joint.name: joint for pin in pins for joint in _around(pin.links, joints) if joint.moves}
        self._driver = around.pop(driver)
        self._names = list(around)
        ranges = [joint.limits.range for joint in around.values()]
        self._lower, self._upper = np.array(ranges).T

    def solved(self) -> tuple[dict[str, Curve], float] | str:
        """The curve of each passive joint and the largest error [m]; or why the loops do not close."""
        joint = self._driver
        low, high = joint.limits.within_soft
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            return f"joint '{joint.name}' drives a loop and has no position limits"
        x = np.linspace(low, high, STEPS + 1)
        k = int(np.argmin(np.abs(x)))
        y = self._first(float(x[k]))
        if y is None:
            apart = readable(float(np.linalg.norm(self._residual(float(x[k]), self._seeds()[0]))), "m")
            where = f"with '{joint.name}' at {x[k]:.4g} {joint.unit}"
            return f"{self._text} does not close {where}: the points of its pins are {apart} apart at the start"
        smallest = np.linalg.svd(self._jacobian(float(x[k]), y), compute_uv=False)
        if len(y) > 3 * len(self._pins) or smallest[-1] < FREE:
            return f"{self._text} leaves a joint of {listed(self._names)} free: its pins do not hold them all"
        table = np.full((len(x), len(y)), np.nan)
        table[k] = y
        for direction in (1, -1):
            here = y
            j = k + direction
            while 0 <= j < len(x):
                ahead = here + direction * (x[1] - x[0]) * self._slopes(float(x[j - direction]), here)
                there = self._newton(float(x[j]), ahead)
                if there is None or float(np.abs(there - here).max()) > JUMP:
                    break
                table[j] = here = there
                j += direction
        good = np.flatnonzero(np.isfinite(table[:, 0]))
        if len(good) < len(x):
            lower, upper = float(x[good[0]]), float(x[good[-1]])
            within = f"{lower:.4g} to {upper:.4g} {joint.unit}"
            return (
                f"{self._text} closes, within the limits of its joints, only with '{joint.name}' from {within}; "
                f"its range is {low:.4g} to {high:.4g} {joint.unit}"
            )
        slopes = np.array([self._slopes(float(at), row) for at, row in zip(x, table, strict=True)])
        error = max(self._between(x, table, slopes))
        return {name: Curve(x, table[:, i], slopes[:, i]) for i, name in enumerate(self._names)}, error

    @property
    def _text(self) -> str:
        return f"the loop of '{self._pins[0].links[0]}' and '{self._pins[0].links[1]}'"

    def _between(self, x: Array, table: Array, slopes: Array) -> list[float]:
        """[m] the errors of the interpolated closure in the middle of each interval."""
        found = []
        curves = [Curve(x, table[:, i], slopes[:, i]) for i in range(table.shape[1])]
        for at in (x[1:] + x[:-1]) / 2:
            y = np.array([float(curve.at(at)) for curve in curves])
            found.append(float(np.abs(self._residual(float(at), y)).max()))
        return found

    def _seeds(self) -> list[Array]:
        rng = np.random.default_rng(0)
        low, high = np.clip(self._lower, -np.pi, np.pi), np.clip(self._upper, -np.pi, np.pi)
        return [np.clip(0.0, low, high), *rng.uniform(low, high, (SEEDS, len(low)))]

    def _first(self, x: float) -> Array | None:
        """The solution that Newton's method finds from zero, else the nearest to zero of others."""
        found = [y for seed in self._seeds()[:1] if (y := self._newton(x, seed)) is not None]
        found = found or [y for seed in self._seeds() if (y := self._newton(x, seed)) is not None]
        return min(found, key=lambda y: float(np.linalg.norm(y)), default=None)

    def _newton(self, x: float, y: Array) -> Array | None:
        for _ in range(ITERATIONS):
            r = self._residual(x, y)
            step = np.linalg.lstsq(self._jacobian(x, y), r, rcond=None)[0]
            y = y - np.clip(step, -JUMP, JUMP)
            if float(np.abs(step).max()) < 1e-12:
                break
        outside = np.maximum(self._lower - y, y - self._upper).max()
        return y if float(np.abs(self._residual(x, y)).max()) < CLOSED and outside < 1e-6 else None

    def _residual(self, x: float, y: Array) -> Array:
        """(3 p) [m]."""
        q = {self._driver.name: x, **dict(zip(self._names, y.tolist(), strict=True))}
        differences = []
        for pin in self._pins:
            (a, b), (p_A, p_B) = pin.links, pin.points
            differences.append(_pose(a, self._joints, q).apply(p_A) - _pose(b, self._joints, q).apply(p_B))
        return np.concatenate(differences)

    def _jacobian(self, x: float, y: Array) -> Array:
        """(3 p, m) of the residual by the passive joints."""
        moves = np.eye(len(y)) * NUDGE
        return np.array([(self._residual(x, y + d) - self._residual(x, y - d)) / (2 * NUDGE) for d in moves]).T

    def _slopes(self, x: float, y: Array) -> Array:
        """(m) dy/dx."""
        by_x = (self._residual(x + NUDGE, y) - self._residual(x - NUDGE, y)) / (2 * NUDGE)
        return np.asarray(-np.linalg.lstsq(self._jacobian(x, y), by_x, rcond=None)[0])
