"""A 7-joint arm, roll and pitch alternating, with two sliding fingers, built by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manipcli.control.controllers.gripper import GripperSpec
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.model.robot import Group, RobotModel
from manipcli.plan.hand import closing_speed
from manipcli.plan.motion import Motion, PlanningState, StepPlan
from manipcli.plan.planner import Planner
from manipcli.plan.steps import STEPS
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Shape
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position
from manipcli.task.task import Task

ARM = tuple(f"joint_{k}" for k in range(1, 8))
_LENGTHS = (0.16, 0.2, 0.22, 0.2, 0.2, 0.2, 0.1)  # from joint k to joint k + 1, along z
_RANGES = (2.9, 2.0, 2.9, 2.0, 2.9, 2.0, 3.0)


def arm7(*, velocity: float = 2.0, acceleration: float = 10.0, jerk: float | None = None) -> RobotModel:
    """Joint vector: seven arm joints, then two fingers (prismatic, along y of the palm, which is the last arm link)."""
    links = [_link("base", Box((0.2, 0.2, 0.1)), 0.05)]
    joints = []
    z, parent = 0.16, "base"
    for k, (length, half) in enumerate(zip(_LENGTHS, _RANGES, strict=True), start=1):
        child = f"link_{k}"
        joints.append(
            Joint(
                name=f"joint_{k}",
                type="revolute",
                parent=parent,
                child=child,
                X_PJ=Transform.of(xyz=(0, 0, z)),
                axis=frozen((0, 0, 1) if k % 2 else (0, 1, 0)),
                limits=JointLimits(-half, half, velocity, 100.0, acceleration, jerk),
            )
        )
        links.append(_link(child, Cylinder(0.04, 0.8 * length), 0.5 * length))
        z, parent = length, child
    for name, side in (("finger_left", 1.0), ("finger_right", -1.0)):
        joints.append(
            Joint(
                name=f"{name}_joint",
                type="prismatic",
                parent=parent,
                child=name,
                X_PJ=Transform.of(xyz=(0, side * 0.01, 0.1)),
                axis=frozen((0, side, 0)),
                limits=JointLimits(0.0, 0.05, 0.2, 20.0, 2.0, None),
            )
        )
        links.append(_link(name, Box((0.02, 0.01, 0.08)), 0.05))
    return RobotModel(
        name="arm7",
        root="base",
        links=tuple(links),
        joints=tuple(joints),
        groups=(Group("arm", ARM, tip="link_7"),),
        poses=(),
        transmissions=(),
        X_WB=Transform.identity(),
        urdf="",
    )


@pytest.fixture(scope="session")
def make_arm7() -> Callable[..., RobotModel]:
    """`arm7`, with velocity, acceleration, jerk as keywords."""
    return arm7


@pytest.fixture
def middle() -> Array:
    """A posture well inside the limits, elbow bent, fingers half open."""
    return np.array([0.1, 0.5, 0.0, -1.3, 0.0, 0.8, 0.2, 0.02, 0.02])


ROOT = Path(__file__).parents[2]
SCENE = """
  desk: {box: {size: [0.6, 1.0, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}
  cup: {cup: {radius: 36 mm, height: 110 mm, wall: 4 mm}, mass: 150 g, rests_on: desk, at: [0.75, 0.0]}
  ball: {sphere: {radius: 14 mm}, mass: 10 g, inside: cup}
  tray: {tray: {size: [0.3, 0.3, 0.05]}, rests_on: desk, at: [0.70, 0.32], fixed: true}
"""
TABLE = """
  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}
  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}
