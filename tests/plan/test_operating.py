"""Laws of moving a joint of the scene by hand: the tool's path, the wrench, what moves along, the grasp frames."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from functools import cache, partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manipcli.control.controllers.gripper import GripperSpec
from manipcli.core.errors import InvalidInput, NotPlannable
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.model.grasp import friction_coefficient
from manipcli.model.motor_limits import EffortLimits
from manipcli.plan.aboard import aboard
from manipcli.plan.arm_force import refuse_weak
from manipcli.plan.hand import closing_speed
from manipcli.plan.handle_frames import handle_frames
from manipcli.plan.jointed import (
    along,
    does_not_stay,
    moved_to,
    needed,
    position_of,
    stays_from,
    tool_twist,
    weight,
    wrench_of,
)
from manipcli.plan.motion import JointGoal, PlanningState
from manipcli.plan.operating import ALONG, RESERVE, Handling, compliance, refuse_force
from manipcli.plan.planner import Planner
from manipcli.plan.steps import STEPS
from manipcli.plan.steps.jointed_goal import moved_joint
from manipcli.scene.joints import SceneJoint
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position
from manipcli.task.task import Task

ROOT = Path(__file__).parents[2]
HEAD = f"""\
task: t
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
start: home
scene:
  desk: {{box: {{size: [1.0, 1.2, 0.1]}}, pose: {{xyz: [0.9, 0, 0.05]}}, fixed: true}}
"""
THINGS = f"""\
  drawer: {{urdf: {{file: {ROOT}/tasks/objects/cabinet.urdf}}, rests_on: desk, at: [0.95, 0], fixed: true}}
  door: {{urdf: {{file: {ROOT}/tasks/objects/door.urdf}}, rests_on: desk, at: [0.6, -0.5], fixed: true}}
  dial: {{urdf: {{file: {ROOT}/tasks/objects/dial.urdf}}, rests_on: desk, at: [0.5, 0.35], fixed: true}}
  ball: {{sphere: {{radius: 14 mm}}, mass: 10 g, inside: drawer/drawer}}
  block: {{box: {{size: [4 cm, 4 cm, 4 cm]}}, mass: 80 g, rests_on: desk, at: [0.45, 0]}}
