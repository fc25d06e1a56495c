"""The contract of conditions: pure functions of world and state with a signed margin in a stated unit.

One family, used live (`until`) and judged (`expect`): both call the same `margin`, so a condition that ended a step
and the same condition in a verdict cannot disagree.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState
from manipcli.spec.base import Model

S = TypeVar("S", bound=Model)


@dataclass(frozen=True, slots=True)
class World:
    """What a condition is asked in: everything that does not change during a run.

    Attributes:
        robot: whose joints the state's joint vectors follow.
        scene: whose bodies the state's body arrays follow.
        start: the state at time 0 (no leading axes), for words such as `to: start`.
    """

    robot: RobotModel
    scene: Scene
    start: WorldState


@dataclass(frozen=True, slots=True)
class Problem:
    """Something in a spec that cannot be meant: `loc` inside the spec, what is wrong, a hint (the nearest name).

    `code`: where the family of problems has codes of its own.
    """

    loc: tuple[str | int, ...]
    message: str
    hint: str | None = None
    code: str = ""


@dataclass(frozen=True, slots=True)
class Condition(Generic[S]):
    """A member of the seam.

    Attributes:
        name: the word in YAML.
        spec: what the user writes under that word.
        unit: of the margin, SI: "m", "rad", ...
        margin: (spec, world, state) -> (...) signed, positive where the condition holds; the result has the leading
            axes of `state`.
        bodies: (spec, scene) -> the names of the bodies whose motion the margin depends on. Without physics movable
            bodies stay where they are, so there a condition on them is not evaluated (`needs_physics`).
        check: (spec, robot, scene) -> everything in the spec that this robot and scene do not know. `margin` may
            only be asked when there is none.
    """

    name: str
    spec: type[S]
    unit: str
    margin: Callable[[S, World, WorldState], Array]
    bodies: Callable[[S, Scene], tuple[str, ...]]
    check: Callable[[S, RobotModel, Scene], tuple[Problem, ...]]


def needs_physics(condition: Condition[S], spec: S, scene: Scene) -> bool:
    """Whether the condition depends on a body that only physics moves."""
    movable = {body.name for body in scene.movable}
    return any(name in movable for name in condition.bodies(spec, scene))


def unknown_body(scene: Scene, name: str, loc: tuple[str | int, ...], *, movable: bool = False) -> tuple[Problem, ...]:
    """Empty if the scene has a (movable) body of this name."""
    known = tuple(body.name for body in (scene.movable if movable else scene.bodies))
    if name in known:
        return ()
    word = "a movable body of the scene" if movable else "in the scene"
    return (Problem(loc, f"'{name}' is not {word}", did_you_mean(name, known)),)
