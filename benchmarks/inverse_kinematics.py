"""python -m benchmarks.inverse_kinematics [--poses N]: success and time of the inverse kinematics, beside Pink.

Random joint positions inside the limits give the poses, so that each can be reached. Every pose starts from the robot's
`home`, and from the middle between `home` and the solution for the second row, as a step that continues a motion. A
pose is solved where the forward kinematics is within 0.1 mm and 1 mrad of it and every joint within its limits; the
oracle for that is Pinocchio with its own placements, not the solver's errors. Pink (pip install pin-pink daqp) gets the
same poses, seeds, restarts and tolerances, a QP with its default limits per iteration, at most 100 of them per attempt;
where it is not installed, its rows are left out with a note.
"""

from __future__ import annotations

import argparse
import importlib.util
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.table import Row, markdown
from benchmarks.twin import clock
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.configuration import configuration, position_limits
from manipcli.model.kinematics import Kinematics
from manipcli.plan.claimed_joints import Claims, arm_joints
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.pose_error import rotation_vector
from manipcli.task.load_task import load_task

ROOT: Final = Path(__file__).parents[1]
TASKS: Final = {
    "arm7_hand3": ROOT / "tasks/pour.yaml",
    "Panda": ROOT / "tasks/pick_place.yaml",
    "iiwa": ROOT / "tasks/pour_iiwa.yaml",
}
POSITION, ANGLE = 1e-4, 1e-3
"""[m] and [rad] Tolerances of a solved pose."""
SOLVED: Final = 99.8
"""[%] Least share of solved poses."""
LONGEST: Final = 0.3
"""[ms] Most median time."""
RESTARTS: Final = 40
PINK_ITERATIONS: Final = 100


@dataclass(frozen=True)
class Problem:
    """A robot, its solver, and the poses to reach. `seeds`, `arms`: (k, n) and (k, m), `goals`: X_WT of `arms`."""

    robot: str
    solver: InverseKinematics
    kinematics: Kinematics
    seed: Array
    arms: Array
    goals: tuple[Transform, ...]


def problem(robot: str, count: int) -> Problem:
    """`count` random poses of a robot."""
    task = load_task(TASKS[robot])
    model = task.robot
    kinematics = Kinematics(model)
    assert model.tool is not None
    joints = arm_joints(model, Claims.of(task.controllers).hand)
    solver = InverseKinematics(kinematics, joints, model.tool.link, X_LT=model.tool.X_LT)
    seed = configuration(model, "home")
    lower, upper = position_limits(model.joint(name) for name in joints)
    arms = np.random.default_rng(19).uniform(lower, upper, (count, len(joints)))
    goals = []
    for arm in arms:
        q = seed.copy()
        q[list(solver.columns)] = arm
        goals.append(solver.forward(q))
    return Problem(robot, solver, kinematics, seed, arms, tuple(goals))


def reached(given: Problem, goal: Transform, q: Array | None) -> bool:
    """Whether the tool is at `goal` with the joints at `q`, and all are within their limits."""
    if q is None:
        return False
    model = given.kinematics.robot
    lower, upper = position_limits(model.joint(name) for name in given.solver.joints)
    arm = q[list(given.solver.columns)]
    X_WT = given.solver.forward(q)
    off = float(np.linalg.norm(X_WT.p - goal.p)), float(np.linalg.norm(rotation_vector(goal.R @ X_WT.R.T)))
    return off[0] <= POSITION and off[1] <= ANGLE and bool(((arm >= lower - 1e-9) & (arm <= upper + 1e-9)).all())


Solve = Callable[[Transform, Array, np.random.Generator], "Array | None"]


def ours(given: Problem) -> Solve:
    """The planner's own solver."""

    def solve(goal: Transform, seed: Array, rng: np.random.Generator) -> Array | None:
        try:
            return given.solver.solve(goal, seed, rng)
        except NotPlannable:
            return None

    return solve


