"""What `view` shows in numbers: joints in degrees, the pose of the tool, the gap of the hand, collisions, masses."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import yaml

from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import JointLimits
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import RobotModel, Tool
from manipcli.replay.camera import FIELD, VIEWS
from manipcli.replay.view.camera_panel import NARROW
from manipcli.replay.view.joint_panel import configuration_text
from manipcli.replay.view.tool_marks import gap_line
from manipcli.replay.view.view import View
from manipcli.replay.view.viser_scene import MARKED
from manipcli.spec.robot import RobotSpec
from tests.onboard import small_robots as small

LINKS = [f"l{k}" for k in range(7)]
OUT_ALONG_Z = Transform.of(xyz=(0.07, 0.0, 0.0), rpy=(0.0, np.pi / 2, 0.0))


def _robot(folder: Path) -> RobotModel:
    path = folder / "small.urdf"
    path.write_text(small.robot(small.arm(LINKS), small.palm("p", parent="l6"), small.gripper("p")))
    robot = build_robot(RobotSpec(robot="small", description=str(path)), file=folder / "robot.yaml")[0]
    return replace(robot, tool=Tool("p", OUT_ALONG_Z))


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[View]:
    with View(_robot(tmp_path_factory.mktemp("robot")), port=0) as view:
        yield view


def _theirs(robot: RobotModel, q: np.ndarray) -> tuple[pin.Model, pin.Data, np.ndarray]:
    """Pinocchio's reading of the URDF, and the joint positions in its order."""
    model = pin.buildModelFromXML(robot.urdf)
    theirs = pin.neutral(model)
    for name, value in zip(robot.joint_names, q, strict=True):
        theirs[model.joints[model.getJointId(name)].idx_q] = value
    return model, model.createData(), theirs