"""


@cache
def task() -> Task:
    return _loaded(HEAD + THINGS + "steps:\n  - wait: 1 s\n")


def _loaded(text: str) -> Task:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "t.yaml"
        file.write_text(text)
        return load_task(file, allow_outside=True)


def planner_of(task: Task) -> Planner:
    (gripper,) = (spec for spec in task.controllers.controllers.values() if isinstance(spec, GripperSpec))
    return Planner(
        task.robot, task.scene, period=1e-3, rng=np.random.default_rng(1), gripper_joints=gripper.joints,
        gripper_speed=closing_speed(task.robot, gripper.joints, gripper.speed),
    )  # fmt: skip


def start(task: Task) -> PlanningState:
    return PlanningState(start_position(task), tuple(body.X_WO for body in task.scene.movable))


def joint(name: str) -> SceneJoint:
    found = moved_joint(task().scene, name)
    assert found is not None
    return found


TOOL = Transform.of(xyz=(0.5, 0.1, 0.3), R=Rotation.from_euler("xyz", [2.9, 0.3, -0.4]).as_matrix())


@pytest.mark.parametrize(("name", "to"), [("drawer", 0.18), ("door", 1.0), ("dial", 2.5)])
def test_the_tool_moves_as_if_it_were_screwed_to_the_link(name: str, to: float) -> None:
    """By the closed form of a rotation about a line, and of a translation; neighbours are near."""
    planner, state, moving = planner_of(task()), start(task()), joint(name)
    poses = along(planner, state, moving, to, TOOL)
    X_WJ = planner.body_pose(state, moving.parent) @ moving.X_PJ
    axis = X_WJ.R @ moving.axis
    for k, X_WT in enumerate(poses):
        q = to * k / (len(poses) - 1)
        R = np.eye(3) if moving.slides else Rotation.from_rotvec(q * axis).as_matrix()
        p = TOOL.p + q * axis if moving.slides else X_WJ.p + R @ (TOOL.p - X_WJ.p)
        np.testing.assert_allclose(X_WT.p, p, atol=1e-9)
        np.testing.assert_allclose(X_WT.R, R @ TOOL.R, atol=1e-9)
    assert max(np.linalg.norm(b.p - a.p) for a, b in pairwise(poses)) < 0.0051  # as the steps of a straight line


@pytest.mark.parametrize("name", ["drawer", "door", "dial"])
def test_the_power_at_the_tool_is_the_power_at_the_joint(name: str) -> None:
    planner, state, moving = planner_of(task()), start(task()), joint(name)
    on_axis = (planner.body_pose(state, moving.parent) @ moving.X_PJ).p
    for X_WT in (TOOL, Transform.of(xyz=on_axis, R=TOOL.R)):
        twist = tool_twist(planner, state, moving, X_WT)
        assert wrench_of(twist, 1.7) @ twist == pytest.approx(1.7)
    h = 1e-6  # of the finite difference; the path is smooth
    moved = along(planner, state, moving, h, TOOL)[-1]
    np.testing.assert_allclose((moved.p - TOOL.p) / h, tool_twist(planner, state, moving, TOOL)[:3], atol=1e-5)


def test_a_joint_needs_what_resists_it() -> None:
    """Dry friction against the motion, a damper in proportion to it, a spring towards its rest."""
    plain = joint("drawer")
    own = SceneJoint(
        "a/b", "prismatic", "a", "b", plain.X_PJ, plain.axis, 0.0, 1.0,
        damping=4.0, friction=1.5, stiffness=50.0, rest=0.1,
    )  # fmt: skip
    assert needed(own, 0.3, 0.2) == pytest.approx(1.5 + 4.0 * 0.2 + 50.0 * (0.3 - 0.1))
    assert needed(own, 0.3, -0.2) == pytest.approx(-1.5 - 4.0 * 0.2 + 50.0 * (0.3 - 0.1))


def test_a_lid_falls_back_where_its_friction_does_not_hold_its_weight() -> None:
    """Its weight has the effort m g (x cos q + z sin q) with the centre of mass at (x, z) from the hinge."""
    file = f"{ROOT}/tasks/objects/lidded_box.urdf"
    box = f"  box: {{urdf: {{file: {file}}}, rests_on: desk, at: [0.6, 0.1], fixed: true}}\n"
    loaded = _loaded(HEAD + box + "steps:\n  - wait: 1 s\n")
    planner, state, lid = planner_of(loaded), start(loaded), moved_joint(loaded.scene, "box")
    assert lid is not None

    def effort(q: float) -> float:
        x, z = 0.3 * -0.1018 + 0.05 * -0.17, 0.3 * 0.003428 + 0.05 * 0.04
        return 9.81 * (x * float(np.cos(q)) + z * float(np.sin(q)))

    for q in (0.0, 1.0, 1.8):
        assert weight(planner, state, lid, q) == pytest.approx(effort(q))
        assert needed(lid, q, 1e-9, effort(q)) == pytest.approx(lid.friction - effort(q))
    half = JointGoal(lid.name, 1.0, 1.0, 0.05)
    assert "its weight moves it with" in does_not_stay(planner, state, lid, half)
    holds = stays_from(planner, state, lid, half)
    assert holds is not None and effort(holds) == pytest.approx(-lid.friction)  # friction holds it there
    assert f"it stays from {np.degrees(holds):.4g} deg on" in does_not_stay(planner, state, lid, half)
    sprung = replace(lid, stiffness=2.0)
    assert stays_from(planner, state, sprung, half) is None
    firm = replace(lid, friction=1.01 * abs(effort(0.95)))
    assert not does_not_stay(planner, state, firm, half)
    assert not does_not_stay(planner, state, lid, replace(half, position=1.8))  # beyond the vertical it falls open
    assert not does_not_stay(planner, state, lid, JointGoal(lid.name, 0.0, 0.0, 0.05))  # its end stop holds it


def test_the_arm_is_stiff_along_the_path_and_soft_across_it() -> None:
    planner, state, moving = planner_of(task()), start(task()), joint("door")
    twist = tool_twist(planner, state, moving, TOOL)
    law, stiffness = compliance(twist, TOOL)
    assert law.X_TC is not None
    R = (TOOL @ law.X_TC).R
    K = R @ np.diag(law.stiffness[:3]) @ R.T
    path = twist[:3] / np.linalg.norm(twist[:3])
    assert path @ K @ path == pytest.approx(ALONG)
    across = np.linalg.svd(path[None])[2][1:]
    assert (np.abs(across @ K @ path) < 1e-6).all()
    assert max(n @ K @ n for n in across) < ALONG / 5
    # A displacement dq of the joint is one of the tool by the lever: its energy is the same by both stiffnesses.
    assert stiffness == pytest.approx(ALONG * float(twist[:3] @ twist[:3]))


def test_what_is_in_the_drawer_goes_with_it_and_what_is_beside_it_does_not() -> None:
    planner, state, moving = planner_of(task()), start(task()), joint("drawer")
    assert planner.aboard(state, moving.child) == ("ball",)
    after = moved_to(planner, state, moving, 0.1)
    assert position_of(planner, after, moving) == pytest.approx(0.1)
    for name, x in (("ball", -0.1), (moving.child, -0.1), ("block", 0.0), ("door/panel", 0.0)):
        shift = planner.body_pose(after, name).p - planner.body_pose(state, name).p
        np.testing.assert_allclose(shift, (x, 0, 0), atol=1e-12)


def test_a_load_goes_along_only_if_it_rests_on_nothing_else() -> None:
    """The ball is said to touch the panel of the door, and then the desk as well."""
    scene, state = task().scene, start(task())
    panel = state.bodies[scene.movable.index(scene.body("door/panel"))]
    ball = scene.movable.index(scene.body("ball"))
    poses = [panel if k == ball else X for k, X in enumerate(state.bodies)]
    touching: set[tuple[str, str]] = {("ball", "door/panel")}
    found = partial(aboard, scene, "door/panel", poses, lambda _: ())
    pairs: Callable[[str], set[tuple[str, str]]] = lambda name: {pair for pair in touching if name in pair}  # noqa: E731
    assert found(pairs) == ("ball",)
    touching.add(("ball", "desk"))
    assert found(pairs) == ()


@pytest.mark.parametrize("size", [(0.012, 0.13, 0.012), (0.06, 0.016, 0.03), (0.03, 0.03, 0.03)])
def test_a_hand_never_closes_along_a_bar_and_never_comes_through_the_link(size: tuple[float, float, float]) -> None:
    outward = np.array([0.0, 0.0, 1.0])
    X_WP = Transform.of(xyz=(0.5, 0, 0.2))
    frames = list(handle_frames(X_WP, frozen(size), outward, np.eye(3)))
    assert len({tuple(np.round(frame.X_WT.matrix.ravel(), 9)) for frame in frames}) == len(frames)
    long = int(np.argmax(size))
    for frame in frames:
        R = frame.X_WT.R
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) == pytest.approx(1.0)
        assert R[:, 2] @ outward < 0.8
        if size[long] > 0.05:
            assert abs(R[long, 1]) < 1e-9
            assert abs(frame.X_WT.p - X_WP.p)[long] <= size[long] / 4 + 1e-12
    assert frames[0].X_WT.R[:, 2] @ outward == pytest.approx(-1.0)


def test_the_force_that_the_arm_can_give_is_where_a_joint_meets_its_limit() -> None:
    """|g + J^T w| by finite differences of the tool's position: just below the reported share it is accepted."""
    planner, state = planner_of(task()), start(task())
    robot, columns = planner.robot, planner.robot.indices(planner.solver.joints)
    direction, h = np.array([0.6, 0.0, 0.8]), 1e-6

    def place(q: Array) -> Array:
        return planner.tool_pose(state.moved(q)).p

    work = np.array([direction @ (place(state.position + h * e) - place(state.position - h * e)) / (2 * h)
                     for e in np.eye(len(state.position))[list(columns)]])  # fmt: skip
    gravity = np.array(planner.kinematics.gravity(np.array(state.position)))[columns]
    limits = EffortLimits.of(robot).least[columns]
    most = min(
        (limit - np.sign(w) * g) / abs(w) for w, g, limit in zip(work, gravity, limits, strict=True) if abs(w) > 1e-6
    )
    refuse_weak(planner, state.position, np.append(0.999 * most * direction, np.zeros(3)), "pull")
    with pytest.raises(NotPlannable, match=r"pull: the arm can give [\d.]+ N there, not [\d.]+ N: then joint 'panda_"):
        refuse_weak(planner, state.position, np.append(1.001 * most * direction, np.zeros(3)), "pull")


