"""A small robot and scene, and runs of them with numbers that are all different."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.controller import ControllerOutput
from manipcli.core.geometry import Array, Transform
from manipcli.description.elements import Joint, JointLimits, Link, Mimic, TransmissionTag
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, ContactPoint, WorldState
from manipcli.record.channels import ControllerChannel
from manipcli.record.write.recorder import Recorder
from manipcli.scene.scene import Body, Frame, Scene
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Sphere

PERIOD = 0.001
CONTROLLERS = (
    ControllerChannel("arm", ("shoulder", "slide")),
    ControllerChannel("hand", ("spin",), interfaces=("position",)),
)


def _robot() -> RobotModel:
    limits = JointLimits(lower=-1.0, upper=1.0, velocity=2.0, effort=10.0)
    names = ("base", "upper", "bracket", "carriage", "wheel", "follower")

    def joint(k: int, name: str, kind: str, axis: tuple[float, float, float], mimic: Mimic | None = None) -> Joint:
        X = Transform.of(xyz=(0.1 * k, -0.2, 0.3), rpy=(0.3 * k, 0.2, -0.5))
        return Joint(name, kind, names[k], names[k + 1], X, np.array(axis), limits, mimic)  # type: ignore[arg-type]

    joints = (
        joint(0, "shoulder", "revolute", (0.0, 0.0, 1.0)),
        joint(1, "weld", "fixed", (1.0, 0.0, 0.0)),
        joint(2, "slide", "prismatic", (0.0, 0.6, 0.8)),
        joint(3, "spin", "continuous", (1.0, 0.0, 0.0)),
        joint(4, "copy", "revolute", (0.0, 1.0, 0.0), Mimic("shoulder", -1.0, 0.1)),
    )
    links = tuple(Link(name, None, (), ()) for name in names)
    X_WB = Transform.of(xyz=(0.0, 0.0, 0.5), rpy=(0.0, 0.0, 0.4))
    transmissions = (
        TransmissionTag("arm", "SimpleTransmission", ("slide",), (-50.0,), (0.2,), ("slide_motor",), (2.0,)),
        TransmissionTag("turn", "SimpleTransmission", ("shoulder",), (3.0,), (0.0,), ("turn",), (1.0,)),
        TransmissionTag("two", "Differential", ("spin", "copy"), (1.0, 1.0), (0.0, 0.0), ("a", "b"), (1.0, 1.0)),
    )
    return RobotModel("testbot", "base", links, joints, (), (), transmissions, X_WB, "<robot name='testbot'>é</robot>")


def _body(name: str, *geometries: Geometry, fixed: bool = False) -> Body:
    identity = Transform.identity()
    X_WO = Transform.of(xyz=(0.5, 0.1, 0.2), rpy=(0.1, 0.2, 0.3))
    return Body(
        name, "box", geometries, 0.0 if fixed else 1.0, identity, np.eye(3), 0.8, 0.0, 0.0, 0.0, fixed, X_WO, None,
        np.ones(3), np.zeros(3),
    )  # fmt: skip


def _scene() -> Scene:
    X = Transform.of(xyz=(0.0, 0.0, 0.05), rpy=(0.0, 0.5, 0.0))
    cup = (
        Geometry(X, Cylinder(0.04, 0.1), (0.1, 0.2, 0.3, 1.0)),
        Geometry(X, Mesh("/home/someone/meshes/cup.stl", Path("/home/someone/meshes/cup.stl"), (1.0, 1.0, 2.0))),
    )
    bodies = (
        _body("desk", Geometry(X, Box((0.5, 0.6, 0.7))), fixed=True),
        _body("cup", *cup),
        _body("ball", Geometry(X, Sphere(0.02))),
    )
    return Scene(bodies, (Frame("spout", "cup", X),), np.array((0.0, 0.0, -9.81)))


@dataclass(frozen=True)
class Run:
    """What a run of T ticks puts into its recorder."""

    robot: RobotModel
    scene: Scene
    states: WorldState
    outputs: tuple[tuple[Array, ...], ...]
    contacts: tuple[Contact, ...]

    @property
    def ticks(self) -> int:
        return len(self.states.time)

    def outputs_at(self, tick: int) -> list[ControllerOutput]:
        """What the controllers put out at a tick: position, velocity and acceleration of the reference, and command."""
        found = []
        for arrays in self.outputs:
            rows = np.stack([a[tick] for a in arrays])
            output = ControllerOutput.of(rows.shape[1], 1)
            output.rows[:] = rows
            found.append(output)
        return found

    def recorder(self, path: Path, **changes: object) -> Recorder:
        arguments: dict[str, object] = {
            "robot": self.robot,
            "scene": self.scene,
            "controllers": CONTROLLERS,
            "period": PERIOD,
            "attachments": [("task.yaml", "application/yaml", b"task: test\n"), ("plan.json", "application/json", b"")],
            "metadata": {"run": {"task": "test", "seed": "7"}},
        }
        return Recorder(path, **(arguments | changes))  # type: ignore[arg-type]

    def feed(self, recorder: Recorder, start: int = 0, end: int | None = None) -> None:
        """Ticks, an event every 250 ticks (before the tick of its time), a contact that comes and goes every 100."""
        s = self.states
        for k in range(start, self.ticks if end is None else end):
            if k % 250 == 0:
                recorder.event(
                    k, kind="step_started", step=f"step_{k}", verb="move", outcome="", text="é ok", place="t.yaml:12:3"
                )
            one = [a[k] for a in (s.time, s.position, s.velocity, s.effort, s.body_position, s.body_quat_xyzw)]
            zeros = np.zeros((2, 3))
            recorder.tick(k, WorldState(*one, zeros, zeros), self.outputs_at(k))
            if k % 100 == 0:
                recorder.contacts(k, self.contacts if (k // 100) % 2 else ())

    def write(self, path: Path) -> Path:
        recorder = self.recorder(path)
        self.feed(recorder)
        recorder.flush()
        recorder.finish({"verdict": {"verdict": "passed"}})
        return path


def _run(ticks: int) -> Run:
    rng = np.random.default_rng(5)
    robot, scene = _robot(), _scene()
    quat = rng.normal(size=(ticks, 2, 4))
    quat /= np.linalg.norm(quat, axis=2, keepdims=True)
    shape = (ticks, 4)
    states = WorldState(
        time=np.arange(ticks) * PERIOD,
        position=rng.normal(size=shape),
        velocity=rng.normal(size=shape),
        effort=rng.normal(size=shape),
        body_position=rng.normal(size=(ticks, 2, 3)),
        body_quat_xyzw=quat,
        body_linear=np.zeros((ticks, 2, 3)),
        body_angular=np.zeros((ticks, 2, 3)),
    )
    outputs = tuple(tuple(rng.normal(size=(ticks, len(c.joints))) for _ in range(4)) for c in CONTROLLERS)
    points = tuple(
        ContactPoint(tuple(p), tuple(n), force, tuple(f))
        for force, (p, n, f) in zip((1.25, 0.0, 0.25), rng.normal(size=(3, 3, 3)).tolist(), strict=True)
    )
    contacts = (
        Contact("ball", "cup", 0.25, 0.0, points[2:]),
        Contact("cup", "desk", 0.0, -0.0001),
        Contact("cup", "robot/wheel", 1.5, -0.0002, points),
    )
    return Run(robot, scene, states, outputs, contacts)


@pytest.fixture
def make_run() -> Callable[[int], Run]:
    """The run of so many ticks; the same every time."""
    return _run
