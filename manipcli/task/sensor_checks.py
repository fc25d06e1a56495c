"""Checks of `sensors:` in the robot file and in the task: places, times and names."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.conditions.condition import Problem
from manipcli.conditions.frames import fixed_frame
from manipcli.conditions.sensed import Sensed
from manipcli.control.controllers.cartesian_impedance import CartesianImpedanceSpec
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import did_you_mean, listed
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claims
from manipcli.plan.hand import moved_links
from manipcli.plan.steps.grasp import GraspSpec
from manipcli.plan.steps.locate import LocateSpec
from manipcli.plan.steps.pick import PickSpec
from manipcli.scene.scene import Scene
from manipcli.simulate.hand_pads import hand_pads
from manipcli.simulate.sensor_layout import sensed_by_name, ticks_per_measurement
from manipcli.simulate.sensors import SENSORS
from manipcli.simulate.sensors.camera import MOST_PIXELS, CameraSpec
from manipcli.simulate.sensors.tactile import TactileSpec
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Located
from manipcli.spec.mounted_sensor import MountedSpec
from manipcli.spec.robot import RobotSpec
from manipcli.spec.sensors import SensorSpec
from manipcli.spec.task import TaskSpec
from manipcli.task.felt import felt

ABSENT: Final = 230
"""Number of the code of a finding about a name in a task that does not exist."""
LOG_FOLDER: Final = "sensors"
"""A controller of this name publishes next to the sensors."""
OF_CONTROLLERS: Final = ("controller_state", "reference", "error", "wrench")
PARALLEL: Final = 1.0
"""[deg] Accepted rotation between the frame of a sensor and the tool whose force it measures."""
MOST_WAITING, MOST_STREAM = 1e9, 2e9
"""[byte] Of the measurements of a sensor on their way; [byte/s] of its measurements."""
WHOLE: Final = 1e-6
"""Accepted deviation of a number of ticks from a whole number, as a share."""


@dataclass(frozen=True, slots=True)
class _Named:
    """A sensor and its file; `fixed`: whether it may be in a frame of the scene."""

    name: str
    spec: SensorSpec
    file: Located[RobotSpec] | Located[TaskSpec]
    fixed: bool

    def finding(self, problem: Problem, *, key: bool = False) -> Diagnostic:
        """A problem at its place."""
        at = ("sensors", self.name, *problem.loc)
        place = self.file.source.key_place(*at) if key else self.file.place(*at)
        message = f"sensor '{self.name}': {problem.message}"
        return Diagnostic(problem.code or "SENS100", message, place, problem.hint, problem.severity)


def refuse(findings: Sequence[Diagnostic]) -> None:
    """
    Raises:
        InvalidInput: there are findings.
    """
    if findings:
        raise InvalidInput(findings)


def robot_sensor_findings(file: Located[RobotSpec], robot: RobotModel) -> tuple[Diagnostic, ...]:
    """All errors about the sensors of a robot file, which need no task."""
    sensors = _of_robot(file)
    found = [finding for own in sensors for finding in _of_one(own, robot, None)]
    return (*found, *_names(sensors, None, robot, None), *_measured_twice(sensors, robot))


def sensor_findings(
    task: Located[TaskSpec],
    robot_file: Located[RobotSpec] | None,
    controllers: Located[ControllersSpec] | None,
    robot: RobotModel,
    scene: Scene,
) -> tuple[Diagnostic, ...]:
    """All errors about the sensors of a task and of its robot file; files that are refused are None."""
    sensors = [] if robot_file is None else _of_robot(robot_file)
    sensors += [_Named(name, spec, task, True) for name, spec in (task.spec.sensors or {}).items()]
    found = [finding for own in sensors for finding in _of_one(own, robot, scene)]
    period = task.spec.simulation.control_period
    found += [own.finding(problem) for own in sensors for problem in _times(own.spec, period)]
    found += [own.finding(problem) for own in sensors for problem in _amounts(own.spec, robot, period)]
    found += _names(sensors, controllers, robot, scene)
    found += _measured_twice(sensors, robot)
    if controllers is not None and robot_file is not None:
        every = {own.name: own.spec for own in sensors}
        found += [*_readers(controllers, every, robot), *_reflexes(task, controllers.spec, every, robot)]
    if robot_file is not None and not task.source.kept:
        found += _looking(task, {own.name: own.spec for own in sensors})
    return tuple(found)


def sensed(
    task: Located[TaskSpec], robot_file: Located[RobotSpec] | None, robot: RobotModel, scene: Scene
) -> dict[str, Sensed] | None:
    """The sensors of a task and its robot as conditions see them; None: a file is refused, or they have errors."""
    if robot_file is None or not task.source.untouched("sensors"):
        return None
    sensors = {**(robot_file.spec.sensors or {}), **(task.spec.sensors or {})}
    return {**felt(task.spec), **sensed_by_name(sensors, robot, scene)}


def _of_robot(file: Located[RobotSpec]) -> list[_Named]:
    return [_Named(name, spec, file, False) for name, spec in (file.spec.sensors or {}).items()]


def _of_one(own: _Named, robot: RobotModel, scene: Scene | None) -> Iterator[Diagnostic]:
    """Problems of a sensor alone; `scene`: None for a robot file without a task."""
    member, spec = SENSORS[own.spec.type], own.spec
    placed = _place(own, robot, scene) if isinstance(spec, MountedSpec) else ()
    found = [*placed] or [*member.check(spec, robot, scene or Scene((), (), robot.X_WB.p))]
    yield from map(own.finding, found)


def _place(own: _Named, robot: RobotModel, scene: Scene | None) -> Iterator[Problem]:
    """Problems of `link` and `frame`."""
    spec, links = own.spec, [link.name for link in robot.links]
    assert isinstance(spec, MountedSpec)
    if spec.link is not None and spec.frame is not None:
        yield Problem(("frame",), "it has both `link` and `frame`", "remove one of them", "SENS102")
    elif spec.link is not None and spec.link not in links:
        hint = did_you_mean(spec.link, links, kind="links")
        yield Problem(("link",), f"robot '{robot.name}' has no link '{spec.link}'", hint, "SENS101")
    elif spec.frame is not None and not own.fixed:
        hint = "write `link: LINK`, or move the sensor to the task"
        yield Problem(("frame",), "`frame` is of the scene; a sensor of a robot file is on a link", hint, "SENS102")
    elif spec.link is None and (SENSORS[spec.type].needs_link or not own.fixed):
        what = f"a sensor of type '{spec.type}'" if own.fixed else "a sensor of a robot file"
        yield Problem((), f"it is on no link; {what} needs one", f"add `link: ...`; links: {listed(links)}", "SENS100")
    elif spec.frame is not None and scene is not None:
        for problem in fixed_frame(robot, scene, spec.frame, ("frame",)):
            yield Problem(problem.loc, problem.message, problem.hint, "SENS101")


def _times(spec: SensorSpec, period: float) -> Iterator[Problem]:
    """Problems of `rate` and `delay` with control ticks of `period` [s]."""
    ticks = ticks_per_measurement(spec, period)
    if spec.rate is not None and (round(ticks) < 1 or abs(ticks - round(ticks)) > WHOLE * ticks):
        message = f"rate {spec.rate:g} Hz does not divide the control rate, {1.0 / period:g} Hz"
        yield Problem(("rate",), message, f"write {' or '.join(_near_rates(ticks, period))}", "SENS106")
    delay = spec.delay / period
    if abs(delay - round(delay)) > WHOLE * max(1.0, delay):
        near = [f"'{1e3 * period * whole:.10g} ms'" for whole in (math.floor(delay), math.ceil(delay))]
        message = f"delay {1e3 * spec.delay:g} ms is not a whole number of control periods, {1e3 * period:g} ms"
        yield Problem(("delay",), message, f"write {' or '.join(near)}", "SENS107")


def _amounts(spec: SensorSpec, robot: RobotModel, period: float) -> Iterator[Problem]:
    """More data than memory or disk can hold."""
    if isinstance(spec, CameraSpec):
        if spec.resolution[0] * spec.resolution[1] > MOST_PIXELS:  # reported already
            return
        size = float(spec.bytes)
    else:
        size = 8.0 * sum(quantity.width for quantity in SENSORS[spec.type].quantities(spec, robot))
    rate = 1.0 / period if spec.rate is None else min(spec.rate, 1.0 / period)
    if size * rate > MOST_STREAM:
        message = f"it measures {size * rate / 1e9:.3g} GB per second, more than {MOST_STREAM / 1e9:g} GB"
        hint = f"lower its rate to {MOST_STREAM / size:.3g} Hz or less, or take smaller pictures"
        yield Problem(("rate",) if "rate" in spec.model_fields_set else (), message, hint, "SENS113")
    elif size * rate * spec.delay > MOST_WAITING:
        waiting = f"{size * rate * spec.delay / 1e9:.3g} GB of measurements are on their way during its delay"
        hint = f"lower `delay` to {MOST_WAITING / (size * rate):.3g} s or less, or its rate"
        yield Problem(("delay",), f"{waiting}, more than {MOST_WAITING / 1e9:g} GB", hint, "SENS113")


def _near_rates(ticks: float, period: float) -> list[str]:
    """The next rates below and above that divide the control rate, with few digits if there are any near."""
    found: list[str] = []
    for counts in (range(math.ceil(ticks), 2 * math.ceil(ticks) + 1), range(math.floor(ticks), 0, -1)):
        rates = [1.0 / (period * count) for count in counts]
        plain = [rate for rate in rates[:20] if abs(rate - round(rate, 3)) < 1e-9 * rate]
        found += [f"'{rate:.10g} Hz'" for rate in (plain or rates)[:1]]
    return found


def _names(
    sensors: list[_Named], controllers: Located[ControllersSpec] | None, robot: RobotModel, scene: Scene | None
) -> Iterator[Diagnostic]:
    """Names that another sensor, a frame or a topic of a controller has already."""
    taken = {link.name: "a link of the robot" for link in robot.links}
    taken |= {body.name: "a body of the scene" for body in (scene.bodies if scene else ())}
    taken |= {frame.name: "a frame of the scene" for frame in (scene.frames if scene else ())} | {"world": "the world"}
    beside = controllers is not None and LOG_FOLDER in controllers.spec.controllers
    seen: dict[str, str] = {}
    for own in sensors:
        member = SENSORS[own.spec.type]
        frames = [own.name, *(own.name + suffix for suffix in member.frames(own.spec))]
        message = ""
        if own.name in seen:
            message = f"duplicate name: {seen[own.name]} has a sensor of this name"
        elif isinstance(own.spec, MountedSpec) and (clash := next((f for f in frames if f in taken), None)):
            message = f"its frame '{clash}' has the name of {taken[clash]}"
        elif beside and own.name in OF_CONTROLLERS:
            message = f"its topic /sensors/{own.name} is one of the controller '{LOG_FOLDER}'"
        if message:
            hint = "rename it: names of sensors are unique, and name frames and topics in the log"
            yield own.finding(Problem((), message, hint, "SENS108"), key=True)
        seen.setdefault(own.name, "the task" if own.fixed else "the robot file")
        taken |= dict.fromkeys(frames, f"a frame of the sensor '{own.name}'")


def _measured_twice(sensors: list[_Named], robot: RobotModel) -> Iterator[Diagnostic]:
    """Joints that two sensors measure: controllers read one of them."""
    owners: dict[str, str] = {}
    for own in sensors:
        joints = SENSORS[own.spec.type].joints
        for name in () if joints is None else joints(own.spec, robot):
            if (other := owners.setdefault(name, own.name)) != own.name:
                message = f"joint '{name}' is measured by the sensor '{other}' already; controllers read one sensor"
                yield own.finding(Problem((), message, "list other `joints`, or remove one of them", "SENS110"))
                break


def _looking(task: Located[TaskSpec], sensors: dict[str, SensorSpec]) -> Iterator[Diagnostic]:
    """Steps that look at an object that is known exactly, or with a sensor that is no camera with depth."""
    able = [name for name, spec in sensors.items() if isinstance(spec, CameraSpec) and spec.depth]
    for k, step in enumerate(task.spec.steps):
        if not isinstance(step.body, LocateSpec):
            continue
        body = task.spec.scene.get(step.body.object)
        if body is not None and body.known is None and not body.fixed:
            message = f"the pose of '{step.body.object}' is known exactly: it has no `known`"
            hint = "add to it `known: {region: {radius: 3 cm}}`, or remove this step"
            yield task.source.finding(ABSENT, ("steps", k, step.verb, "object"), message, hint=hint)
        if (name := step.body.with_) in able:
            continue
        spec = sensors.get(name)
        if spec is None:
            message = f"neither robot nor task has a sensor '{name}'"
        elif isinstance(spec, CameraSpec):
            message = f"camera '{name}' has no depth: `depth` is false"
        else:
            message = f"sensor '{name}' is of type '{spec.type}', not 'camera'"
        near = did_you_mean(name, able, kind="cameras") if able else "add one under `sensors:`, with `type: camera`"
        near = "write `depth: true`" if isinstance(spec, CameraSpec) else near
        yield task.source.finding(ABSENT, ("steps", k, step.verb, "with"), message, hint=near)


def _readers(
    controllers: Located[ControllersSpec], sensors: dict[str, SensorSpec], robot: RobotModel
) -> Iterator[Diagnostic]:
    """Controllers that read a sensor that is missing or of another type, or that does not move with the tool."""
    wrenches = [name for name, spec in sensors.items() if spec.type == "force_torque"]
    for name, spec in controllers.spec.controllers.items():
        force = spec.force if isinstance(spec, CartesianImpedanceSpec) else None
        read = getattr(spec, "sensor", None) if force is None else force.sensor
        if not isinstance(read, str):
            continue
        place = controllers.place("controllers", name, *(("sensor",) if force is None else ("force", "sensor")))
        if read in wrenches:
            own = sensors[read]
            if not (isinstance(spec, CartesianImpedanceSpec) and isinstance(own, MountedSpec)):
                continue
            if reason := _not_along(own, spec, robot):
                hint = "mount it on the link of the tool; turn it with `at: {rpy: ...}` to the axes of the tool"
                yield Diagnostic("SENS112", f"controller '{name}': sensor '{read}' {reason}", place, hint)
            continue
        if read in sensors:
            message = f"controller '{name}': sensor '{read}' is of type '{sensors[read].type}', not 'force_torque'"
        else:
            message = f"controller '{name}': neither robot nor task has a sensor '{read}'"
        yield Diagnostic("SENS111", message, place, did_you_mean(read, wrenches, kind="sensors"))


def _not_along(sensor: MountedSpec, spec: CartesianImpedanceSpec, robot: RobotModel) -> str:
    """Why a sensor does not measure along the axes of the tool; empty if it does."""
    tool = robot.tool if spec.link is None else None
    link = (spec.link or "") if tool is None else tool.link
    parents = {joint.child: joint for joint in robot.joints}
    if link not in parents or sensor.link not in parents:
        return ""  # reported for the sensor or the controller
    R = np.eye(3) if tool is None else np.asarray(tool.X_LT.R)
    if link not in robot.descendants(sensor.link):
        return f"does not carry the tool: '{link}' is not below '{sensor.link}'"
    while link != sensor.link:
        joint = parents[link]
        if joint.moves:
            return f"does not move with the tool: joint '{joint.name}' is between them"
        R, link = np.asarray(joint.X_PJ.R) @ R, joint.parent
    cosine = (np.trace(np.asarray(sensor.at.transform.R).T @ R) - 1.0) / 2.0
    angle = float(np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return f"is rotated by {angle:.3g} deg from the tool" if angle > PARALLEL else ""


def _reflexes(
    task: Located[TaskSpec], controllers: ControllersSpec, sensors: dict[str, SensorSpec], robot: RobotModel
) -> Iterator[Diagnostic]:
    """Reflexes of a hand that does not feel shear."""
    joints = tuple(name for name in Claims.of(controllers).hand if name in robot.joint_names)
    links = moved_links(robot, joints) if joints else frozenset[str]()
    for k, step in enumerate(task.spec.steps):
        grasp, keys = (step.body.grasp, ("grasp",)) if isinstance(step.body, PickSpec) else (step.body, ())
        if not isinstance(grasp, GraspSpec) or not grasp.reflex or hand_pads(sensors, robot, joints):
            continue
        place = task.place("steps", k, step.verb, *keys, "reflex")
        blunt = [name for name, spec in sensors.items() if isinstance(spec, TactileSpec) and spec.link in links]
        if blunt:
            hint = f"add `shear: true` to the sensor '{blunt[0]}'"
        else:
            there = [link.name for link in robot.links if link.name in links and link.collisions]
            hint = f"add a sensor of type `tactile` with `shear: true` on a link of the hand: {listed(there)}"
        yield Diagnostic("SENS150", "the reflex feels no slip: no sensor with `shear` is on the hand", place, hint)