def pinks(given: Problem) -> Solve:
    """Pink's differential inverse kinematics, iterated, with restarts as ours."""
    import pink  # type: ignore[import-not-found, unused-ignore]
    from pink.tasks import FrameTask  # type: ignore[import-not-found, unused-ignore]

    model = given.kinematics.model
    tool = given.kinematics.robot.tool
    assert tool is not None
    se3 = given.kinematics._se3
    lower, upper = position_limits(given.kinematics.robot.joint(name) for name in given.solver.joints)
    columns = list(given.solver.columns)
    moving = given.kinematics.robot.moving_joints
    model.lowerPositionLimit, model.upperPositionLimit = (np.array(x) for x in position_limits(moving))
    model.velocityLimit = np.full(model.nv, 1e3)

    data = model.createData()
    held = np.setdiff1d(np.arange(model.nv), columns)

    def attempt(task: FrameTask, start: Array) -> Array | None:
        now = pink.Configuration(model, data, start, copy_data=False)
        for _ in range(PINK_ITERATIONS):
            error = task.compute_error(now)
            if np.linalg.norm(error[:3]) <= 0.9 * POSITION and np.linalg.norm(error[3:]) <= 0.9 * ANGLE:
                return np.array(now.q)
            velocity = pink.solve_ik(now, [task], 1.0, solver="daqp", safety_break=False)
            velocity[held] = 0.0
            now.integrate_inplace(velocity, 1.0)
        return None

    def solve(goal: Transform, seed: Array, rng: np.random.Generator) -> Array | None:
        task = FrameTask(tool.link, position_cost=1.0, orientation_cost=1.0, lm_damping=1e-3)
        task.set_target(se3(goal @ tool.X_LT.inverse()))
        start = seed
        for _ in range(1 + RESTARTS):
            found = attempt(task, start)
            if found is not None:
                return found
            start = seed.copy()
            start[columns] = rng.uniform(lower, upper)
        return None

    return solve


def measured(given: Problem, solve: Solve, seeds: list[Array]) -> tuple[float, tuple[float, ...]]:
    """The share [%] of poses solved from their seeds, and the time [ms] of each."""
    rng = np.random.default_rng(0)
    solved, spent = 0, []
    for goal, seed in zip(given.goals, seeds, strict=True):
        began = clock()
        q = solve(goal, seed, rng)
        spent.append(1e3 * (clock() - began))
        solved += reached(given, goal, q)
    return 100.0 * solved / len(given.goals), tuple(spent)


def rows(count: int, peers: dict[str, Callable[[Problem], Solve]]) -> list[Row]:
    """The table of all robots and solvers."""
    found = []
    for robot in TASKS:
        given = problem(robot, count)
        home = [given.seed] * count
        near = []
        for arm in given.arms:
            q = given.seed.copy()
            columns = list(given.solver.columns)
            q[columns] = arm + 0.1 * (q[columns] - arm)
            near.append(q)
        for name, peer in peers.items():
            own = name == "manipcli"
            for start, seeds in (("from home", home), ("from a tenth of the way off", near)):
                share, spent = measured(given, peer(given), seeds)
                what = f"{robot}, {start}: {name}"
                missed = Row(f"{what}, not solved", (100.0 - share,), "%", 100.0 - SOLVED + 1e-9 if own else None)
                rounded = Row(what, (statistics.median(spent),), "ms", LONGEST if own else None, _tail(spent))
                found += [missed, rounded]
    return found


def _tail(spent: tuple[float, ...]) -> str:
    return f"mean {statistics.fmean(spent):.2f} ms, 95th percentile {sorted(spent)[int(0.95 * len(spent))]:.2f} ms"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.inverse_kinematics", description=__doc__)
    parser.add_argument("--poses", type=int, default=500, help="per robot (default 500)")
    options = parser.parse_args()
    peers: dict[str, Callable[[Problem], Solve]] = {"manipcli": ours}
    if importlib.util.find_spec("pink") is None:
        print("Pink is not installed: its rows are left out (pip install pin-pink daqp)\n")
    else:
        peers["Pink"] = pinks
    print(markdown(rows(options.poses, peers)))


if __name__ == "__main__":
    main()
