"""All files of an export to ROS 2, by their path in its folder."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote
from typing import TYPE_CHECKING

from manipcli.core.geometry import Array
from manipcli.core.text import listed
from manipcli.model.robot import RobotModel
from manipcli.model.self_collision import SelfCollisionMatrix
from manipcli.report.ros2.controllers import Exported, exported, parameters_file
from manipcli.report.ros2.description import PLUGIN, packages, ros2_urdf
from manipcli.report.ros2.goals import LONGEST, Phase, phases
from manipcli.report.ros2.srdf import srdf

if TYPE_CHECKING:
    from manipcli.task.plan_task import Plan
    from manipcli.task.task import Task

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


def robot_files(robot: RobotModel, q: Array, matrix: SelfCollisionMatrix) -> tuple[dict[str, str], tuple[str, ...]]:
    """The files of a robot without controllers, and notes."""
    urdf = ros2_urdf(robot, q, None)
    files = {"robot.urdf": urdf, "robot.srdf": srdf(robot, matrix)}
    notes = ("a robot file names no controllers: controllers.yaml and goals need a task",)
    return {README: _readme(f"Robot '{robot.name}'", robot, urdf, files, notes), **files}, notes


def task_files(task: Task, plan: Plan, matrix: SelfCollisionMatrix) -> tuple[dict[str, str], tuple[str, ...]]:
    """The files of a task and its plan, and notes."""
    robot, spec = task.robot, task.controllers
    controllers, left = exported(spec, robot)
    period = task.spec.simulation.control_period
    parts = phases(plan, spec, controllers, robot)
    hand = [name for own in controllers if own.action is not None and _is_hand(task, own) for name in own.joints]
    urdf = ros2_urdf(robot, plan.start.position, spec)
    title = f"Task '{task.name}' of robot '{robot.name}'"
    files = {
        "controllers.yaml": parameters_file(controllers, period=period, notes=left),
        "robot.urdf": urdf,
        "robot.srdf": srdf(robot, matrix, hand=hand),
        SCRIPT: _script(title, controllers, parts),
    }
    files |= {goal.file: goal.text for phase in parts for goal in phase.goals}
    notes = [*left, *(note for own in controllers for note in own.notes), *_of_plan(task, parts)]
    return {README: _readme(title, robot, urdf, files, notes), **files}, tuple(notes)


def _is_hand(task: Task, own: Exported) -> bool:
    return task.controllers.controllers[own.name].role == "hand"


def _of_plan(task: Task, parts: Sequence[Phase]) -> list[str]:
    waits = [str(step.id) for step in task.spec.steps if step.until is not None]
    notes = [f"{listed(waits, most=3)}: a goal has no `until`; the script does not wait for it"] if waits else []
    long = [goal.file for phase in parts for goal in phase.goals if len(goal.text.encode()) > LONGEST]
    if long:
        notes.append(f"{listed(long, most=3)}: longer than an argument of a command may be; send it from a program")
    return notes


def _script(title: str, controllers: Sequence[Exported], parts: Sequence[Phase]) -> str:
    active = [own.name for own in controllers if own.started]
    lines = [_SEND.format(title=f"{title}: the goals of its plan, in order.", active=", ".join(active) or "none")]
    for phase in parts:
        lines.append(f"# {phase.title}")
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


def _readme(title: str, robot: RobotModel, urdf: str, files: dict[str, str], notes: Sequence[str]) -> str:
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
    used = packages(urdf)
    lines += ["", f"Packages with meshes: {listed(used)}."] if used else []
    X = robot.X_WB
    if X.p.any() or X.rpy.any():
        pose = zip(("x", "y", "z", "roll", "pitch", "yaw"), (*X.p.tolist(), *X.rpy.tolist()), strict=True)
        at = " ".join(f"--{word} {value:.9g}" for word, value in pose)
        frames = f"--frame-id world --child-frame-id {robot.root}"
        lines += ["", f"The robot is mounted at: `ros2 run tf2_ros static_transform_publisher {at} {frames}`"]
    lines += ["", "What differs:", "", *(f"- {note}" for note in notes)] if notes else []
    return "\n".join(lines) + "\n"
