"""The contract of conditions: pure functions of what happened, with a signed margin in a stated unit.

One family, used live (`until`, `watch`) and judged (`expect`): both open the same member and hand it the same moments,
so that a condition that ended a step and the same condition in a verdict cannot disagree.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Generic, Literal, TypeVar

from manipcli.conditions.robustness import Robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model

if TYPE_CHECKING:
    from manipcli.model.kinematics import Kinematics

S = TypeVar("S", bound=Model)

Scope = Literal["end", "always"]
"""Where a condition is expected to hold when nobody says where: up to the end of the run, or all the time."""

Seen = Literal["bodies", "contacts", "references"]
"""What a log may have been told to leave out."""

Gauge = Callable[[StateWindow], Robustness]
"""Answers for successive moments, each call going on where the last one ended. The first tick that it is shown is where
it starts to count: from there something moved, slipped, took time or energy."""


@dataclass(frozen=True)
class World:
    """What a condition is asked in: everything that does not change during a run.

    Attributes:
        robot: whose joints the state's joint vectors follow.
        scene: whose bodies the state's body arrays follow.
        start: the state at time 0 (no leading axes), for words such as `to: start`.
        physics: False where no body moves and nothing touches.
        unrecorded: why nothing is known of the motion of bodies, of contacts or of references.
        referenced: joints of which it is known what they should follow.
        steps: ids of the steps.
        period: [s] from one tick to the next that is shown.
    """

    robot: RobotModel
    scene: Scene
    start: WorldState
    physics: bool = True
    unrecorded: Mapping[Seen, str] = field(default_factory=dict)
    referenced: frozenset[str] = frozenset()
    steps: tuple[str, ...] = ()
    period: float = 0.0

    @cached_property
    def kinematics(self) -> Kinematics:
        """Of the robot; made when it is first asked for."""
        from manipcli.model.kinematics import Kinematics

        return Kinematics(self.robot)


@dataclass(frozen=True, slots=True)
class CheckContext:
    """What a spec may speak of, before anything runs.

    Attributes:
        robot, scene: of the task.
        steps: the ids of its steps; None: not known.
        in_order: whether these are all, as they follow each other; else any that the file could mean, in no order.
    """

    robot: RobotModel
    scene: Scene
    steps: tuple[str, ...] | None = None
    in_order: bool = True


@dataclass(frozen=True, slots=True)
class Problem:
    """Something in a spec that cannot be meant: `loc` inside the spec, what is wrong, a hint (the nearest name).

    `code`: where the family of problems has codes of its own.
    """

    loc: Loc
    message: str
    hint: str | None = None
    code: str = ""


@dataclass(frozen=True, slots=True)
class Condition(Generic[S]):
    """A member of the seam.

    Attributes:
        name: the word in YAML.
        spec: what the user writes under that word.
        units: that its margin can have, SI: "m", "rad", ...
        open: (spec, world) -> its gauge, from the next moments on. Only to be asked where `check` finds nothing and
            `absent` is None.
        check: (spec, setting) -> everything in the spec that the setting does not know.
        absent: (spec, world) -> why it can never be evaluated in this world, or None.
        scope: where it is expected to hold when the task does not say.
        example: how it is written, in YAML.
        stateless: it looks at contacts and steps alone, which are known at every tick, also in a log that holds fewer
            states than there were ticks.
    """

    name: str
    spec: type[S]
    units: tuple[str, ...]
    open: Callable[[S, World], Gauge]
    check: Callable[[S, CheckContext], tuple[Problem, ...]]
    absent: Callable[[S, World], str | None]
    example: str
    scope: Scope = "end"
    stateless: bool = False


def unmoving(world: World, bodies: Sequence[str]) -> str | None:
    """Why nothing can be said of the motion of bodies: nothing moves those that could move, or it is not recorded."""
    movable = [f"'{body.name}'" for body in world.scene.movable if body.name in bodies]
    if not movable:
        return None
    if not world.physics:
        return f"the engine has no physics, so {', '.join(movable)} never moved"
    return world.unrecorded.get("bodies")


def untouchable(world: World) -> str | None:
    """Why nothing can be said of contacts."""
    if not world.physics:
        return "the engine has no physics, so nothing can touch"
    return world.unrecorded.get("contacts")


def effortless(world: World) -> str | None:
    """Why nothing can be said of efforts."""
    return None if world.physics else "the engine has no physics, so no joint needs any effort"


def unknown_body(scene: Scene, name: str, loc: Loc, *, movable: bool = False) -> tuple[Problem, ...]:
    """Empty if the scene has a (movable) body of this name."""
    known = tuple(body.name for body in (scene.movable if movable else scene.bodies))
    if name in known:
        return ()
    word = "a movable body of the scene" if movable else "in the scene"
    return (Problem(loc, f"'{name}' is not {word}", did_you_mean(name, known)),)


def unknown_group(robot: RobotModel, name: str | None, loc: Loc) -> tuple[Problem, ...]:
    """Empty if the robot has a group of this name, or none is named."""
    groups = [group.name for group in robot.groups]
    if name is None or name in groups:
        return ()
    return (Problem(loc, f"'{name}' is not a group of robot '{robot.name}'", did_you_mean(name, groups)),)
