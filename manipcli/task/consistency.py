"""Consistency checks across the files of a task: names, units, controllers and engine."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import Final

from manipcli.conditions.condition import CheckContext, Problem, unknown_body
from manipcli.conditions.frames import fixed_frame
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.members.collision import CollisionSpec, NoCollisionSpec
from manipcli.conditions.members.contact_force import ContactForceSpec
from manipcli.conditions.members.force import FeltForceSpec
from manipcli.conditions.members.touches import TouchesSpec
from manipcli.conditions.members.wrench import WrenchSpec
from manipcli.conditions.sensed import Sensed
from manipcli.control.factory import controller_findings
from manipcli.core.errors import Diagnostic, InvalidInput, Loc
from manipcli.judge.expectation import expectation_problems, until_problems
from manipcli.model.joint_units import misread_units
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claims, no_hand
from manipcli.plan.part_pairs import pair_problems
from manipcli.plan.path_planners.ompl_algorithm import algorithm_problems
from manipcli.plan.steps import STEPS
from manipcli.plan.steps.move import MoveSpec
from manipcli.plan.unknown_names import UnknownPosture
from manipcli.scene.scene import Scene
from manipcli.scene.scene_names import RESERVED
from manipcli.simulate.engines import ENGINES
from manipcli.spec.condition import ConditionSpec
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.dropped import but_computed, dropped_steps
from manipcli.spec.explain import distinct
from manipcli.spec.located import Located
from manipcli.spec.partial.partial_task import intended_ids
from manipcli.spec.retry import retried
from manipcli.spec.step import StepSpec
from manipcli.spec.task import TaskSpec
from manipcli.task.agree_limits import unusable_limits
from manipcli.task.block_checks import BranchClaims, parallel_problems, planned_in_the_run
from manipcli.task.held_objects import impossible_steps
from manipcli.task.switches import foreseen
from manipcli.task.unjudged import unjudged

ABSENT: Final = 230
UNCOMMANDED: Final = 232
NOT_SWITCHED: Final = 233
GUARDED: Final = 242
MOTIONLESS: Final = 244
UNFELT: Final = 245
UNMOVED: Final = 247
"""Numbers of the codes of findings about a task."""
OF_NAMES: Final = frozenset({"CTRL102", "CTRL104", "CTRL143", "CTRL144", "CTRL146"})
"""Codes of findings on a controllers file about joints that are missing or not its own."""


def consistent(
    task: Located[TaskSpec],
    controllers: Located[ControllersSpec],
    robot: RobotModel,
    scene: Scene,
    sensors: Mapping[str, Sensed] | None,
) -> tuple[Diagnostic, ...]:
    """Warnings and notes about three valid files together.

    Raises:
        InvalidInput: all errors of `disagreements`.
    """
    found = disagreements(task, controllers, robot, scene, sensors)
    errors = [finding for finding in found if finding.severity == "error"]
    if errors:
        raise InvalidInput(errors)
    return found


def disagreements(
    task: Located[TaskSpec],
    controllers: Located[ControllersSpec] | None,
    robot: RobotModel,
    scene: Scene,
    sensors: Mapping[str, Sensed] | None,
) -> tuple[Diagnostic, ...]:
    """All findings about the files together: missing names, units that fit no joint, robots that the engine refuses,
    joints without a controller. Includes warnings and notes. `sensors`: None if they are unknown."""
    claimed = _misclaimed(controllers, robot, task.spec) if controllers else ()
    misclaimed = any(finding.severity == "error" for finding in claimed)
    claims = None
    if controllers and controllers.source.untouched() and not misclaimed:
        claims = Claims.of(controllers.spec, controllers.place)
    found = (*not_there(task, robot, scene, sensors, claims), *_named_as_links(task, robot, scene))
    judged = () if found or sensors is None else unjudged(task, robot, scene, sensors)
    warned = () if found else (*judged, *_unfelt(task), *planned_in_the_run(task))
    impossible = () if found or task.source.kept else tuple(_impossible(task, scene))
    misread = [*misread_units(task.spec, task.source, robot.joints, robot.groups, scene.joints)]
    if controllers:
        misread += misread_units(controllers.spec, controllers.source, robot.joints, robot.groups)
    return distinct((*found, *_refused(task, robot, scene), *claimed, *misread, *impossible, *warned))


def not_there(
    task: Located[TaskSpec],
    robot: RobotModel,
    scene: Scene,
    sensors: Mapping[str, Sensed] | None,
    claims: Claims | None = None,
) -> Iterator[Diagnostic]:
    """Errors for missing names in steps, conditions and expectations; with `claims`, also for steps that no controller
    can execute."""
    spec, kept = task.spec, task.source.kept
    known = tuple(step.id for step in spec.steps if step.id is not None)
    ids = intended_ids(task.source, STEPS.names) if kept else known
    complete = task.source.structure.complete
    context = CheckContext(
        robot,
        scene,
        ids if complete else None,
        in_order=not kept and complete,
        self_collision=spec.simulation.self_collision,
        blocks=tuple(block.id for block in spec.blocks),
        sensors=sensors,
    )
    of_steps = [*_of_steps(spec, context, claims)]
    of_steps += _of_blocks(spec, context)
    parallel = () if kept or of_steps else parallel_problems(spec, robot, claims)
    for number, loc, p in (*of_steps, *parallel, *_of_expectations(spec, context)):
        yield task.source.finding(number, (*loc, *p.loc), p.message, hint=p.hint)
    yield from _in_dropped(task, context)
    for k in range(0 if kept else len(spec.steps)):
        reported = {p.message for number, loc, p in of_steps if number == ABSENT and loc[:2] == ("steps", k)}
        yield from _in_retry(task, k, context, reported)
    for loc, p in _of_pairs(spec, context):
        yield task.source.finding(ABSENT, (*loc, *p.loc), p.message, hint=p.hint)
    poses = [pose.name for pose in robot.poses]
    if spec.start is not None and spec.start not in poses:
        message = f"robot '{robot.name}' has no pose '{spec.start}'"
        yield task.source.finding(ABSENT, ("start",), message, hint=f"poses: {', '.join(poses)}")
    for p in algorithm_problems(spec.planner):
        yield task.source.finding(ABSENT, ("planner", *p.loc), p.message, hint=p.hint)
    if not kept:
        yield from unusable_limits(task)


def _of_steps(spec: TaskSpec, context: CheckContext, claims: Claims | None) -> Iterator[tuple[int, Loc, Problem]]:
    """Problems of each step and its `until`; a switch of controllers changes the claims of later steps on its path."""
    robot = context.robot
    branches = BranchClaims(spec.blocks)
    for k, step in enumerate(spec.steps):
        claims = branches.before(k, claims)
        member, at = STEPS[step.verb], ("steps", k, step.verb)
        unknown = member.check(step.body, robot, context.scene)
        if claims is not None and not claims.hand and any(isinstance(p, UnknownPosture) for p in unknown):
            unknown = (no_hand(robot), *(p for p in unknown if not isinstance(p, UnknownPosture)))
        yield from ((int(p.code.removeprefix("TASK") or ABSENT), at, p) for p in unknown)
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
        if step.keep and not member.moves:
            message = f"`keep` has no effect: `{step.verb}` does not move the arm"
            yield UNMOVED, ("steps", k), Problem(("keep",), message, "remove `keep`")
        for j, keep in enumerate(step.keep):
            if keep.above is not None:
                yield from (
                    (ABSENT, ("steps", k, "keep"), p) for p in unknown_body(context.scene, keep.above, (j, "above"))
                )
            if keep.inside is not None and keep.inside.frame is not None:
                problems = fixed_frame(robot, context.scene, keep.inside.frame, (j, "inside", "frame"))
                yield from ((ABSENT, ("steps", k, "keep"), p) for p in problems)
        if member.guarded(step.body):
            yield from ((GUARDED, at, p) for p in _unguarded(step, spec))


def _of_blocks(spec: TaskSpec, context: CheckContext) -> Iterator[tuple[int, Loc, Problem]]:
    """Problems of the conditions of blocks."""
    for k, block in enumerate(spec.blocks):
        for key, condition in (("condition", block.condition), ("until", block.until)):
            if condition is not None:
                yield from (
                    (ABSENT, ("blocks", k, key), p) for p in until_problems(condition, None, context, CONDITIONS)
                )


def _in_dropped(task: Located[TaskSpec], context: CheckContext) -> Iterator[Diagnostic]:
    """Errors for missing names in steps of branches that are never taken, but in values of parameters."""
    dropped = dropped_steps(task)
    if dropped is not None:
        found = (
            dropped.source.finding(number, (*loc, *p.loc), p.message, hint=p.hint)
            for number, loc, p in _of_steps(dropped.spec, replace(context, in_order=False), None)
        )
        yield from but_computed(found, dropped.source.root)


def _of_pairs(spec: TaskSpec, context: CheckContext) -> Iterator[tuple[Loc, Problem]]:
    """Problems of the pairs of parts under `allow` of steps and under `clearance`."""
    for k, step in enumerate(spec.steps):
        for n, pair in enumerate(step.allow):
            yield from ((("steps", k), p) for p in pair_problems(context, pair, ("allow", n)))
    for n, each in enumerate(spec.clearance.pairs):
        yield from (((), p) for p in pair_problems(context, each.between, ("clearance", "pairs", n, "between")))


def _impossible(task: Located[TaskSpec], scene: Scene) -> Iterator[Diagnostic]:
    """Errors for steps that cannot succeed, see `held_objects`."""
    for each in impossible_steps(task.spec, scene):
        at = ("steps", each.step, task.spec.steps[each.step].verb, each.key)
        yield task.source.finding(each.number, at, each.message, hint=each.hint)


def _unguarded(step: StepSpec, spec: TaskSpec) -> Iterator[Problem]:
    """Problems of a guarded step: a missing `until`, or disabled re-planning."""
    if step.until is None:
        hint = "next to the verb, add `until: {contact_force: {pair: [robot, BODY], above: 5 N, mean_over: 50 ms}}`"
        yield Problem(("guarded",), "a guarded move needs an `until`; the step has none", hint)
    if spec.replan is False:
        message = "a guarded move needs re-planning, since its end is not known in advance; `replan` is false"
        yield Problem(("guarded",), message, "remove `replan: false`")


def _unfelt(task: Located[TaskSpec]) -> Iterator[Diagnostic]:
    """Warnings for unguarded moves into contact whose `until` waits for a force: it is checked only at their end."""
    for k, step in enumerate(task.spec.steps):
        body = step.body
        if not isinstance(body, MoveSpec) or not body.touch or body.guarded or step.until is None:
            continue
        if _is_for_a_force(step.until):
            message = "`until` is checked only at the end of the move, whatever the contact force before"
            hint = "add `guarded: true` to the move to stop it when `until` holds"
            yield task.source.finding(UNFELT, ("steps", k, "until"), message, hint=hint, severity="warning")


def _is_for_a_force(until: ConditionSpec, *, opposite: bool = False) -> bool:
    """Whether a larger contact force can make the condition, or its `opposite`, hold."""
    if until.combines:
        return any(_is_for_a_force(member, opposite=opposite != (until.name == "not")) for member in until.members)
    match until.body:
        case ContactForceSpec(above=above, below=below):
            return (below if opposite else above) is not None
        case CollisionSpec() | TouchesSpec():
            return not opposite
        case WrenchSpec() | FeltForceSpec():
            return True
        case NoCollisionSpec():
            return opposite
    return False


def _of_expectations(spec: TaskSpec, context: CheckContext) -> Iterator[tuple[int, Loc, Problem]]:
    for key, expectations in (("expect", spec.expect), ("watch", spec.watch)):
        for k, expected in enumerate(expectations):
            for p in expectation_problems(expected, context, CONDITIONS):
                yield ABSENT, (key, k), p


def _in_retry(
    task: Located[TaskSpec], k: int, context: CheckContext, reported: Collection[str]
) -> Iterator[Diagnostic]:
    """Problems of a step with the other parameters of its retry, without those already `reported`."""
    step = task.spec.steps[k]
    try:
        changed = retried(task, k)
    except InvalidInput as invalid:
        yield from (replace(finding, message=f"{finding.message} (in a retry)") for finding in invalid.findings)
        return
    if changed is step:
        return
    problems = STEPS[changed.verb].check(changed.body, context.robot, context.scene)
    problems += () if changed.until is None else until_problems(changed.until, step.id, context, CONDITIONS)
    for p in problems:
        if p.message not in reported:
            yield task.source.finding(ABSENT, ("steps", k, "on_fail", "with"), p.message, hint=p.hint)


def _named_as_links(task: Located[TaskSpec], robot: RobotModel, scene: Scene) -> Iterator[Diagnostic]:
    """Errors for bodies and frames with the name of a link."""
    links = {link.name for link in robot.links} - {*RESERVED}  # which are reported without a robot
    for number, key, named in ((220, "scene", scene.bodies), (227, "frames", scene.frames)):
        message, hint = f"robot '{robot.name}' has a link of this name", "rename it: frame names are unique in a log"
        yield from (
            task.source.finding(number, (key, thing.name), message, hint=hint) for thing in named if thing.name in links
        )


def _refused(task: Located[TaskSpec], robot: RobotModel, scene: Scene) -> tuple[Diagnostic, ...]:
    """Errors for a robot without movable joints, and for what the engine refuses."""
    if not robot.moving_joints:
        message = f"robot '{robot.name}' has no movable joint"
        hint = "write a passive object as a body of the scene: `urdf: {file: ...}`"
        return (task.source.finding(MOTIONLESS, ("robot",), message, hint=hint),)
    return refused_by_engine(task, robot, scene)


def refused_by_engine(task: Located[TaskSpec], robot: RobotModel, scene: Scene) -> tuple[Diagnostic, ...]:
    """Errors for what the engine of the task cannot simulate."""
    simulation = task.spec.simulation
    if simulation.engine not in ENGINES.names:
        return ()
    return tuple(
        replace(finding, place=finding.place or task.place(*at))
        for finding, at in ENGINES[simulation.engine].refuses(robot, scene, simulation.own)
    )


def _misclaimed(file: Located[ControllersSpec], robot: RobotModel, task: TaskSpec) -> tuple[Diagnostic, ...]:
    """Findings on the claims of controllers; only those on names if values were removed from the file."""
    period = task.simulation.control_period
    found = controller_findings(file.spec, robot, period, place=lambda loc: file.place(*loc))
    return found if file.source.untouched() else tuple(finding for finding in found if finding.code in OF_NAMES)
