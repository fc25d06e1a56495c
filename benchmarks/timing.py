"""Timing of paths under torque limits: `python -m benchmarks.timing [--sets N]`.

Random waypoints of three arms, with effort limits that leave little beside the load at rest. Checked are

- every limit at 1 kHz: joint velocity and acceleration by finite differences of the positions, torque by Pinocchio's
  recursive Newton-Euler algorithm on a model of the normalised URDF, built by Pinocchio itself;
- the duration against TOPP-RA with its own torque constraint at 1000 grid points.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import pinocchio
import toppra

from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.plan.motion import PlanningState
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.planner import Planner
from manipcli.plan.retimer import retime
from manipcli.plan.timing_bounds.torque import TorqueBound
from manipcli.plan.trajectory import JointTrajectory
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position

ROOT: Final = Path(__file__).parents[1]
TASKS: Final = "tasks/pour.yaml", "tasks/pour_iiwa.yaml", "tasks/pick_place.yaml"
PERIOD: Final = 1e-3
ROOM: Final = 1.25
"""Effort limits over the largest load at rest of the waypoints."""
LEAST: Final = 0.03
"""Least effort limit, as a share of the robot's."""
WAYPOINTS: Final = 5
GRID: Final = 1000


class Measured(NamedTuple):
    """Of one set: the largest value over its limit of each kind, the durations [s], and whether torque binds."""

    velocity: float
    acceleration: float
    torque: float
    duration: float
    optimal: float
    binds: bool


class Arm:
    """An arm with an oracle of its dynamics."""

    def __init__(self, task: str) -> None:
        loaded = load_task(ROOT / task)
        joints = tuple(replace(joint, damping=0.0) for joint in loaded.robot.joints)  # TOPP-RA knows dry friction only
        self.robot: RobotModel = replace(loaded.robot, joints=joints)
        hand = next((c.joints for c in loaded.controllers.controllers.values() if c.type == "gripper"), ())
        self.planner = Planner(
            self.robot, loaded.scene, period=PERIOD, rng=np.random.default_rng(0), gripper_joints=tuple(hand),
            gripper_speed=1.0,
        )  # fmt: skip
        self.state = PlanningState(start_position(loaded), tuple(body.X_WO for body in loaded.scene.movable))
        self.names = self.planner.solver.joints
        limits = MotionLimits.of(self.robot, self.names)
        self.limits = replace(limits, jerk=np.full(len(self.names), np.inf), acceleration=4.0 * limits.acceleration)
        self._model = pinocchio.buildModelFromXML(self.robot.urdf)
        self._model.gravity.linear = self.robot.X_WB.R.T @ loaded.scene.gravity
        self._data = self._model.createData()
        self._at = [self._model.joints[self._model.getJointId(name)].idx_v for name in self.robot.joint_names]
        self._armature = np.asarray(self.planner.kinematics.model.armature)

    def torque(self, q: Array, v: Array, a: Array) -> Array:
        """(n) of the path's joints, by the oracle."""
        columns = self.robot.indices(self.names)
        whole = [np.array(self.state.position), np.zeros(self._model.nv), np.zeros(self._model.nv)]
        for into, values in zip(whole, (q, v, a), strict=True):
            into[columns] = values
        ordered = [np.zeros(self._model.nv) for _ in whole]
        for into, values in zip(ordered, whole, strict=True):
            into[self._at] = values
        tau = np.array(pinocchio.rnea(self._model, self._data, *ordered))[self._at] + self._armature * whole[2]
        return np.asarray(tau[columns])