"""

POUR = (
    ("pick", {"object": "cup", "grasp": {"posture": "wrap", "height": "68 mm"}}),
    ("lift", {"object": "cup"}),
    ("pour", {"object": "cup", "into": "tray", "tilt": "125 deg"}),
    ("place", {"object": "cup"}),
)


class Bench:
    """A robot at a scene, on which steps are planned one after the other, without a task of its own for each."""

    def __init__(self, task: Task) -> None:
        self.task = task
        self.robot, self.scene = task.robot, task.scene
        gripper = next((c for c in task.controllers.controllers.values() if isinstance(c, GripperSpec)), None)
        self.planner = Planner(
            task.robot,
            task.scene,
            period=1e-3,
            rng=np.random.default_rng(1),
            gripper_joints=() if gripper is None else gripper.joints,
            gripper_speed=1.0 if gripper is None else closing_speed(task.robot, gripper.joints, gripper.speed),
        )
        self.start = PlanningState(start_position(task), tuple(body.X_WO for body in task.scene.movable))
        self.now = self.start

    def plan(self, verb: str, spec: object) -> StepPlan:
        """The plan of a step from `now`, which stays."""
        step = STEPS[verb]
        return step.plan(step.spec.model_validate(spec), self.planner, self.now)

    def do(self, verb: str, spec: object) -> StepPlan:
        """The plan of a step; `now` is its end afterwards."""
        planned = self.plan(verb, spec)
        self.now = planned.end
        return planned

    def refused(self, verb: str, spec: object) -> NotPlannable:
        """Why a step cannot be planned."""
        with pytest.raises(NotPlannable) as refusal:
            self.plan(verb, spec)
        return refusal.value

    def problems(self, verb: str, spec: object) -> list[tuple[object, ...]]:
        """(loc, message, hint) of everything in a step that robot and scene do not know."""
        step = STEPS[verb]
        return [(p.loc, p.message, p.hint) for p in step.check(step.spec.model_validate(spec), self.robot, self.scene)]

    def body(self, name: str, situation: PlanningState | None = None) -> Transform:
        """X_WO as predicted."""
        index = [body.name for body in self.scene.movable].index(name)
        return (self.now if situation is None else situation).bodies[index]

    def tool(self, position: Array) -> Array:
        """X_WT (4, 4), by multiplying the joints of the description from the root to the tool."""
        assert self.robot.tool is not None
        by_child = {joint.child: joint for joint in self.robot.joints}
        X, link = self.robot.tool.X_LT.matrix, self.robot.tool.link
        while link in by_child:
            joint = by_child[link]
            moved = np.eye(4)
            if joint.moves:
                value = position[self.robot.joint_names.index(joint.name)]
                if joint.type == "prismatic":
                    moved[:3, 3] = value * joint.axis
                else:
                    moved[:3, :3] = Rotation.from_rotvec(value * joint.axis).as_matrix()
            X = joint.X_PJ.matrix @ moved @ X
            link = joint.parent
        return self.robot.X_WB.matrix @ X

    def at(self, before: PlanningState, plan: StepPlan, label: str) -> tuple[PlanningState, Motion]:
        """The motion of this label in the plan of a step from `before`, and where the arm is when it begins."""
        q = np.array(before.position)
        for motion in plan.motions:
            if motion.label == label:
                return before.moved(q), motion
            if motion.trajectory is not None:
                q[self.robot.indices(motion.trajectory.names)] = motion.trajectory.positions[-1]
        raise AssertionError(f"no motion '{label}'")

    def tools(self, before: PlanningState, plan: StepPlan, label: str, count: int = 40) -> Array:
        """X_WT (count, 4, 4) along one motion of the plan of a step from `before`."""
        start, motion = self.at(before, plan, label)
        assert motion.trajectory is not None
        columns = self.robot.indices(motion.trajectory.names)
        q = np.array(start.position)
        found = []
        for time in np.linspace(0.0, motion.trajectory.duration, count):
            q[columns] = motion.trajectory.sample(float(time))[0]
            found.append(self.tool(q))
        return np.array(found)


@dataclass(frozen=True)
class Story:
    """Steps by verb, each with the situation that it was planned from."""

    bench: Bench
    steps: dict[str, tuple[PlanningState, StepPlan]]


@pytest.fixture(scope="session")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Bench]:
    """Makes a `Bench`: of the arm with three fingers at a cup on a desk, or of what is named."""
    loaded: dict[str, Task] = {}

    def make(robot: str = "arm7_hand3", scene: str | None = None, more: str = "") -> Bench:
        if scene is None:
            scene = SCENE if robot == "arm7_hand3" else TABLE
        text = f"""
task: bench
robot: {ROOT}/robots/{robot}/robot.yaml
controllers: {ROOT}/controllers/{robot}.yaml
scene: {scene}
{more}
steps: [wait: 1 s]
"""
        if text not in loaded:
            path = tmp_path_factory.mktemp("bench") / "task.yaml"
            path.write_text(text)
            loaded[text] = load_task(path, allow_outside=True)
        return Bench(loaded[text])

    return make


@pytest.fixture(scope="session")
def story(bench: Callable[..., Bench]) -> Story:
    """The cup picked, lifted, poured from and put back; planned once."""
    told = bench()
    steps = {}
    for verb, spec in POUR:
        before = told.now
        steps[verb] = (before, told.do(verb, spec))
    return Story(told, steps)


def _link(name: str, shape: Shape, z: float) -> Link:
    return Link(name=name, inertial=None, visuals=(), collisions=(Geometry(Transform.of(xyz=(0, 0, z)), shape),))