@pytest.mark.parametrize("roll", [0.0, 90.0])
def test_two_fingers_hold_by_friction_what_no_finger_is_behind(roll: float) -> None:
    """By Coulomb's law, with the reserve; a finger behind the handle holds more. The wrist turns y across the path."""
    planner, moving = planner_of(task()), joint("drawer")
    q = np.array(start(task()).position)
    q[planner.robot.joint_names.index("panda_joint7")] -= np.radians(roll)
    state = start(task()).moved(frozen(q))
    along_y = abs(planner.tool_pose(state).R[0, 1])  # the drawer moves along x
    mu = friction_coefficient(planner.robot, planner.scene.body(moving.child))
    goal = JointGoal(moving.name, 0.15, 1.0, 0.005)
    frame = planner.scene.frame("drawer/handle")
    assert frame is not None
    assert min(along_y, 1.0 - along_y) < 0.2
    for factor in (0.99, 1.01):
        force = moving.friction / (2.0 * mu * RESERVE) / factor
        pulled = Handling(moving, frame, goal, "pull", (0.1, 0.1), (0.1, 0.1), "closed", "open", force, 0.3)
        slips = factor > 1.0 and along_y < 0.5
        with pytest.raises(NotPlannable, match="two fingers hold") if slips else nullcontext():
            refuse_force(pulled, planner, state, gripped=True)
        own = pulled.explain(NotPlannable("cannot open 'drawer', all 9 candidates failed: it is far"))
        assert own.cause.startswith(
            "cannot open 'drawer': pull: two fingers hold" if slips else "cannot open 'drawer', all"
        )