def _until(condition: Callable[[], bool], seconds: float = 10.0) -> None:
    """Callbacks of the page run in threads of the server."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_sliders_are_in_degrees_and_millimetres_between_the_limits(page: View) -> None:
    ends = {slider.handle.label: (slider.handle.min, slider.handle.max) for slider in page.joints.sliders.values()}
    assert ends["j_l1"] == pytest.approx((-np.degrees(2.6), np.degrees(2.6)), abs=0.005)
    assert ends["slide_left"] == pytest.approx((0.0, 1000.0 * small.OPENING / 2), abs=0.005)
    slider = page.joints.sliders[page.robot.joint_names.index("j_l1")]
    slider.handle.value = 90.0  # type: ignore[misc]
    _until(lambda: bool(page.joints.position[0] == pytest.approx(np.pi / 2)))
    slider.handle.value = slider.handle.max  # type: ignore[misc]
    _until(lambda: bool(page.joints.position[0] > 2.5))
    assert page.joints.position[0] <= 2.6


def test_a_configuration_is_shown_exactly_not_as_its_slider_rounds_it(page: View) -> None:
    q = frozen(np.full(8, 1.0 / 300.0))
    page.joints.go(q)
    time.sleep(0.2)  # of callbacks that may come
    assert page.joints.position == pytest.approx(q, abs=0.0)


def test_the_printed_pose_of_the_tool_is_that_of_the_printed_joints(page: View) -> None:
    rng = np.random.default_rng(5)
    page.joints.go(frozen([*rng.uniform(-1.0, 1.0, 6), 0.01, 0.02]))
    shown = yaml.safe_load(page._joint_text.value)
    q = np.array([shown[name] for name in page.robot.joint_names])
    model, data, theirs = _theirs(page.robot, q)
    pin.framesForwardKinematics(model, data, theirs)
    X_WT = data.oMf[model.getFrameId("p")] * pin.SE3(np.array(OUT_ALONG_Z.R), np.array(OUT_ALONG_Z.p))
    pose = yaml.safe_load(page._tool_text.value)
    assert pose["xyz"] == pytest.approx(X_WT.translation, abs=3e-5)  # both are printed to 1e-5
    assert pin.rpy.rpyToMatrix(*pose["rpy"]) == pytest.approx(X_WT.rotation, abs=5e-5)


def test_the_gap_is_between_the_fingers(page: View) -> None:
    q = np.zeros(8)
    q[6:] = 0.03, 0.01  # the left finger is at +y of the palm
    page.joints.go(frozen(q))
    hand = page.hand
    assert hand is not None
    ends = gap_line(hand, page.joints.position)
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(0.04, abs=1e-9)
    assert sorted(ends[:, 1]) == pytest.approx([-0.01, 0.03], abs=1e-9)
    assert "opening 40.0 mm" in page._status.content


def test_parts_that_overlap_are_named_with_the_depth_and_red_until_they_do_not(page: View) -> None:
    q = np.zeros(8)
    q[6:] = 0.02
    page.joints.go(frozen(q))
    assert "no collision" in page._status.content
    colours = {frame: mesh.color for frame, mesh, _ in page._scene._meshes}
    q[3] = q[2] = 2.6  # folded: the palm goes through the upper arm
    page.joints.go(frozen(q))
    hits = page.collisions.at(page.joints.position)
    model, data, theirs = _theirs(page.robot, q)
    geometry = pin.buildGeomFromUrdfString(model, page.robot.urdf, pin.GeometryType.COLLISION)
    red = {frame for frame, mesh, _ in page._scene._meshes if mesh.color == MARKED}
    assert red == {name for hit in hits for name in (hit.a, hit.b)} != set()
    for hit in hits:
        pair = [next(k for k, g in enumerate(geometry.geometryObjects) if g.name == f"{name.removeprefix('robot/')}_0")
                for name in (hit.a, hit.b)]  # fmt: skip
        geometry.addCollisionPair(pin.CollisionPair(min(pair), max(pair)))
    state = geometry.createData()
    pin.computeDistances(model, data, geometry, state, theirs)
    assert [hit.distance for hit in hits] == pytest.approx([r.min_distance for r in state.distanceResults], abs=1e-6)
    assert hits[0].amount in page._status.content
    page.joints.go(page.joints.named("zero"))
    assert {frame: mesh.color for frame, mesh, _ in page._scene._meshes} == colours


def test_the_centre_of_mass_of_the_robot_is_pinocchio_s(page: View) -> None:
    q = np.random.default_rng(6).uniform(0.0, 0.03, 8)
    model, data, theirs = _theirs(page.robot, q)
    pin.centerOfMass(model, data, theirs)
    # Pinocchio leaves out the link that is fixed to the world.
    root = page.robot.link(page.robot.root).inertial
    assert root is not None
    total = data.mass[0] + root.mass
    expected = (data.mass[0] * data.com[0] + root.mass * root.X_LI.p) / total
    assert page._masses.centre(page._placing.start(q)) == pytest.approx(expected, abs=1e-9)


def test_views_look_along_their_direction_and_parallel_ones_from_far(page: View) -> None:
    for direction in VIEWS.values():
        eye, target = page.camera.framed(direction, 1.6)
        along = (eye - target) / np.linalg.norm(eye - target)
        assert along == pytest.approx(np.array(direction) / np.linalg.norm(direction), abs=2e-3)
    near = np.linalg.norm(np.subtract(*page.camera.framed((1.0, 0.0, 0.0), 1.6)))
    page.camera._parallel.value = True  # type: ignore[misc]
    far = np.linalg.norm(np.subtract(*page.camera.framed((1.0, 0.0, 0.0), 1.6)))
    page.camera._parallel.value = False  # type: ignore[misc]
    heights = [d * np.tan(np.radians(field) / 2.0) for d, field in ((near, FIELD), (far, NARROW))]
    assert heights[0] == pytest.approx(heights[1], rel=1e-9)


def test_frames_are_found_by_their_names_and_resized(page: View) -> None:
    scene = page._scene
    scene.show("frames", True)
    scene.find("LEFT")
    assert {label for label, axes, _ in scene._named if axes.visible} == {"left"}
    scene.find("")
    assert all(axes.visible for _, axes, _ in scene._named)
    before = scene._named[0][1].axes_length
    scene.resize(2.0)
    assert scene._named[0][1].axes_length == pytest.approx(2.0 * before)
    scene.show("frames", False)
    scene.wireframe(True)
    assert all(mesh.wireframe for _, mesh, _ in scene._meshes)
    scene.wireframe(False)


def test_a_changed_robot_keeps_the_positions_of_its_joints(tmp_path: Path) -> None:
    robot = _robot(tmp_path)
    with View(robot, port=0) as view:
        view.joints.go(frozen([0.5, 1.2, *np.zeros(6)]))
        narrow = tuple(
            replace(joint, limits=replace(joint.limits, upper=1.0)) if joint.name == "j_l2" else joint
            for joint in robot.joints
        )
        view.replace(replace(robot, joints=narrow, tool=None))
        assert view.joints.position[:2] == pytest.approx([0.5, 1.0])
        assert view.joints.sliders[1].handle.max == pytest.approx(np.degrees(1.0), abs=0.005)
        assert view.hand is not None
        assert not view.hand.stated


@pytest.mark.parametrize("limit", [2.6179939, 0.6999955, -1.0471976])
def test_a_printed_configuration_is_within_the_limits(page: View, limit: float) -> None:
    joint = replace(page.robot.joints[0], limits=JointLimits(lower=limit, upper=limit))
    robot = replace(page.robot, joints=(joint, *page.robot.joints[1:]))
    number = yaml.safe_load(configuration_text(robot, frozen([limit, *np.zeros(7)])))["j_l1"]
    assert number == pytest.approx(limit, abs=1e-5)
    upper = replace(joint, limits=JointLimits(lower=limit - 1.0, upper=limit))
    robot = replace(page.robot, joints=(upper, *page.robot.joints[1:]))
    assert yaml.safe_load(configuration_text(robot, frozen([limit, *np.zeros(7)])))["j_l1"] <= limit
