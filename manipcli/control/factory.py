"""Construction of a robot's controllers from a controllers file, with all findings of the file at once."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from functools import cache

from manipcli.control.as_meant import as_meant
from manipcli.control.chain import chain_finding, target_of
from manipcli.control.command import may_go_together
from manipcli.control.compliant_build import WristSensor, compliant_controllers
from manipcli.control.controller import BuildContext
from manipcli.control.controllers import CONTROLLERS
from manipcli.control.feed_forward import ModelFeedForward
from manipcli.control.lifecycle import ticks_between
from manipcli.control.manager import ControllerManager
from manipcli.control.stopping import StopPlanner
from manipcli.core.errors import Diagnostic, InvalidArgument, InvalidInput, Loc, Place
from manipcli.core.text import did_you_mean, listed
from manipcli.description.transmission import Compat
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import ControllerSpec, Interface
from manipcli.spec.controllers_file import ControllersSpec

Where = Callable[[Loc], Place | None]
"""Maps the keys of a value, ("controllers", "arm", "joints", 0), to its place in the file."""


def _nowhere(_: Loc) -> None:
    return None


def build_controllers(
    spec: ControllersSpec,
    robot: RobotModel,
    period: float,
    place: Where = _nowhere,
    *,
    kinematics: Kinematics | None = None,
    compat: Compat | None = None,
    stop_planner: StopPlanner | None = None,
    compliant: bool = False,
    wrist: WristSensor | None = None,
) -> ControllerManager:
    """The controllers of a file, for a robot: loaded, configured, and activated where the file has `active: true`.

    Args:
        spec: the file.
        robot: the robot.
        period: [s] of a control tick.
        place: of values, for findings.
        kinematics: of the robot, for those that need its dynamics; None: made when needed.
        compat: the rules where ROS 1 and 2 differ; None: the safer rule of each.
        stop_planner: plans stops without `compat`; None: they have a constant deceleration.
        compliant: with the controllers of compliant steps, see `compliant_build.py`.
        wrist: measures the felt force; None: it is estimated.

    Raises:
        InvalidInput: `controller_findings` has errors.
    """
    errors = [f for f in controller_findings(spec, robot, period, place) if f.severity == "error"]
    if errors:
        raise InvalidInput(errors)
    context = BuildContext(robot, cache(lambda: kinematics or Kinematics(robot)), compat, stop_planner)
    every = {name: CONTROLLERS[own.type].build(name, own, context) for name, own in spec.controllers.items()}
    built = {name: controller for name, controller in every.items() if controller is not None}
    further = compliant_controllers(spec, context, wrist) if compliant else ()
    wanted = any(controller.feed_forward != "none" for controller in (*built.values(), *further))
    manager = ControllerManager(
        joints=robot.joint_names,
        period=period,
        following=robot.following,
        feed_forward=ModelFeedForward(robot, context.kinematics()) if wanted else None,
    )
    for name, controller in built.items():
        manager.load(controller, update_rate=spec.controllers[name].update_rate)
        manager.configure(name)
    for controller in further:
        manager.load(controller)
        manager.configure(controller.name)
    started = [name for name in built if spec.controllers[name].active]
    manager.switch(activate=[*started, *(own.name for own in further if not own.interfaces)])
    return manager


def controller_findings(
    spec: ControllersSpec, robot: RobotModel, period: float, place: Where = _nowhere
) -> tuple[Diagnostic, ...]:
    """All findings of a controllers file.

    Errors: unknown, fixed, mimic or duplicate joints; interfaces claimed by two active controllers; an update rate that
    does not divide the control rate; problems of each type. Warnings: uncommanded joints, joints that follow two
    controllers, and positions that are commanded below the control rate.
    """
    return tuple(_findings(spec, robot, period, place))


def _findings(spec: ControllersSpec, robot: RobotModel, period: float, place: Where) -> Iterator[Diagnostic]:
    owners: dict[str, dict[Interface, str]] = {}
    commanded: set[str] = set()
    together: set[tuple[str, str, str]] = set()
    for name, own in spec.controllers.items():
        at, meant = ("controllers", name), as_meant(own, robot)
        if not own.joints and own.interfaces:
            yield Diagnostic("CTRL101", f"controller '{name}' has no joints", place((*at, "joints")))
        for k, joint in enumerate(own.joints):
            where = place((*at, "joints", k))
            yield from _joint_findings(name, own, joint, meant.joints[k], robot, where)
            if own.active and not target_of(own):
                before = set(owners.get(joint, {}).values())
                yield from _claim_findings(name, own, joint, owners, where)
                together |= {(other, name, joint) for other in before if name in owners[joint].values()}
        commanded.update(meant.joints if own.interfaces and not target_of(own) else ())
        yield from chain_finding(name, own, spec.controllers, place((*at, "chained_to")))
        yield from _rate_findings(name, own, robot, period, place((*at, "update_rate")))
        for problem in CONTROLLERS[own.type].check(meant, robot):
            message, where = f"controller '{name}': {problem.message}", place((*at, *problem.loc))
            yield Diagnostic(problem.code or "CTRL100", message, where, problem.hint, problem.severity)
    yield from _rivals(spec, together, place)
    idle = [joint.name for joint in robot.moving_joints if joint.independent and joint.name not in commanded]
    if idle:
        yield Diagnostic(
            "CTRL145",
            f"no controller commands {', '.join(repr(joint) for joint in idle)} of robot '{robot.name}'",
            place(("controllers",)),
            hint=f"add {'it' if len(idle) == 1 else 'them'} to a controller; uncommanded joints are held by a brake",
            severity="warning",
        )


def _rate_findings(
    name: str, spec: ControllerSpec, robot: RobotModel, period: float, place: Place | None
) -> Iterator[Diagnostic]:
    if spec.update_rate is None:
        return
    try:
        ticks = ticks_between(spec.update_rate, period)
    except InvalidArgument as refused:
        (why,) = refused.findings
        yield Diagnostic(why.code, f"controller '{name}': {why.message}", place, hint=why.hint)
        return
    limited = [
        joint.name
        for joint in robot.moving_joints
        if joint.name in spec.joints and joint.limits.acceleration is not None
    ]
    if ticks > 1 and "position" in spec.interfaces and limited and not target_of(spec):
        message = f"controller '{name}' commands positions only every {ticks} control ticks: the acceleration limits "
        message += f"of {listed(limited, most=3)} saturate such steps, and the joints lag"
        hint = "remove `update_rate`; positions are then commanded at every tick"
        yield Diagnostic("CTRL170", message, place, hint, "warning")


def _claim_findings(
    name: str, spec: ControllerSpec, joint: str, owners: dict[str, dict[Interface, str]], place: Place | None
) -> Iterator[Diagnostic]:
    """At most one finding; `owners`: joint -> interface -> controller, of the active ones so far; extended here."""
    claimed = owners.setdefault(joint, {})
    hint = "set `active: false` for one of them; a step `switch_controllers` switches between them"
    for interface in spec.interfaces:
        owner = claimed.get(interface)
        if owner is not None:
            yield Diagnostic(
                "CTRL142", f"controllers '{owner}' and '{name}' both claim {joint}/{interface}", place, hint=hint
            )
            return
    if claimed and spec.interfaces and not may_go_together((*claimed, *spec.interfaces)):
        interface, owner = next(iter(claimed.items()))
        message = f"controllers '{owner}' ({joint}/{interface}) and '{name}' ({joint}/{spec.interfaces[0]}) conflict: "
        yield Diagnostic("CTRL148", message + "a joint follows one of them", place, hint=hint)
        return
    claimed.update(dict.fromkeys(spec.interfaces, name))


def _rivals(spec: ControllersSpec, together: Collection[tuple[str, str, str]], place: Where) -> Iterator[Diagnostic]:
    """Pairs of trajectory controllers on a joint, one by position and one by effort; `together`: both, joint."""
    rivals: dict[tuple[str, str], list[str]] = {}
    for first, second, joint in sorted(together):
        if spec.controllers[first].role == spec.controllers[second].role == "follower":
            rivals.setdefault((first, second), []).append(joint)
    for (first, second), joints in rivals.items():
        message = f"controllers '{first}' and '{second}' are both active on {listed(joints)}: a joint tracks positions "
        yield Diagnostic(
            "CTRL149",
            message + "of the one and adds the efforts of the other",
            place(("controllers", second)),
            hint="set `active: false` for one of them; a step `switch_controllers` switches between them",
            severity="warning",
        )


def _joint_findings(
    name: str, spec: ControllerSpec, joint: str, meant: str, robot: RobotModel, place: Place | None
) -> Iterator[Diagnostic]:
    known = {other.name: other for other in robot.joints}
    if joint not in known:
        commandable = [other.name for other in robot.joints if other.independent]
        yield Diagnostic(
            "CTRL144",
            f"controller '{name}': joint '{joint}' is not in robot '{robot.name}'",
            place,
            hint=did_you_mean(joint, commandable, kind="joints") if meant == joint else f"did you mean '{meant}'?",
        )
        return
    found = known[joint]
    if not found.moves:
        yield Diagnostic("CTRL146", f"controller '{name}': joint '{joint}' is fixed and cannot be commanded", place)
    elif found.mimic is not None and spec.interfaces:
        message = f"controller '{name}': joint '{joint}' mimics '{found.mimic.joint}' and cannot be commanded"
        yield Diagnostic("CTRL143", message, place, hint=f"claim '{found.mimic.joint}' instead")
