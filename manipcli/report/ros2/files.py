"""All files of an export to ROS 2, by their path in its folder."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote
from typing import TYPE_CHECKING

from manipcli.core.geometry import Array
from manipcli.core.text import listed
from manipcli.model.robot import RobotModel
from manipcli.model.self_collision import SelfCollisionMatrix
from manipcli.report.ros2.controllers import Exported, exported, parameters_file, update_rate
from manipcli.report.ros2.description import PLUGIN, packages, ros2_urdf
from manipcli.report.ros2.goals import LONGEST, Phase, phases
from manipcli.report.ros2.srdf import srdf
from manipcli.spec.controllers_file import ControllersSpec

if TYPE_CHECKING:
    from manipcli.task.plan_task import Plan
    from manipcli.task.task import Task

RATE_ERROR = 1e-6
"""Relative error of the rate of the controller manager above which it is noted."""
README = "README.md"
SCRIPT = "send_goals.sh"
_SEND = """\
#!/bin/sh
# {title}
# The robot starts as in the URDF (`initial_value`), with these controllers active: {active}.
set -eu
cd "$(dirname "$0")"
send() {{  # ACTION TYPE FILE
  ros2 action send_goal "$1" "$2" "$(cat "$3")" | tee /dev/stderr | grep -q 'status: SUCCEEDED'
}}
"""


Files = tuple[dict[str, str], tuple[str, ...]]
"""Texts by path, and notes on what differs in ROS."""


def robot_files(
    robot: RobotModel, q: Array, matrix: SelfCollisionMatrix, spec: ControllersSpec | None, *, period: float
) -> Files:
    """The files of a robot.

    Args:
        robot: the robot.
        q: (n) configuration at the start [rad or m].
        matrix: of its pairs of links.
        spec: its controllers, if they are known.
        period: [s] of the controller manager.
    """
    files, _, notes = _of_robot(robot, q, matrix, spec, period)
    if spec is None:
        notes = (
            "a robot file names no controllers: name them with --controllers, or give a task, which has goals, too",
        )
    return _with_readme(f"Robot '{robot.name}'", robot, files, notes)


def task_files(task: Task, plan: Plan, matrix: SelfCollisionMatrix) -> Files:
    """The files of a task and its plan."""
    robot, spec = task.robot, task.controllers
    period = task.spec.simulation.control_period
    files, controllers, notes = _of_robot(robot, plan.start.position, matrix, spec, period)
    parts = phases(plan, spec, controllers, robot)
    title = f"Task '{task.name}' of robot '{robot.name}'"
    files[SCRIPT] = _script(title, controllers, parts)
    files |= {goal.file: goal.text for phase in parts for goal in phase.goals}
    return _with_readme(title, robot, files, (*notes, *_of_plan(task, parts)))


def _of_robot(
    robot: RobotModel, q: Array, matrix: SelfCollisionMatrix, spec: ControllersSpec | None, period: float
) -> tuple[dict[str, str], tuple[Exported, ...], tuple[str, ...]]:
    """The files of robot and controllers; the controllers; notes on these."""
    own = {} if spec is None else spec.controllers
    hand = [name for each in own.values() if each.role == "hand" for name in each.joints]
    files = {"robot.urdf": ros2_urdf(robot, q, spec), "robot.srdf": srdf(robot, matrix, hand=hand)}
    if spec is None:
        return files, (), ()
    controllers, left = exported(spec, robot)
    rate = update_rate(period)
    if abs(rate * period - 1.0) > RATE_ERROR:
        left += (
            f"`update_rate` is a whole number: {rate} Hz for the control period of {period:g} s, {1 / period:g} Hz",
        )
    files = {"controllers.yaml": parameters_file(controllers, period=period, notes=left), **files}
    return files, controllers, (*left, *(note for each in controllers for note in each.notes))


def _with_readme(title: str, robot: RobotModel, files: dict[str, str], notes: tuple[str, ...]) -> Files:
    return {README: _readme(title, robot, files, notes), **files}, notes


def _of_plan(task: Task, parts: Sequence[Phase]) -> list[str]:
    waits = [str(step.id) for step in task.spec.steps if step.until is not None]
    notes = [f"{listed(waits, most=3)}: a goal has no `until`; the script does not wait for it"] if waits else []
    long = [goal.file for phase in parts for goal in phase.goals if len(goal.text.encode()) > LONGEST]
    if long:
        notes.append(f"{listed(long, most=3)}: longer than an argument of a command may be; send it from a program")
    return notes


def _script(title: str, controllers: Sequence[Exported], parts: Sequence[Phase]) -> str:
    active = [own.name for own in controllers if own.started]
    heading = _one_line(f"{title}: the goals of its plan, in order.")
    lines = [_SEND.format(title=heading, active=_one_line(", ".join(active)) or "none")]
    for phase in parts:
        lines.append(f"# {_one_line(phase.title)}")
        if phase.activate or phase.deactivate:
            words = [
                f"--{word} {' '.join(quote(name) for name in names)}"
                for word, names in (("activate", phase.activate), ("deactivate", phase.deactivate))
                if names
            ]
            lines.append(f"ros2 control switch_controllers --strict {' '.join(words)}")
        commands = [f"send {quote(goal.action)} {goal.type} {quote(goal.file)}" for goal in phase.goals]
        if len(commands) == 1:
            lines += commands
        elif commands:  # both start together
            lines += [f"{command} &" for command in commands[:-1]] + [commands[-1], 'wait "$!"']
        elif phase.pause > 0.0:
            lines.append(f"sleep {phase.pause:.3f}")
    return "\n".join(lines) + "\n"


def _one_line(text: str) -> str:
    """A text for a comment of the script, which no name of a file can leave."""
    return " ".join(text.split())


def _readme(title: str, robot: RobotModel, files: dict[str, str], notes: Sequence[str]) -> str:
    what = {
        "controllers.yaml": "parameters of the controller manager and its controllers",
        "robot.urdf": f"expanded description with a `<ros2_control>` block; its plugin is `{PLUGIN}`: write that of "
        "your arm",
        "robot.srdf": "groups, states, end effectors and disabled collisions for MoveIt",
        SCRIPT: "sends the goals in order and stops at the first that does not succeed",
    }
    lines = [f"# {title}", "", "Written by `manipcli export --ros2`.", ""]
    lines += [f"- `{name}`: {text}" for name, text in what.items() if name in files]
    goals = sum(name.startswith("goals/") for name in files)
    lines += [f"- `goals/`: {goals} goals, one per file, numbered by step and phase"] if goals else []
    if SCRIPT in files:
        lines += ["", f'Each goal by itself, as in `{SCRIPT}`: `ros2 action send_goal ACTION TYPE "$(cat FILE)"`.']
        lines.append("The plan holds only from its start configuration, with its bodies in place.")
    used = packages(files["robot.urdf"])
    lines += ["", f"Packages with meshes: {listed(used)}."] if used else []
    X = robot.X_WB
    if X.p.any() or X.rpy.any():
        pose = zip(("x", "y", "z", "roll", "pitch", "yaw"), (*X.p.tolist(), *X.rpy.tolist()), strict=True)
        at = " ".join(f"--{word} {value:.9g}" for word, value in pose)
        frames = f"--frame-id world --child-frame-id {robot.root}"
        lines += ["", f"The robot is mounted at: `ros2 run tf2_ros static_transform_publisher {at} {frames}`"]
    lines += ["", "What differs:", "", *(f"- {note}" for note in notes)] if notes else []
    return "\n".join(lines) + "\n"
