"""What counts as elsewhere, and what is planned then: a world that stands where the test puts it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.collision import Carried
from manipcli.model.grasp import MISPLACED
from manipcli.model.state import Contact
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.planner import Planner
from manipcli.run import replan
from manipcli.run.belief import Belief
from manipcli.run.execute import build_manager
from manipcli.run.replan import COMMANDED, Measured, after
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines.kinematic import KinematicEngine
from manipcli.simulate.measured_joints import MeasuredJoints
from manipcli.simulate.session import Session
from manipcli.spec.reactions import ReplanSpec
from manipcli.spec.step import StepSpec
from manipcli.task.load_task import load_task
from manipcli.task.plan_steps import plan_step
from manipcli.task.plan_task import Plan, plan_task
from manipcli.task.task import Task

ROOT = Path(__file__).parents[2]
PICK, LIFT, PLACE, MOVE = range(4)


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory) -> Task:
    """A block is carried; a ball lies in a tray beside it, and a brick on the table."""
    file = tmp_path_factory.mktemp("replan") / "task.yaml"
    text = (ROOT / "tasks" / "pick_place.yaml").read_text(encoding="utf-8").replace("../", f"{ROOT}/")
    more = (
        "  tray: {tray: {size: [0.2, 0.2, 0.05]}, rests_on: table, at: [0.75, -0.2], fixed: true}\n"
        "  ball: {sphere: {radius: 1 cm}, mass: 10 g, inside: tray}\n"
        "  brick: {box: {size: [4 cm, 4 cm, 4 cm]}, mass: 50 g, rests_on: table, at: [0.7, 0.3]}\nsteps:\n"
    )
    file.write_text(text.replace("steps:\n", more), encoding="utf-8")
    return load_task(file)


@pytest.fixture(scope="module")
def plan(task: Task) -> Plan:
    return plan_task(task)


@dataclass
class World:
    """What is measured, and what the run believes; the test writes both."""

    task: Task
    plan: Plan
    session: Session
    measured: Measured

    def stand(self, situation: PlanningState) -> None:
        """Everything is as predicted."""
        state = self.session.engine.read()
        state.position[:] = situation.position
        for k, X_WO in enumerate(situation.bodies):
            self.put(k, X_WO)

    def put(self, body: int | str, X_WO: Transform) -> None:
        names = [one.name for one in self.task.scene.movable]
        k = names.index(body) if isinstance(body, str) else body
        state = self.session.engine.read()
        state.body_position[k], state.body_quat_xyzw[k] = X_WO.p, X_WO.quat_xyzw

    def before(self, step: int) -> PlanningState:
        return self.plan.start if step == 0 else self.plan.steps[step - 1].plan.end

    def told(self, step: int) -> tuple[str, ...]:
        """What is elsewhere when this step begins."""
        planned = self.before(step)
        return self.measured.differences(planned, self.measured.situation(planned), self.task.spec.steps[step])


WorldOf = Callable[[int], World]


@pytest.fixture
def world_at(task: Task, plan: Plan) -> WorldOf:
    """The world as it was planned to be when a step begins."""

    def made(step: int) -> World:
        engine = KinematicEngine(task.robot, task.scene, EngineSettings(0.001, 1, plan.start.position))
        session = Session(
            robot=task.robot, scene=task.scene, engine=engine, manager=build_manager(task, plan.planner.kinematics),
            period=0.001,
        )  # fmt: skip
        session._touching = (Contact("block", "robot/panda_leftfinger", 5.0, 0.0),)
        belief = Belief(task.scene, task.scene, plan.planner.kinematics)
        measured = Measured(session, plan.planner, ReplanSpec(), physics=True, belief=belief)
        world = World(task, plan, session, measured)
        world.stand(world.before(step))
        return world

    return made


def shifted(X: Transform, x: float = 0.0, turn: float = 0.0) -> Transform:
    return Transform.of(xyz=X.p + np.array([x, 0.0, 0.0]), R=Transform.of(rpy=(0.0, 0.0, turn)).R @ X.R)


@pytest.mark.parametrize("step", [PICK, LIFT, PLACE, MOVE])
def test_where_all_is_as_planned_nothing_is_told_and_the_situation_is_the_planned_one(
    world_at: WorldOf, step: int
) -> None:
    world = world_at(step)
    assert world.told(step) == ()
    planned = world.before(step)
    now = world.measured.situation(planned)
    assert np.array_equal(now.position, planned.position)
    for here, there in zip(now.bodies, planned.bodies, strict=True):
        np.testing.assert_allclose(here.matrix, there.matrix, atol=1e-12)
    assert (now.carried is None) == (planned.carried is None)


def test_the_joints_of_the_situation_are_those_that_sensors_measure(world_at: WorldOf) -> None:
    """Not the true ones, from the first tick on: encoders with an offset shift the arm and what it carries."""
    world = world_at(LIFT)
    planned, sensors = world.before(LIFT), world.session.sensors
    sensors.joints = MeasuredJoints(len(planned.position))
    assert np.array_equal(world.measured.situation(planned).position, planned.position)
    offset = np.zeros(len(planned.position))
    offset[3] = 0.05
    sensors.joints.update(world.session.engine.read())
    sensors.joints.position[:] = planned.position + offset
    now = world.measured.situation(planned)
    np.testing.assert_allclose(now.position, planned.position + offset, atol=1e-12)
    assert now.carried is not None
    X_WL = world.plan.planner.kinematics.forward(now.position, now.carried.link)
    np.testing.assert_allclose((X_WL @ now.carried.X_LO).matrix, planned.bodies[0].matrix, atol=1e-9)


@pytest.mark.parametrize(("x", "turn"), [(0.0049, 0.0), (0.0, math.radians(1.9))])
def test_what_is_within_the_tolerance_does_not_count(world_at: WorldOf, x: float, turn: float) -> None:
    world = world_at(PICK)
    world.put("block", shifted(world.before(PICK).bodies[0], x, turn))
    assert world.told(PICK) == ()


@pytest.mark.parametrize(
    ("x", "turn", "text"),
    [
        (0.1, 0.0, "'block' is 100.0 mm and 0.0 deg from its planned pose"),
        (0.0, 0.3, "'block' is 0.0 mm and 17.2 deg from its planned pose"),
    ],
)
def test_an_object_that_moved_is_told_and_picked_where_it_is(
    world_at: WorldOf, x: float, turn: float, text: str
) -> None:
    world = world_at(PICK)
    moved = shifted(world.before(PICK).bodies[0], x, turn)
    world.put("block", moved)
    assert world.told(PICK) == (text,)
    now = world.measured.situation(world.before(PICK))
    again = plan_step(world.plan.planner, world.task.spec.steps[PICK], now)
    tool = world.plan.planner.tool_pose(again.end)
    np.testing.assert_allclose(tool.p[:2], moved.p[:2], atol=1e-4)


def test_what_lies_in_its_container_counts_for_nobody_else(world_at: WorldOf) -> None:
    """The ball rolls in the tray; out of it, and it counts; so does a brick that nobody names."""
    world = world_at(PICK)
    ball, brick = world.before(PICK).bodies[1:]
    world.put("ball", shifted(ball, 0.05))
    assert world.told(PICK) == ()
    world.put("ball", shifted(ball, 0.15))
    assert [one.split(" is ")[0] for one in world.told(PICK)] == ["'ball'"]
    world.put("ball", ball)
    world.put("brick", shifted(brick, 0.02))
    assert [one.split(" is ")[0] for one in world.told(PICK)] == ["'brick'"]


def test_what_slipped_in_the_hand_is_put_down_where_it_belongs(world_at: WorldOf) -> None:
    """The tool ends where the block, held as it is measured, stands at its goal."""
    world = world_at(PLACE)
    planner = world.plan.planner
    slip = Transform.of(xyz=(0.004, -0.003, 0.0), rpy=(0.0, 0.0, 0.05))
    before = world.before(PLACE)
    world.put("block", before.bodies[0] @ slip)
    assert world.told(PLACE) == ("'block' slipped 5.0 mm and 2.9 deg in the hand",)
    now = world.measured.situation(before)
    held = planner.held_in_tool(now)
    np.testing.assert_allclose(held.matrix, (planner.held_in_tool(before) @ slip).matrix, atol=1e-9)
    again = plan_step(planner, world.task.spec.steps[PLACE], now)
    lowered = next(motion for motion in again.motions if motion.label == "lower")
    assert lowered.trajectory is not None
    q = np.array(now.position)
    q[list(planner.solver.columns)] = lowered.trajectory.positions[-1]
    goal = planner.solver.forward(q) @ held
    np.testing.assert_allclose(goal.p, [0.5, 0.2, 0.225], atol=2e-5)
    assert goal.R[2, 2] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("turn", [0.02, 0.05])
def test_a_turn_in_the_hand_that_cannot_be_undone_is_left_where_it_does_not_count(
    world_at: WorldOf, monkeypatch: pytest.MonkeyPatch, turn: float
) -> None:
    """As for an arm that can only plan with the object turned in the hand as it was planned to be; 2 deg count."""
    world = world_at(PLACE)
    planner, before, step = world.plan.planner, world.before(PLACE), world.task.spec.steps[PLACE]
    world.put("block", before.bodies[0] @ Transform.of(xyz=(0.004, 0.0, 0.0), rpy=(turn, 0.0, 0.0)))
    now = world.measured.situation(before)
    held = before.carried
    assert held is not None

    def few_joints(planner: Planner, step: StepSpec, situation: PlanningState, _: Sequence[Array] = ()) -> StepPlan:
        assert situation.carried is not None
        if not np.allclose(situation.carried.X_LO.R, held.X_LO.R, atol=1e-9):
            raise NotPlannable("the arm has five joints")
        return plan_step(planner, step, situation)

    monkeypatch.setattr(replan, "plan_step", few_joints)
    if turn > ReplanSpec().rotation:
        with pytest.raises(NotPlannable, match="five joints"):
            world.measured.plan(step, before, now)
        return
    again, begins, told = world.measured.plan(step, before, now)
    assert told == "; the arm cannot correct the rotation of 'block' by 1.1 deg in the hand"
    lowered = next(motion for motion in again.motions if motion.label == "lower")
    assert lowered.trajectory is not None
    q = np.array(begins.position)
    q[list(planner.solver.columns)] = lowered.trajectory.positions[-1]
    goal = planner.solver.forward(q) @ planner.held_in_tool(now)  # as it truly sits there
    np.testing.assert_allclose(goal.p, [0.5, 0.2, 0.225], atol=2e-5)
    assert math.acos(goal.R[2, 2]) == pytest.approx(turn, abs=1e-4)


def test_an_object_that_fell_is_no_longer_in_the_hand(world_at: WorldOf) -> None:
    world = world_at(PLACE)
    before = world.before(PLACE)
    world.put("block", shifted(before.bodies[0], MISPLACED + 0.02))
    assert world.told(PLACE) == ("'block' is not in the hand: it is 70.0 mm from its planned pose in the hand",)
    assert world.measured.situation(before).carried is None


def test_a_trajectory_begins_at_what_is_commanded_and_not_at_the_error_of_the_controller(world_at: WorldOf) -> None:
    world = world_at(MOVE)
    planned = world.before(MOVE).position
    joint = world.task.robot.joint_names.index("panda_joint4")
    world.session.tick()  # the controllers hold where they are
    world.stand(world.before(MOVE))
    world.session.engine.read().position[joint] += 0.02  # it sags
    now = world.measured.situation(world.before(MOVE))
    assert abs(now.position[joint] - planned[joint]) < COMMANDED
    assert world.told(MOVE) == ()
    world.session.engine.read().position[joint] += 0.08  # it was pushed away
    told = world.told(MOVE)
    assert told == (f"joint 'panda_joint4' is at {planned[joint] + 0.1:.4f} rad instead of {planned[joint]:.4f} rad",)


def test_a_joint_beyond_a_soft_limit_is_where_it_is_and_one_beyond_a_hard_limit_is_at_it(world_at: WorldOf) -> None:
    """The Panda's description says 2.9671 rad, and of its safety_controller 2.8973."""
    world = world_at(PICK)
    joint = world.task.robot.joint_names.index("panda_joint1")
    for there, found in ((2.93, 2.93), (2.99, 2.9671)):
        world.session.engine.read().position[joint] = there
        assert world.measured.situation(world.before(PICK)).position[joint] == found


