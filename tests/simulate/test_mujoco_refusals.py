"""What MuJoCo refuses, at its place in the task file and before any physics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Geometry, Sphere
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.engines import mujoco as engine
from manipcli.simulate.engines.mujoco import MujocoSpec
from manipcli.task.load_task import load_task

MEMBER = ENGINES["mujoco"]
ROOT = Path(__file__).parents[2]
TASK = """\
task: bounce
robot: {root}/robots/arm7_hand3/robot.yaml
controllers: {root}/controllers/arm7_hand3.yaml
simulation: {{engine: mujoco{own}}}
scene:
  ball:
    sphere: {{radius: 2 cm}}
    mass: 10 g
    pose: {{xyz: [0.7, 0, 1]}}
    restitution: 0.5
steps:
  - wait: 0.1 s
"""


def robot(inertial: Inertial | None) -> RobotModel:
    limits = JointLimits(-1.0, 1.0, 1.0, 10.0)
    joint = Joint("j", "revolute", "base", "arm", Transform.identity(), frozen((0.0, 1.0, 0.0)), limits)
    links = (Link("base", None, (), ()), Link("arm", inertial, (), ()))
    return RobotModel("bot", "base", links, (joint,), (), (), (), Transform.identity(), "")


WHOLE = robot(Inertial(1.0, Transform.identity(), frozen(np.eye(3) * 0.01)))
BALL = Body(
    name="ball", kind="sphere", geometries=(Geometry(Transform.identity(), Sphere(0.02)),), mass=0.01,
    X_OI=Transform.identity(), inertia=frozen(np.eye(3) * 1e-6), friction=0.8, rolling_friction=0.0,
    spinning_friction=0.0, restitution=0.5, fixed=False, X_WO=Transform.of(xyz=(1.0, 0.0, 1.0)), interior=None,
    size=frozen([0.04] * 3), centre=frozen(np.zeros(3)),
)  # fmt: skip


def scene(*bodies: Body) -> Scene:
    return Scene(bodies, (), frozen((0.0, 0.0, -9.81)))


def written(folder: Path, own: str = "") -> Path:
    file = folder / "task.yaml"
    file.write_text(TASK.format(root=ROOT, own=own))
    return file


def test_a_task_that_it_can_simulate_has_no_refusal() -> None:
    assert MEMBER.refuses(WHOLE, scene(replace(BALL, restitution=0.0)), None) == ()


def test_a_missing_package_is_named_with_the_extra(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(engine, "installed", lambda: False)
    (refusal,) = MEMBER.refuses(WHOLE, scene(), None)
    assert refusal.at == ("simulation", "engine")
    with pytest.raises(InvalidInput) as raised:
        load_task(written(tmp_path, own=", mujoco: {restitution: ignore}"))
    (finding,) = raised.value.findings
    assert "mujoco-core" in finding.message
    assert "pip install 'manipcli[mujoco]'" in (finding.hint or "")
    assert finding.place is not None
    assert (finding.place.line, finding.place.column) == (4, 22)
    with pytest.raises(InvalidInput, match="mujoco-core"):
        MEMBER.open(WHOLE, scene(), EngineSettings(1e-3, 1, np.zeros(1)))


def test_restitution_is_refused_where_it_is_written(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as raised:
        load_task(written(tmp_path))
    (finding,) = raised.value.findings
    assert "restitution of 0.5" in finding.message
    assert finding.place is not None
    assert (finding.place.line, finding.place.column) == (10, 18)


def test_a_restitution_that_a_sample_draws_is_refused_before_the_run(tmp_path: Path) -> None:
    file = written(tmp_path)
    text = file.read_text().replace("restitution: 0.5", "restitution: 0")
    file.write_text(f"{text}vary:\n  scene.ball.restitution: {{uniform: [0.1, 0.5]}}\n")
    assert load_task(file)
    with pytest.raises(InvalidInput, match=r"SIM131.*\(sample 3\)") as raised:
        load_task(file, sample=3)
    (finding,) = raised.value.findings
    assert finding.place is not None
    assert finding.place.line == 10


def test_restitution_may_be_ignored(tmp_path: Path) -> None:
    assert MEMBER.refuses(WHOLE, scene(BALL), MujocoSpec(restitution="ignore")) == ()
    assert load_task(written(tmp_path, own=", mujoco: {restitution: ignore}"))


def test_a_joint_that_moves_no_mass_is_refused() -> None:
    (refusal,) = MEMBER.refuses(robot(None), scene(), None)
    assert refusal.finding.message.startswith("link 'arm' has no mass")
    with pytest.raises(InvalidInput, match="link 'arm' has no mass"):
        MEMBER.open(robot(None), scene(), EngineSettings(1e-3, 1, np.zeros(1)))
