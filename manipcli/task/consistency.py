"""Whether the files of a task go together: each may be sound, and what one speaks of may not be in another."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import Final

from manipcli.conditions.condition import CheckContext, Problem
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.members.collision import CollisionSpec, NoCollisionSpec
from manipcli.conditions.members.contact_force import ContactForceSpec
from manipcli.control.factory import controller_findings
from manipcli.core.errors import Diagnostic, InvalidInput, Loc
from manipcli.judge.expectation import expectation_problems, until_problems
from manipcli.model.joint_units import misread_units
from manipcli.model.robot import RobotModel
from manipcli.plan.claims import Claims, no_hand
from manipcli.plan.names import UnknownPosture
from manipcli.plan.steps import STEPS
from manipcli.plan.steps.move import MoveSpec
from manipcli.scene.scene import Scene
from manipcli.scene.scene_names import RESERVED
from manipcli.simulate.engines import ENGINES
from manipcli.spec.condition import ConditionSpec
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Located
from manipcli.spec.partial.partial_task import intended_ids
from manipcli.spec.retry import retried
from manipcli.spec.task import StepSpec, TaskSpec
from manipcli.task.switches import foreseen
from manipcli.task.unjudged import unjudged

ABSENT: Final = 230
UNCOMMANDED: Final = 232
NOT_SWITCHED: Final = 233
GUARDED: Final = 242
MOTIONLESS: Final = 244
UNFELT: Final = 245
"""Numbers of findings about a task."""
OF_NAMES: Final = frozenset({"CTRL102", "CTRL104", "CTRL143", "CTRL144", "CTRL146"})
"""Findings about a controllers file that speak of joints which are not there, or not its own."""


def consistent(
    task: Located[TaskSpec], controllers: Located[ControllersSpec], robot: RobotModel, scene: Scene
) -> tuple[Diagnostic, ...]:
    """Warnings and notes about three sound files together.

    Raises:
        InvalidInput: every error of `disagreements`.
    """
    found = disagreements(task, controllers, robot, scene)
    errors = [finding for finding in found if finding.severity == "error"]
    if errors:
        raise InvalidInput(errors)
    return found


def disagreements(
    task: Located[TaskSpec], controllers: Located[ControllersSpec] | None, robot: RobotModel, scene: Scene
) -> tuple[Diagnostic, ...]:
    """What files that are sound by themselves do not have together: names that are not there, units that fit no joint,
    what the engine refuses, what no controller commands. Warnings and notes are among it."""
    claimed = _misclaimed(controllers, robot, task.spec) if controllers else ()
    misclaimed = any(finding.severity == "error" for finding in claimed)
    claims = None
    if controllers and controllers.source.untouched() and not misclaimed:
        claims = Claims.of(controllers.spec, controllers.place)
    found = (*not_there(task, robot, scene, claims), *_named_as_links(task, robot, scene))
    warned = () if found else (*unjudged(task, robot, scene), *_unfelt(task))
    misread = [*misread_units(task.spec, task.source, robot.joints, robot.groups)]
    if controllers:
        misread += misread_units(controllers.spec, controllers.source, robot.joints, robot.groups)
    return (*found, *_refused(task, robot), *claimed, *misread, *warned)


def not_there(
    task: Located[TaskSpec], robot: RobotModel, scene: Scene, claims: Claims | None = None
) -> Iterator[Diagnostic]:
    """What steps, conditions and expectations speak of and that is not there; of steps also what no controller could
    carry out, where it is known who `claims` what."""
    spec, kept = task.spec, task.source.kept
    known = tuple(step.id for step in spec.steps if step.id is not None)
    ids = intended_ids(task.source, STEPS.names) if kept else known
    context = CheckContext(robot, scene, ids, in_order=not kept)
    of_steps = [*_of_steps(spec, context, claims)]
    for number, loc, p in (*of_steps, *_of_expectations(spec, context)):
        yield task.source.finding(number, (*loc, *p.loc), p.message, hint=p.hint)
    for k in range(0 if kept else len(spec.steps)):
        told = {p.message for number, loc, p in of_steps if number == ABSENT and loc[1] == k}
        yield from _tried_again(task, k, context, told)
    poses = [pose.name for pose in robot.poses]
    if spec.start is not None and spec.start not in poses:
        message = f"robot '{robot.name}' has no pose '{spec.start}'"
        yield task.source.finding(ABSENT, ("start",), message, hint=f"poses: {', '.join(poses)}")
    if spec.simulation.engine not in ENGINES.names:
        message = f"there is no engine '{spec.simulation.engine}'"
        hint = f"engines: {', '.join(ENGINES.names)}"
        yield task.source.finding(ABSENT, ("simulation", "engine"), message, hint=hint)


def _of_steps(spec: TaskSpec, context: CheckContext, claims: Claims | None) -> Iterator[tuple[int, Loc, Problem]]:
    """What is wrong with each step, and with what it waits for; after a switch of controllers others claim."""
    robot = context.robot
    for k, step in enumerate(spec.steps):
        member, at = STEPS[step.verb], ("steps", k, step.verb)
        unknown = member.check(step.body, robot, context.scene)
        if claims is not None and not claims.hand and any(isinstance(p, UnknownPosture) for p in unknown):
            unknown = (no_hand(robot), *(p for p in unknown if not isinstance(p, UnknownPosture)))
        yield from ((ABSENT, at, p) for p in unknown)
        if claims is not None and not unknown:
            without = member.uncommanded(step.body, robot, claims)
            yield from ((UNCOMMANDED, at, p) for p in without)
            switch = member.request(step.body)
            if switch is not None and not without:
                misfits, claims = foreseen(switch, claims, robot)
                yield from ((NOT_SWITCHED, at, p) for p in misfits)
        if step.until is not None:
            for p in until_problems(step.until, step.id, context, CONDITIONS):
                yield ABSENT, ("steps", k, "until"), p
        if member.guarded(step.body):
            yield from ((GUARDED, at, p) for p in _unguarded(step, spec))


def _unguarded(step: StepSpec, spec: TaskSpec) -> Iterator[Problem]:
    """What a guarded step lacks."""
    if step.until is None:
        hint = "beside the verb: `until: {contact_force: {pair: [robot, BODY], above: 5 N, mean_over: 50 ms}}`"
        yield Problem(("guarded",), "nothing says where it stops: the step has no `until`", hint)
    if spec.replan is False:
        message = "where it stops is not known beforehand, and `replan: false` forbids to plan what follows from there"
        yield Problem(("guarded",), message, "leave `replan` out")


def _unfelt(task: Located[TaskSpec]) -> Iterator[Diagnostic]:
    """Moves that may touch something, wait for its force, and look for that only when they have gone all their way."""
    for k, step in enumerate(task.spec.steps):
        body = step.body
        if not isinstance(body, MoveSpec) or not body.touch or body.guarded or step.until is None:
            continue
        if _is_for_a_force(step.until):
            message = "`until` is looked at when the move has gone all its way, however hard it presses by then"
            hint = "`guarded: true` in the move stops it where `until` holds"
            yield task.source.finding(UNFELT, ("steps", k, "until"), message, hint=hint, severity="warning")


def _is_for_a_force(until: ConditionSpec, *, opposite: bool = False) -> bool:
    """Whether something in it, or in its `opposite`, comes to hold by pressing harder."""
    if until.combines:
        return any(_is_for_a_force(one, opposite=opposite != (until.name == "not")) for one in until.members)
    match until.body:
        case ContactForceSpec(above=above, below=below):
            return (below if opposite else above) is not None
        case CollisionSpec():
            return not opposite
        case NoCollisionSpec():
            return opposite
    return False


def _of_expectations(spec: TaskSpec, context: CheckContext) -> Iterator[tuple[int, Loc, Problem]]:
    for key, expectations in (("expect", spec.expect), ("watch", spec.watch)):
        for k, expected in enumerate(expectations):
            for p in expectation_problems(expected, context, CONDITIONS):
                yield ABSENT, (key, k), p


def _tried_again(task: Located[TaskSpec], k: int, context: CheckContext, told: Collection[str]) -> Iterator[Diagnostic]:
    """What is wrong with a step only when it is tried again with other values: not what was `told` of it already."""
    step = task.spec.steps[k]
    try:
        again = retried(task, k)
    except InvalidInput as invalid:
        yield from (replace(one, message=f"{one.message}, when it is tried again") for one in invalid.findings)
        return
    if again is step:
        return
    wrong = STEPS[again.verb].check(again.body, context.robot, context.scene)
    wrong += () if again.until is None else until_problems(again.until, step.id, context, CONDITIONS)
    for p in wrong:
        if p.message not in told:
            yield task.source.finding(ABSENT, ("steps", k, "on_fail", "with"), p.message, hint=p.hint)


def _named_as_links(task: Located[TaskSpec], robot: RobotModel, scene: Scene) -> Iterator[Diagnostic]:
    """Bodies and frames that have the name of a link."""
    links = {link.name for link in robot.links} - {*RESERVED}  # which are told without a robot
    for number, key, named in ((220, "scene", scene.bodies), (227, "frames", scene.frames)):
        message, hint = f"robot '{robot.name}' has a link of this name", "choose another: a log has one frame of a name"
        yield from (
            task.source.finding(number, (key, one.name), message, hint=hint) for one in named if one.name in links
        )


def _refused(task: Located[TaskSpec], robot: RobotModel) -> tuple[Diagnostic, ...]:
    """Why the robot can do no task, or the engine cannot hold it: told at the link, or where the task names it."""
    if not robot.moving_joints:
        message = f"robot '{robot.name}' has no joint that moves"
        hint = "a thing that stands or is taken is a body of the scene, `urdf: {file: ...}`"
        return (task.source.finding(MOTIONLESS, ("robot",), message, hint=hint),)
    engine = task.spec.simulation.engine
    if engine not in ENGINES.names:
        return ()
    return tuple(
        replace(finding, place=finding.place or task.place("robot")) for finding in ENGINES[engine].refuses(robot)
    )


def _misclaimed(file: Located[ControllersSpec], robot: RobotModel, task: TaskSpec) -> tuple[Diagnostic, ...]:
    """What is wrong with who commands what, and what is only to be told; of a file from which something was left out
    nothing but names."""
    period = task.simulation.control_period
    found = controller_findings(file.spec, robot, period, place=lambda loc: file.place(*loc))
    return found if file.source.untouched() else tuple(one for one in found if one.code in OF_NAMES)
