"""What a log is opened with, and a log judged from nothing but itself."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from manipcli import __version__
from manipcli.control.manager import ControllerManager
from manipcli.flow.load import Task
from manipcli.flow.plan import Plan
from manipcli.judge.expectations import EXPECTATIONS
from manipcli.judge.judge import judge
from manipcli.judge.verdict import Verdict
from manipcli.model.build_scene import build_scene
from manipcli.model.conditions import CONDITIONS
from manipcli.plan.steps import STEPS
from manipcli.record.channels import ControllerChannel
from manipcli.record.reader import read_recording
from manipcli.record.recorder import Recorder
from manipcli.simulate.engines import ENGINES
from manipcli.spec.load import load_task_text, resolved

RUNS = Path("runs")
TASK, ROBOT, CONTROLLERS, URDF, PLAN = "task.yaml", "robot.yaml", "controllers.yaml", "robot.urdf", "plan.json"
YAML, XML, JSON = "application/yaml", "application/xml", "application/json"


def open_log(task: Task, plan: Plan, manager: ControllerManager, path: Path, *, overwrite: bool) -> Recorder:
    """A recorder whose file already holds everything that is known before the run."""
    engine = ENGINES[task.spec.simulation.engine]
    return Recorder(
        path,
        robot=task.robot,
        scene=task.scene,
        controllers=[ControllerChannel(name=c.name, joints=c.joints) for c in manager.controllers],
        period=task.spec.simulation.control_period,
        attachments=[
            (TASK, YAML, resolved(task.spec).encode()),
            (ROBOT, YAML, resolved(task.robot_file.spec).encode()),
            (CONTROLLERS, YAML, resolved(task.controllers).encode()),
            (URDF, XML, task.robot.urdf.encode()),
            (PLAN, JSON, plan.to_json()),
        ],
        metadata={
            "run": {
                "task": task.name,
                "seed": str(task.spec.simulation.seed),
                "engine": engine.name,
                "physics": engine.physics,
                "period": repr(task.spec.simulation.control_period),
            },
            "versions": {"manipcli": __version__, engine.name: engine.version()},
        },
        overwrite=overwrite,
    )


def judge_log(path: Path) -> Verdict:
    """The verdict on a log, from the log alone; a verdict stored in it is not looked at.

    Raises:
        InvalidInput: the file is no log of ours, or is damaged.
    """
    recording = read_recording(path)
    task = load_task_text(
        recording.attachments[TASK].decode(), f"{path.name}/{TASK}",
        steps=STEPS, conditions=CONDITIONS, expectations=EXPECTATIONS,
    ).spec  # fmt: skip
    robot = recorded_robot(recording)
    expect = [(expected.name, expected.body) for expected in task.expect]
    return judge(recording, expect=expect, robot=robot, scene=build_scene(task))


def verdict_metadata(verdict: Verdict) -> Mapping[str, Mapping[str, str]]:
    """What the log keeps of its own verdict, for whoever looks at it without manipcli."""
    return {
        "verdict": {
            "verdict": verdict.verdict,
            "text": verdict.text,
            **{f"step.{step.id}": step.outcome for step in verdict.steps},
            **{
                f"expect.{e.name}": f"{e.outcome} {'' if e.margin is None else repr(e.margin)} {e.unit}".strip()
                for e in verdict.expectations
            },
        }
    }