def measure(arm: Arm, rng: np.random.Generator) -> Measured:
    """One random set of waypoints."""
    limits, n = arm.limits, len(arm.names)
    span = np.minimum(0.7 * (limits.upper - limits.lower), 4.0)
    points = 0.5 * (limits.upper + limits.lower) + span * (rng.uniform(size=(WAYPOINTS, n)) - 0.5)
    chords = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    spline = toppra.SplineInterpolator(chords, points)
    zero = np.zeros(n)
    load = np.max([np.abs(arm.torque(q, zero, zero)) for q in spline(np.linspace(0.0, chords[-1], 200))], axis=0)
    most = np.array([arm.robot.joint(name).limits.effort or np.inf for name in arm.names])
    effort = np.minimum(np.maximum(ROOM * load, LEAST * most), most)
    robot = _limited(arm.robot, dict(zip(arm.names, effort.tolist(), strict=True)))
    bound = TorqueBound(robot, PathDynamics(arm.planner, arm.state, arm.names), arm.names, points)
    motion = retime(points, limits, period=PERIOD, bounds=[bound])
    without = retime(points, limits, period=PERIOD)
    velocity, acceleration, torque = _peaks(arm, motion, effort)
    return Measured(
        velocity, acceleration, torque, motion.duration, _optimal(arm, spline, chords[-1], effort),
        motion.duration > 1.001 * without.duration,
    )  # fmt: skip


def _limited(robot: RobotModel, effort: dict[str, float]) -> RobotModel:
    joints = [
        replace(joint, limits=replace(joint.limits, effort=effort.get(joint.name, joint.limits.effort)))
        for joint in robot.joints
    ]
    return replace(robot, joints=tuple(joints))


def _peaks(arm: Arm, motion: JointTrajectory, effort: Array) -> tuple[float, float, float]:
    q, v, a = motion.positions, motion.velocities, motion.accelerations
    assert v is not None and a is not None
    rate = np.abs(np.diff(q, axis=0)) / PERIOD
    change = np.abs(np.diff(q, 2, axis=0)) / PERIOD**2
    torque = max(float((np.abs(arm.torque(*instant)) / effort).max()) for instant in zip(q, v, a, strict=True))
    limits = arm.limits
    return float((rate / limits.velocity).max()), float((change / limits.acceleration).max()), torque


def _optimal(arm: Arm, spline: object, length: float, effort: Array) -> float:
    """Duration [s] by TOPP-RA's own torque constraint at 1000 grid points."""
    scheme = toppra.constraint.DiscretizationType.Interpolation
    limits = arm.limits
    constraints = [
        toppra.constraint.JointVelocityConstraint(np.column_stack((-limits.velocity, limits.velocity))),
        toppra.constraint.JointAccelerationConstraint(
            np.column_stack((-limits.acceleration, limits.acceleration)), discretization_scheme=scheme
        ),
        toppra.constraint.JointTorqueConstraint(
            arm.torque, np.column_stack((-effort, effort)), np.zeros(len(effort)), discretization_scheme=scheme
        ),
    ]
    grid = np.linspace(0.0, length, GRID + 1)
    solver = toppra.algorithm.TOPPRA(constraints, spline, gridpoints=grid, solver_wrapper="seidel")
    _, speeds, _ = solver.compute_parameterization(0.0, 0.0)
    return float(np.sum(2.0 * np.diff(grid) / (speeds[1:] + speeds[:-1])))


def main() -> None:
    """Print one row per arm."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.timing", description=__doc__.split("\n")[0])
    parser.add_argument("--sets", type=int, default=100, help="of random waypoints, over all arms [default: 100]")
    sets = parser.parse_args().sets
    print("arm | sets | torque binds | velocity | acceleration | torque | duration / optimal: median, largest")
    for k, task in enumerate(TASKS):
        arm, rng = Arm(task), np.random.default_rng(k)
        found = [measure(arm, rng) for _ in range(len(range(k, sets, len(TASKS))))]
        worst = [max(each) for each in zip(*(one[:3] for one in found), strict=True)]
        ratios = np.array([one.duration / one.optimal for one in found])
        row = [arm.robot.name, str(len(found)), str(sum(one.binds for one in found)), *(f"{x:.4f}" for x in worst)]
        print(" | ".join([*row, f"{np.median(ratios):.4f}, {ratios.max():.4f}"]), flush=True)


if __name__ == "__main__":
    main()
