"""Planning state, motions and step plans: the values that steps take and return."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from manipcli.core.geometry import Array, Transform
from manipcli.model.collision import Carried, Pair
from manipcli.plan.compliance import Compliance
from manipcli.plan.portion import Portion
from manipcli.plan.trajectory import JointTrajectory

Strictness = Literal["strict", "best_effort"]
"""Whether a switch of controllers is done as a whole or not at all, or as far as possible."""
CLOSING = "close"
"""The phase of a step in which the hand closes on something."""
OPENING = "open"
"""The phase of a step in which the hand opens."""

LOOKING = "look"
"""The phase of a step in which a camera takes a picture."""


@dataclass(frozen=True, slots=True)
class PlanningState:
    """What a step starts from, predicted or measured.

    Attributes:
        position: (n) of `RobotModel.moving_joints`.
        bodies: `X_WO` of every movable body, in the order of `Scene.movable`.
        carried: what the hand holds.
        closed: the hand was closed to hold something, and not opened since; moves leave it as it is.
        at_start: the robot has not moved since the task began.
    """

    position: Array
    bodies: tuple[Transform, ...]
    carried: Carried | None = None
    closed: bool = False
    at_start: bool = True

    def moved(self, position: Array) -> PlanningState:
        """The same with the robot at `position`."""
        return replace(self, position=position, at_start=False)


@dataclass(frozen=True, slots=True)
class Reflex:
    """Pressing more while the hand holds and its taxels report beginning slip.

    Attributes:
        friction: coefficient that the robot believes.
        onset: share of the friction cone above which it presses more.
        force: [N] most of each finger; None: what the hand can.
    """

    friction: float
    onset: float
    force: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Grip:
    """A goal of the hand: `joints` move to `target` (n) until each finger meets `force` [N] or arrives.

    With `must_hold`, closing on nothing is a failure; with `must_arrive`, so is being stopped before the target.
    `reflex`: None without one.
    """

    joints: tuple[str, ...]
    target: Array
    force: float | None
    must_hold: bool = False
    must_arrive: bool = False
    reflex: Reflex | None = None


@dataclass(frozen=True, slots=True)
class Switch:
    """Controllers that switch between two ticks: to those of `to`, exclusively on their joints, or by the two lists."""

    to: tuple[str, ...] = ()
    activate: tuple[str, ...] = ()
    deactivate: tuple[str, ...] = ()
    strictness: Strictness = "strict"


@dataclass(frozen=True, slots=True)
class JointTolerance:
    """control_msgs/JointTolerance: rad or m, per second, per second squared.

    Each: above 0 is the tolerance, 0 leaves the controller's own, -1 means that it is not enforced.
    """

    name: str
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True, slots=True)
class GoalTolerances:
    """Tolerances of a goal instead of the controller's; `goal_time` [s], 0: the controller's."""

    path: tuple[JointTolerance, ...]
    goal: tuple[JointTolerance, ...]
    goal_time: float


@dataclass(frozen=True, slots=True)
class Look:
    """The body `object` is located in the next picture of the camera `sensor`."""

    object: str
    sensor: str


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Commands that start together; done when all goals are reached and `duration` [s] has passed.

    Attributes:
        label: the phase of the step ("approach", "close", ...).
        trajectory: of some joints, or None where they hold.
        grip: of the hand, or None where it holds.
        duration: planned [s].
        awaits: the step's `until` is waited for here; where no motion awaits, it is at the step's end.
        guarded: it stops as soon as `until` holds.
        switch: of controllers, before anything else; None for no switch.
        begins: the state in which it begins, for reports; None where nothing moves.
        allowed: pairs of parts that may touch in it, besides the hand and what it holds.
        searched: the path planner whose path around obstacles it follows; "" for a path that was not searched.
        straight: the straight motion that was not free, where one was searched instead; for pictures.
        tolerances: of the trajectory, instead of the controller's.
        takes: the object that is attached to the tool at its end, for robots with a `holding`.
        lets_go: what is attached to the tool is freed at its beginning.
        looks: what it locates; it ends when the picture has arrived.
        compliance: how the arm yields in it; None: it does not.
        pours: it stops as soon as the `portion` of the step has left the container.
    """

    label: str
    trajectory: JointTrajectory | None
    grip: Grip | None
    duration: float
    awaits: bool = False
    guarded: bool = False
    switch: Switch | None = None
    begins: PlanningState | None = None
    allowed: frozenset[Pair] = frozenset()
    searched: str = ""
    straight: JointTrajectory | None = None
    tolerances: GoalTolerances | None = None
    takes: str | None = None
    lets_go: bool = False
    looks: Look | None = None
    compliance: Compliance | None = None
    pours: bool = False

    @property
    def closes(self) -> bool:
        """Whether the hand closes on something."""
        return self.takes is not None or (self.grip is not None and self.grip.force is not None)

    @property
    def opens(self) -> bool:
        """Whether the hand moves without closing on something, or frees an object."""
        return not self.closes and (self.lets_go or self.grip is not None)


