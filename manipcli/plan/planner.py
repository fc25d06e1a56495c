"""What steps plan with: the robot, the scene, inverse kinematics, timing and collision checks, behind a few verbs.

`Planner` answers questions about a situation; `Draft` strings motions together, each from where the one before ends.
Every trajectory is verified against the limits and the scene before it is accepted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen, matrix_from_axis_angle
from manipcli.model.collision import Carried, CollisionChecker, Pair, pairs
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.limits import MotionLimits
from manipcli.plan.path import ANGULAR_STEP, JointPath, follow_poses, joint_path, linear_path
from manipcli.plan.rest_to_rest import rest_to_rest
from manipcli.plan.retimer import retime
from manipcli.plan.step import Grip, Motion, Situation, StepPlan
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.verify import verify

Pairs = frozenset[Pair]
"""Pairs of parts that may touch; a part is a body, or `robot/<link>`."""

NOTHING: Pairs = frozenset()
CLEARANCE = 0.004
"""How far [m] the robot keeps from everything it is not to touch: more than its controllers deviate."""
TOUCHING = 0.003
"""Bodies nearer than this [m] count as touching: what a held object may leave or come to."""


class Planner:
    """Everything that does not change from step to step."""

    def __init__(
        self,
        robot: RobotModel,
        scene: Scene,
        *,
        period: float,
        rng: np.random.Generator,
        gripper_joints: tuple[str, ...],
        gripper_speed: float,
    ) -> None:
        """
        Args:
            robot, scene: the world; `robot.tool` carries the tool frame T.
            period: control period [s].
            rng: draws the restarts of the inverse kinematics.
            gripper_joints: joints that a gripper controller moves; all others follow trajectories.
            gripper_speed: at which the hand's references move [rad/s or m/s].
        """
        self.robot = robot
        self.scene = scene
        self.period = period
        self.rng = rng
        self.gripper_joints = gripper_joints
        self.gripper_speed = gripper_speed
        self.kinematics = Kinematics(robot)
        self.checker = CollisionChecker(self.kinematics, scene, ignore=robot.collision_ignore)
        self._solver: InverseKinematics | None = None

    @property
    def solver(self) -> InverseKinematics:
        """Inverse kinematics of the tool over the arm: the independent joints above it that are not the hand's."""
        if self._solver is None:
            if self.robot.tool is None:
                raise NotPlannable(
                    f"robot '{self.robot.name}' has no tool frame", hint="add `tool: {link: ...}` to the robot file"
                )
            joints = tuple(name for name in _joints_above(self.robot, self.robot.tool.link)
                           if name not in self.gripper_joints)  # fmt: skip
            self._solver = InverseKinematics(
                self.kinematics, joints, self.robot.tool.link, X_LT=self.robot.tool.X_LT
            )
        return self._solver

    @property
    def tool_link(self) -> str:
        """The link that carries the tool, and what the hand holds."""
        return self.solver.link

    def tool_pose(self, situation: Situation) -> Transform:
        """X_WT."""
        return self.solver.forward(situation.position)

    def body_pose(self, situation: Situation, name: str) -> Transform:
        """X_WO of a body."""
        body = self.scene.body(name)
        return body.X_WO if body.fixed else situation.bodies[self.scene.movable.index(body)]

    def frame(self, name: str, situation: Situation) -> Transform:
        """X_WF of `world`, `base`, `tool`, a body, or a named frame."""
        if name == "world":
            return Transform.identity()
        if name == "base":
            return self.robot.X_WB
        if name == "tool":
            return self.tool_pose(situation)
        for frame in self.scene.frames:
            if frame.name == name:
                return self.frame(frame.parent, situation) @ frame.X_PF
        return self.body_pose(situation, name)

    def held(self, situation: Situation, body: str) -> Pairs:
        """The contacts of a held object with the hand.

        Raises:
            NotPlannable: the object is not held.
        """
        if situation.carried is None or situation.carried.body != body:
            holds = "nothing" if situation.carried is None else f"'{situation.carried.body}'"
            raise NotPlannable(f"'{body}' is not held; the hand holds {holds}", hint="pick or grasp it first")
        return self.hand_contacts(body)

    def hand_contacts(self, body: str) -> Pairs:
        """Every pair of a link of the hand with this body."""
        return pairs(self._hand_links(), body)

    def held_in_tool(self, situation: Situation) -> Transform:
        """X_TO of the held object."""
        assert situation.carried is not None  # callers ask `held` first
        X_WO = self.body_pose(situation, situation.carried.body)
        return self.tool_pose(situation).inverse() @ X_WO

    def touching(self, situation: Situation, body: str) -> Pairs:
        """The pairs of a movable body with what it stands on or leans against."""
        root = self.robot.root
        X_LO = self.robot.X_WB.inverse() @ self.body_pose(situation, body)
        there = self.checker.at(situation.bodies, carried=Carried(body=body, link=root, X_LO=X_LO), margin=TOUCHING)
        return frozenset((hit.a, hit.b) for hit in there.every(situation.position) if body in (hit.a, hit.b))

    def _hand_links(self) -> frozenset[str]:
        """Links below the arm's last joint, the palm included."""
        last = self.robot.joint(self.solver.joints[-1])
        return self.robot.descendants(last.child)