def test_without_physics_bodies_are_where_they_were_predicted(world_at: WorldOf) -> None:
    world = world_at(PLACE)
    before = world.before(PLACE)
    world.put("block", shifted(before.bodies[0], 1.0))
    belief = Belief(world.task.scene, world.task.scene, world.plan.planner.kinematics)
    measured = Measured(world.session, world.plan.planner, ReplanSpec(), physics=False, belief=belief)
    assert measured.differences(before, measured.situation(before), world.task.spec.steps[PLACE]) == ()


def test_what_the_hand_holds_follows_from_the_motions_that_were_done(plan: Plan) -> None:
    pick, place = plan.steps[PICK].plan, plan.steps[PLACE].plan
    close = next(k for k, motion in enumerate(pick.motions) if motion.label == "close")
    held = cast(Carried, pick.end.carried)
    assert [after(pick, plan.start, done=k).carried for k in (close - 1, close)] == [None, None]
    assert after(pick, plan.start, done=close).closed
    assert after(pick, plan.start, done=close + 1).carried == held
    lifted = plan.steps[LIFT].plan.end
    opened = next(k for k, motion in enumerate(place.motions) if motion.label == "open")
    assert after(place, lifted, done=opened - 1).carried == lifted.carried
    for done in (opened, opened + 1):
        assert after(place, lifted, done=done) == replace(lifted, carried=None, closed=False)