@dataclass(frozen=True, slots=True)
class Stream:
    """Where what is poured is predicted to pass the plane of the receiver's rim.

    Attributes:
        beyond: [m] of its middle beyond the middle of the opening, in the direction of the pour.
        spread: [m] by which the landing is uncertain.
        margin: [m] from the outermost body to the wall of the opening, less the spread; negative: it may miss.
        speed: [m/s] with which the fastest body leaves the rim.
        tilt: [rad] of the cup when the last body leaves it.
        moved: whether the lip was moved, or the tilt slowed down, for it.
    """

    beyond: float
    spread: float
    margin: float
    speed: float
    tilt: float
    moved: bool = False

    @property
    def text(self) -> str:
        """`is to land 1.2 mm beyond the centre, uncertain by 14.0 mm: margin 12.5 mm to the rim; it leaves at ...`."""
        side = "beyond" if self.beyond >= 0.0 else "before"
        aim = "; the lip and the speed are chosen for it" if self.moved else ""
        uncertain = f"uncertain by {1000.0 * self.spread:.1f} mm: margin {1000.0 * self.margin:.1f} mm to the rim"
        leaves = f"it leaves at {self.speed:.2f} m/s, tilted {math.degrees(self.tilt):.0f} deg"
        return f"is to land {1000.0 * abs(self.beyond):.1f} mm {side} the centre, {uncertain}; {leaves}{aim}"


@dataclass(frozen=True, slots=True)
class Insertion:
    """A peg that a step puts into a hole.

    Attributes:
        peg, hole: names of the bodies.
        depth: [m] of the end of the peg below the rim.
        clearance: [m] to each side.
        radius: [m] of the search.
    """

    peg: str
    hole: str
    depth: float
    clearance: float
    radius: float


@dataclass(frozen=True, slots=True)
class JointGoal:
    """Where a step moves a joint of the scene.

    Attributes:
        name: of the joint.
        position: [rad or m] that it is planned to have at the end.
        side: 1: this or more, -1: this or less, 0: neither.
        within: [rad or m] tolerance.
    """

    name: str
    position: float
    side: float
    within: float

    def short(self, position: float) -> float:
        """[rad or m] by which a position misses the goal; negative: by which it is beyond it on its `side`."""
        return self.side * (self.position - position) if self.side else abs(position - self.position)


@dataclass(frozen=True, slots=True)
class StepPlan:
    """The motions of one step, and the state after them.

    Attributes:
        motions: of the step.
        end: the state after them.
        placed: the body that it sets down at its pose in `end`; "" for none.
        poured: the bodies that it pours into the container `into`.
        stream: where they land; None if the plan does not predict it.
        inserted: what it puts into a hole.
        joint: the joint of the scene that it moves; None for none.
        portion: how much of them; None: all.
    """

    motions: tuple[Motion, ...]
    end: PlanningState
    placed: str = ""
    poured: tuple[str, ...] = ()
    into: str = ""
    stream: Stream | None = None
    inserted: Insertion | None = None
    joint: JointGoal | None = None
    portion: Portion | None = None

    @property
    def duration(self) -> float:
        """Planned duration [s]."""
        return sum(motion.duration for motion in self.motions)

    @property
    def depends_on_state(self) -> bool:
        """Whether it has motions that are planned from the state."""
        return any(part is not None for own in self.motions for part in (own.trajectory, own.grip, own.looks))