class Draft:
    """Motions in the making. Each verb plans from where the last one ended."""

    def __init__(self, planner: Planner, situation: Situation) -> None:
        self._planner = planner
        self._now = situation
        self._motions: list[Motion] = []

    def plan(self) -> StepPlan:
        """What was drafted."""
        return StepPlan(motions=tuple(self._motions), end=self._now)

    def with_body(self, name: str, X_WO: Transform) -> Situation:
        """The present situation, with one body put elsewhere."""
        index = self._planner.scene.movable.index(self._planner.scene.body(name))
        bodies = list(self._now.bodies)
        bodies[index] = X_WO
        return replace(self._now, bodies=tuple(bodies))

    def joints(self, label: str, names: Sequence[str], target: Sequence[float], *, speed: float = 1.0) -> None:
        """Straight in joint space; joints of the hand are moved by their own controller at the same time."""
        hand = self._planner.gripper_joints
        arm_names = tuple(name for name in names if name not in hand)
        values = dict(zip(names, target, strict=True))
        trajectory = self._rest_to_rest(arm_names, [values[name] for name in arm_names], speed) if arm_names else None
        grip = self._grip({name: values[name] for name in names if name in hand})
        self._add(label, trajectory, grip, allowed=NOTHING)

    def reach(self, label: str, X_WT: Transform, *, speed: float = 1.0, hand: str | None = None) -> None:
        """The tool to a pose, straight in joint space; the hand goes to its pose `hand` meanwhile."""
        solver = self._planner.solver
        goal = solver.solve(X_WT, self._now.position, self._planner.rng)
        trajectory = self._rest_to_rest(solver.joints, goal[list(solver.columns)], speed)
        grip = None
        if hand is not None:
            pose = self._planner.robot.pose(hand)
            grip = self._grip(dict(zip(pose.joints, pose.positions, strict=True)))
        self._add(label, trajectory, grip, allowed=NOTHING)

    def straight(self, label: str, X_WT: Transform, *, speed: float = 1.0, allowed: Pairs = NOTHING) -> None:
        """The tool on a straight line to a pose."""
        path = linear_path(self._planner.solver, self._now.position, X_WT)
        self._along(label, path, speed, allowed)

    def turn(self, label: str, axis: Array, angle: float, *, speed: float = 1.0, allowed: Pairs = NOTHING) -> None:
        """The tool turns in place about an `axis` (3,) of the world by `angle` [rad], which may exceed half a turn."""
        X_WT = self._planner.tool_pose(self._now)
        count = max(2, int(np.ceil(abs(angle) / ANGULAR_STEP)))
        poses = [
            Transform.of(xyz=X_WT.p, R=matrix_from_axis_angle(axis, k / count * angle) @ X_WT.R)
            for k in range(count + 1)
        ]
        self._along(label, follow_poses(self._planner.solver, self._now.position, poses), speed, allowed)

    def follow(
        self,
        label: str,
        names: Sequence[str],
        *,
        times: Array,
        positions: Array,
        velocities: Array | None,
        accelerations: Array | None,
    ) -> None:
        """Given points, after the present position as their start."""
        columns = self._planner.robot.indices(tuple(names))
        start = self._now.position[columns]
        if times[0] > 0.0:
            times = np.concatenate(([0.0], times))
            positions = np.vstack((start, positions))
            still = np.zeros((1, len(names)))
            velocities = None if velocities is None else np.vstack((still, velocities))
            accelerations = None if accelerations is None else np.vstack((still, accelerations))
        points = JointTrajectory(
            names=tuple(names), times=frozen(times), positions=frozen(positions),
            velocities=velocities, accelerations=accelerations,
        )  # fmt: skip
        ticks = round(points.duration / self._planner.period)
        dense = np.minimum(np.arange(ticks + 1) * self._planner.period, points.duration)
        q, v, a = points.sample(dense)
        curved = velocities is not None
        trajectory = JointTrajectory(
            names=points.names, times=dense, positions=q, velocities=v, accelerations=a if curved else None
        )
        limits = MotionLimits.of(self._planner.robot, names)
        if not curved:
            limits = replace(limits, acceleration=np.full(len(names), np.inf), jerk=np.full(len(names), np.inf))
        verify(trajectory, limits)
        self._add(label, trajectory, None, allowed=NOTHING)

    def close(self, posture: str, *, force: float, must_hold: bool, body: str | None) -> None:
        """The hand towards a posture until each finger meets `force` [N]; `body` is held from then on."""
        pose = self._planner.robot.pose(posture)
        grip = self._grip(dict(zip(pose.joints, pose.positions, strict=True)), force=force, must_hold=must_hold)
        if grip is None:
            raise NotPlannable(f"pose '{posture}' has no joint that a gripper controller moves")
        self._motions.append(Motion("close", trajectory=None, grip=grip, duration=self._grip_time(grip)))
        if body is not None:
            link = self._planner.tool_link
            X_WL = self._planner.kinematics.forward(self._now.position, link)
            X_LO = X_WL.inverse() @ self._planner.body_pose(self._now, body)
            self._now = replace(self._now, carried=Carried(body=body, link=link, X_LO=X_LO))

    def open(self, posture: str) -> None:
        """The hand to a pose; what it held stays where it is."""
        pose = self._planner.robot.pose(posture)
        grip = self._grip(dict(zip(pose.joints, pose.positions, strict=True)))
        self._now = replace(self._now, carried=None)
        if grip is not None:
            self._motions.append(Motion("open", trajectory=None, grip=grip, duration=self._grip_time(grip)))
            self._now = self._now.moved(self._with(grip.joints, grip.target))

    def dwell(self, label: str, duration: float, *, awaits: bool = False) -> None:
        """Hold still for `duration` [s]."""
        self._motions.append(Motion(label, trajectory=None, grip=None, duration=duration, awaits=awaits))

    def _rest_to_rest(self, names: Sequence[str], target: npt.ArrayLike, speed: float) -> JointTrajectory:
        limits = MotionLimits.of(self._planner.robot, names, velocity_scale=speed, acceleration_scale=speed)
        start = self._now.position[self._planner.robot.indices(tuple(names))]
        trajectory = rest_to_rest(start, target, limits, period=self._planner.period)
        verify(trajectory, limits)
        return trajectory

    def _along(self, label: str, path: JointPath, speed: float, allowed: Pairs) -> None:
        limits = MotionLimits.of(self._planner.robot, path.names, velocity_scale=speed, acceleration_scale=speed)
        trajectory = retime(joint_path(path.names, path.waypoints), limits, period=self._planner.period)
        verify(trajectory, limits)
        self._add(label, trajectory, None, allowed=allowed)

    def _add(self, label: str, trajectory: JointTrajectory | None, grip: Grip | None, *, allowed: Pairs) -> None:
        """Accept a motion if nothing is in its way."""
        before = self._now
        if grip is not None:
            self._now = self._now.moved(self._with(grip.joints, grip.target))
        duration = 0.0 if grip is None else self._grip_time(grip)
        if trajectory is not None:
            duration = max(duration, trajectory.duration)
            self._refuse_collision(label, before, trajectory, allowed)
            self._now = self._carry(self._now.moved(self._with(trajectory.names, trajectory.positions[-1])))
        self._motions.append(Motion(label, trajectory=trajectory, grip=grip, duration=duration))

    def _refuse_collision(self, label: str, before: Situation, trajectory: JointTrajectory, allowed: Pairs) -> None:
        there = self._planner.checker.at(
            before.bodies, carried=before.carried, ignore=allowed, margin=CLEARANCE
        )
        columns = self._planner.robot.indices(trajectory.names)
        hit = there.check_trajectory(columns, before.position, trajectory.times, trajectory.positions)
        if hit is not None:
            raise NotPlannable(
                f"'{hit.a}' would come within {1000 * CLEARANCE:.0f} mm of '{hit.b}' ({_gap(hit.distance)}) "
                f"at t = {hit.time:.2f} s of '{label}'"
            )

    def _carry(self, situation: Situation) -> Situation:
        """What is held goes with the hand."""
        carried = situation.carried
        if carried is None:
            return situation
        X_WO = self._planner.kinematics.forward(situation.position, carried.link) @ carried.X_LO
        self._now = situation
        return self.with_body(carried.body, X_WO)

    def _with(self, names: Sequence[str], values: npt.ArrayLike) -> Array:
        """The present position with some joints elsewhere; joints that mimic them follow."""
        robot = self._planner.robot
        q = np.array(self._now.position)
        q[robot.indices(tuple(names))] = values
        for k, joint in enumerate(robot.moving_joints):
            if joint.mimic is not None:
                driver = q[robot.joint_names.index(joint.mimic.joint)]
                q[k] = joint.mimic.multiplier * driver + joint.mimic.offset
        return frozen(q)

    def _grip(self, targets: dict[str, float], *, force: float | None = None, must_hold: bool = False) -> Grip | None:
        """A goal for the joints that a gripper controller moves, or None where there is none."""
        joints = self._planner.gripper_joints
        if not any(name in targets for name in joints):
            return None
        here = dict(zip(joints, self._now.position[self._planner.robot.indices(joints)], strict=True))
        target = frozen([targets.get(name, here[name]) for name in joints])
        return Grip(joints=joints, target=target, force=force, must_hold=must_hold)

    def _grip_time(self, grip: Grip) -> float:
        """How long the references take to the target [s]."""
        here = self._now.position[self._planner.robot.indices(grip.joints)]
        return float(np.max(np.abs(grip.target - here))) / self._planner.gripper_speed


def _gap(distance: float) -> str:
    return f"{1000 * distance:.1f} mm apart" if distance >= 0.0 else f"{-1000 * distance:.1f} mm into it"


def _joints_above(robot: RobotModel, link: str) -> list[str]:
    """Independent joints from the root to `link`, in that order."""
    by_child = {joint.child: joint for joint in robot.joints}
    found = []
    while link in by_child:
        joint = by_child[link]
        if joint.independent:
            found.append(joint.name)
        link = joint.parent
    return found[::-1]
