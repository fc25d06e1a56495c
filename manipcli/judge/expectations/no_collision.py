"""`no_collision`: some things never touched."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.core.text import did_you_mean
from manipcli.judge.expectation import Evidence, Expectation, Measured, NotEvaluated
from manipcli.model.condition import Problem
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.record.channels import CONTACTS
from manipcli.record.recording import Span
from manipcli.spec.base import Model
from manipcli.spec.quantity import Force

ROBOT = "robot"


class NoCollisionSpec(Model):
    """None of the pairs pressed on each other with more than `below`."""

    pairs: tuple[tuple[str, str], ...] = Field(
        min_length=1, description="Each two of: a body, `robot` (any of its links), `robot/LINK`."
    )
    below: Annotated[Force, Field(ge=0)] = Field(
        default=0.0, description="Largest normal force [N] that does not count; 0: any touch that presses counts."
    )


def evaluate(spec: NoCollisionSpec, evidence: Evidence, span: Span) -> Measured | NotEvaluated:
    """`below` minus the largest normal force [N] between any of the pairs, at any time.

    A pair that never pressed has the margin `below`: 0 N to spare when any touch counts, which still passes.
    """
    if not evidence.physics:
        return NotEvaluated("the engine has no physics, so nothing can touch", "N")
    reason = evidence.lacks(CONTACTS)
    if reason is not None:
        return NotEvaluated(reason, "N")
    force, at, text = 0.0, None, "never touched"
    for snapshot in span.contacts:
        for contact in snapshot.contacts:
            if contact.force > force and any(_matches(pair, contact.a, contact.b) for pair in spec.pairs):
                force, at = contact.force, snapshot.time
                text = f"'{contact.a}' and '{contact.b}' with {force:.3g} N"
    return Measured(margin=spec.below - force, unit="N", at=at, text=text)


def _matches(pair: tuple[str, str], a: str, b: str) -> bool:
    first, second = pair
    return (_is(first, a) and _is(second, b)) or (_is(first, b) and _is(second, a))


def _is(written: str, part: str) -> bool:
    return written == part or (written == ROBOT and part.startswith(f"{ROBOT}/"))


def check(spec: NoCollisionSpec, robot: RobotModel, scene: Scene, steps: tuple[str, ...]) -> tuple[Problem, ...]:
    """Every part is a body, the robot, or one of its links."""
    bodies = tuple(body.name for body in scene.bodies)
    links = tuple(f"{ROBOT}/{link.name}" for link in robot.links)
    problems = []
    for i, pair in enumerate(spec.pairs):
        for j, name in enumerate(pair):
            if name != ROBOT and name not in bodies and name not in links:
                known = links if name.startswith(f"{ROBOT}/") else (ROBOT, *bodies)
                message = f"'{name}' is neither a body of the scene nor a part of the robot"
                problems.append(Problem(("pairs", i, j), message, did_you_mean(name, known)))
    return tuple(problems)


NO_COLLISION = Expectation(name="no_collision", spec=NoCollisionSpec, scope="always", evaluate=evaluate, check=check)
