"""The contract of conditions: pure functions of the run, with a signed margin in a stated unit.

Conditions are evaluated live (`until`, `watch`) and on the recording (`expect`). Both use the same member with the same
state windows, so a condition that ended a step and the same condition in a verdict cannot disagree.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Generic, Literal, TypeVar

from manipcli.conditions.robustness import Robustness
from manipcli.conditions.sensed import NO_SENSORS, Sensed
from manipcli.conditions.state_window import StateWindow
from manipcli.core.errors import Loc, Severity
from manipcli.core.text import did_you_mean
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model
from manipcli.spec.counted import one_of_many

if TYPE_CHECKING:
    from manipcli.model.kinematics import Kinematics

S = TypeVar("S", bound=Model)

Scope = Literal["end", "always"]
"""Default time of an expectation: up to the end of the run, or all the time."""

Seen = Literal["bodies", "contacts", "references", "sensors"]
"""What `record:` can leave out of a log."""

Monitor = Callable[[StateWindow], Robustness]
"""Robustness on successive state windows; each call continues where the last one ended. Motion, slip, time and energy
count from the first tick of the first window."""


@dataclass(frozen=True)
class World:
    """Everything that conditions use and that is constant during a run.

    Attributes:
        robot: joint vectors of the state have its joint order.
        scene: body arrays of the state have its body order.
        start: the state at time 0 (no leading axes), for words such as `to: start`.
        physics: False for an engine without motion of bodies and without contacts.
        unrecorded: reason why motions of bodies, contacts, references or readings of sensors are not in the log.
        referenced: joints with a recorded reference.
        steps: ids of the steps.
        period: [s] between two ticks in a state window.
        belief: the world as the robot believes it, for windows of `StateWindow.belief`; None: it is this one.
        sensors: whose readings are in the state windows if a condition asks for them.
    """

    robot: RobotModel
    scene: Scene
    start: WorldState
    physics: bool = True
    unrecorded: Mapping[Seen, str] = field(default_factory=dict)
    referenced: frozenset[str] = frozenset()
    steps: tuple[str, ...] = ()
    period: float = 0.0
    belief: World | None = None
    sensors: Mapping[str, Sensed] = field(default_factory=lambda: NO_SENSORS)

    @cached_property
    def kinematics(self) -> Kinematics:
        """Kinematics of the robot, built at its first use."""
        from manipcli.model.kinematics import Kinematics

        return Kinematics(self.robot)


@dataclass(frozen=True, slots=True)
class CheckContext:
    """The names that a spec can refer to, before the run.

    Attributes:
        robot, scene: of the task.
        steps: the ids of its steps; None: unknown.
        in_order: True if `steps` is complete and in order; else it holds every possible id, unordered.
        self_collision: whether links of the robot collide with each other in the simulation.
        blocks: the ids of its blocks.
        sensors: of the task and its robot; None: unknown.
    """

    robot: RobotModel
    scene: Scene
    steps: tuple[str, ...] | None = None
    in_order: bool = True
    self_collision: bool = True
    blocks: tuple[str, ...] = ()
    sensors: Mapping[str, Sensed] | None = None


@dataclass(frozen=True, slots=True)
class Problem:
    """An error in a spec.

    Attributes:
        loc: inside the spec.
        message: what is wrong.
        hint: what to write instead, for example the nearest name.
        code: only for problems with a code of their own.
        severity: `warning` only for problems of controllers.
    """

    loc: Loc
    message: str
    hint: str | None = None
    code: str = ""
    severity: Severity = "error"


@dataclass(frozen=True, slots=True)
class Condition(Generic[S]):
    """A member of the seam.

    Attributes:
        name: the word in YAML.
        spec: what the user writes under that word.
        units: SI units of its margin: "m", "rad", ...
        open: (spec, world) -> its monitor, from the next state window on. Requires that `check` finds nothing and that
            `absent` is None.
        check: (spec, context) -> every unknown name in the spec.
        absent: (spec, world) -> why it cannot be evaluated in this world, or None.
        clause: (spec, robot) -> the condition in English, as a statement without a capital and a full stop: `'ball' is
            inside 'tray'`. `core/prose.py` has the parts.
        scope: the default time of an expectation.
        example: in YAML.
        stateless: True if it uses only contacts and steps, which are known at every tick, also in a log with fewer
            states than ticks.
        live: False if it is known only from a recording: then it is for `expect` alone.
        sensor: spec -> the sensor whose readings it asks for; None for a condition on no sensor.
    """

    name: str
    spec: type[S]
    units: tuple[str, ...]
    open: Callable[[S, World], Monitor]
    check: Callable[[S, CheckContext], tuple[Problem, ...]]
    absent: Callable[[S, World], str | None]
    clause: Callable[[S, RobotModel], str]
    example: str
    scope: Scope = "end"
    stateless: bool = False
    live: bool = True
    sensor: Callable[[S], str] | None = None


def unmoving(world: World, bodies: Sequence[str]) -> str | None:
    """Why the motion of bodies is unknown: the engine moves no body, or it is not recorded; None if it is known."""
    movable = [f"'{body.name}'" for body in world.scene.movable if body.name in bodies]
    if not movable:
        return None
    if not world.physics:
        return f"the engine has no physics, so {', '.join(movable)} never moved"
    return world.unrecorded.get("bodies")


def untouchable(world: World) -> str | None:
    """Why contacts are unknown; None if they are known."""
    if not world.physics:
        return "the engine has no physics, so there are no contacts"
    return world.unrecorded.get("contacts")


def unpinched(context: CheckContext, condition: str) -> tuple[Problem, ...]:
    """A problem for a robot that holds by an attachment: no fingers pinch the object, so the condition never holds."""
    holding = context.robot.holding
    if holding is None:
        return ()
    message = f"`{condition}` needs two fingers that press: '{context.robot.name}' holds by {holding.kind}"
    return (Problem((), message, "ask where the object is: `above`, `near`"),)


def effortless(world: World) -> str | None:
    """Why efforts are unknown; None if they are known."""
    return None if world.physics else "the engine has no physics, so joints have no efforts"


def unknown_body(
    scene: Scene, name: str, loc: Loc, *, movable: bool = False, carried: bool = False
) -> tuple[Problem, ...]:
    """A problem if the scene has no (movable) body of this name; TASK365 if joints hold one that is to be `carried`."""
    known = tuple(body.name for body in (scene.movable if movable else scene.bodies))
    if name in known:
        held = any(name in (joint.parent, joint.child) for joint in scene.joints)
        if not carried or not held or not scene.body(name).kind:  # a placeholder has no kind
            return ()
        hint = "use `open`, `close` or `turn`"
        return (Problem(loc, f"'{name}' is held by a joint and cannot be carried", hint, "TASK365"),)
    if (several := one_of_many(name, known)) is not None:
        return (Problem(loc, *several),)
    word = "a movable body of the scene" if movable else "in the scene"
    body, _, part = name.partition("/")
    apart = (
        f"name the body, '{body}'; where the step has `part`, add `part: {part}`" if part and body in known else None
    )
    return (Problem(loc, f"'{name}' is not {word}", apart or did_you_mean(name, known)),)


def unknown_group(robot: RobotModel, name: str | None, loc: Loc) -> tuple[Problem, ...]:
    """A problem if the robot has no group of this name; `name` None: no problem."""
    groups = [group.name for group in robot.groups]
    if name is None or name in groups:
        return ()
    return (Problem(loc, f"'{name}' is not a group of robot '{robot.name}'", did_you_mean(name, groups)),)