@pytest.mark.parametrize(
    ("side", "position", "short"), [(1, 0.14, 0.01), (1, 0.2, -0.05), (-1, 0.2, 0.05), (0, 0.2, 0.05)]
)
def test_a_goal_is_missed_on_its_side(side: float, position: float, short: float) -> None:
    assert JointGoal("a/b", 0.15, side, 0.005).short(position) == pytest.approx(short)


def test_a_joint_that_is_there_already_needs_no_motion() -> None:
    step = STEPS["close"]
    plan = step.plan(step.spec.model_validate({"object": "drawer"}), planner_of(task()), start(task()))
    assert plan.motions == ()
    assert plan.joint is not None


@pytest.mark.parametrize(
    ("step", "code", "text"),
    [
        ("open: {object: door, by: 150 deg}", "TASK373", "'door/hinge' opens by 110 deg at most, not by 150 deg"),
        ("open: {object: door, part: knob}", "TASK372", "'door' has no part 'knob' to take it by"),
        ("open: {object: block}", "TASK370", "'block' has no joint"),
        ("open: {object: drwer}", "TASK230", "'drwer' is not in the scene"),
        ("turn: {object: drawer, by: 30 deg}", "TASK375", "'drawer/slide' slides: it does not turn"),
        ("turn: {object: door, to: 200 deg}", "TASK373", "'door/hinge' turns from 0 deg to 110 deg, not to 200 deg"),
        ("open: {object: door, by: 15 cm}", "TASK207", "joint 'door/hinge' is revolute: '15 cm' is a length"),
        ("turn: {object: dial}", "TASK208", "expected `by` or `to`"),
    ],
)
def test_what_cannot_be_moved_is_refused_at_its_place(step: str, code: str, text: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        _loaded(HEAD + THINGS + f"steps:\n  - {step}\n")
    (finding,) = (one for one in refused.value.findings if one.severity == "error")
    assert finding.code == code
    assert text in finding.message
    assert finding.place is not None
    assert finding.place.line == (HEAD + THINGS).count("\n") + 2
