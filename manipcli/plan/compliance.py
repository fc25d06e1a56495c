"""Compliance that a motion brings along: a spring around the reference, and a force with which the tool presses.

    with compliant(builder, Compliance.of(along=400, across=1500, about=40)):
        builder.straight("pull", X_WT, speed=0.2)

The trajectory of a compliant motion is planned, timed and checked like any other; it is the reference of the law. The
executor switches the arm to its compliant controller before such a motion, and back before the next one without.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen

SOFT = 400.0
"""[N/m] Stiffness along the axis of a force, and for motions that contact guides."""
FIRM = 1500.0
"""[N/m] Stiffness across the axis of a force."""
WRIST = 40.0
"""[N m/rad] Stiffness of the orientation."""


@dataclass(frozen=True, slots=True, eq=False)
class Pressing:
    """A force with which the tool presses along an axis.

    Before contact the reference advances along the axis at `speed`. From the contact on, it is shifted until the felt
    force is the target.

    Attributes:
        axis: (3,) unit vector in the compliant frame; the tool advances along it.
        target: [N] above 0, on what it touches.
        speed: [m/s] before contact.
        reach: [m] within which it must meet something.
        bandwidth: [Hz] of the force in stiff contact.
        hold: [s] the motion ends when the force has been within `TOLERANCE` of the target for this long; None: it ends
            with its trajectory.
        yields: what it touches may give way, as a peg in a hole does: the reference then advances at most at `speed`.
    """

    axis: Array
    target: float
    speed: float
    reach: float
    bandwidth: float = 1.0
    hold: float | None = None
    yields: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Beyond:
    """A plane that ends a motion as soon as the origin of the compliant frame is beyond it, or drops suddenly.

    Attributes:
        normal: (3,) unit vector in the world.
        offset: [m] the plane is n . p = offset.
        drop: [m] it also ends when the origin is this far beyond its mean of the last second; None: it does not.
        most: [N] it also ends, before the plane, when the tool is felt to press with more than this for 50 ms.
        otherwise: why the step has failed if the motion ends before the plane; "": that is no failure.
    """

    normal: Array
    offset: float
    drop: float | None = None
    most: float = math.inf
    otherwise: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Compliance:
    """How the arm yields: a spring along and about the axes of a frame at the reference.

    Attributes:
        stiffness: (6,) along and about x, y, z of the compliant frame [N/m, N m/rad].
        force: with which it presses besides; None: only the spring.
        X_TC: the compliant frame in the tool frame; None: the tool frame itself.
        until: ends the motion; None: nothing but its trajectory and its force.
        relative: the trajectory is followed from where the reference is, which a search has moved off the plan.
        here: the reference begins where the arm is, so that it exerts no force.
    """

    stiffness: Array
    force: Pressing | None = None
    X_TC: Transform | None = None
    until: Beyond | None = None
    relative: bool = False
    here: bool = False

    @property
    def ends_held(self) -> bool:
        """Whether a motion with it ends when its force has been held."""
        return self.force is not None and self.force.hold is not None

    @classmethod
    def of(
        cls,
        *,
        along: float = SOFT,
        across: float = FIRM,
        about: float | Sequence[float] = WRIST,
        axis: str = "z",
        force: Pressing | None = None,
        X_TC: Transform | None = None,
    ) -> Compliance:
        """`along` the axis x, y or z of the frame, `across` it, and `about` all axes, or each."""
        stiffness = np.full(6, across)
        stiffness["xyz".index(axis)] = along
        stiffness[3:] = about
        return cls(frozen(stiffness), force, X_TC)


class Complying(Protocol):
    """Adds motions with this compliance, as `MotionBuilder` does."""

    compliance: Compliance | None


@contextmanager
def compliant(builder: Complying, compliance: Compliance) -> Iterator[None]:
    """Make the motions that are added inside compliant."""
    before, builder.compliance = builder.compliance, compliance
    try:
        yield
    finally:
        builder.compliance = before
