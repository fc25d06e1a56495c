"""Bodies from files with joints: names, places, masses, parts, hollows, what may rest on them, and refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput
from manipcli.description.packages import Packages
from manipcli.model.joint_units import misread_units
from manipcli.scene.build_scene import build_scene
from manipcli.scene.joint_inertia import moved_inertia
from manipcli.scene.scene import Scene
from manipcli.scene.scene_file import scene_from_json, scene_to_json
from manipcli.spec.load import load_task_text
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import task_spec

OBJECTS = Path(__file__).parents[2] / "tasks" / "objects"
BALL = {"sphere": {"radius": "2 cm"}, "mass": "20 g"}


def scene(**bodies: Any) -> Scene:
    data = {"task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}], "scene": bodies}
    spec: TaskSpec = task_spec().model_validate(data)
    return build_scene(spec, packages=Packages(OBJECTS / "task.yaml"))


def thing(name: str, **more: Any) -> dict[str, Any]:
    return {"urdf": {"file": f"{name}.urdf"}, "fixed": True, "rests_on": "floor", "at": [1, 0], **more}


def test_a_moved_link_is_a_body_at_the_start_of_its_joint() -> None:
    """The drawer begins 10 cm out, along -x; the handle, on a fixed joint, is a part of it with its size."""
    made = scene(cabinet=thing("cabinet", joints={"slide": {"start": "10 cm"}}))
    closed = scene(cabinet=thing("cabinet"))
    assert [body.name for body in made.bodies] == ["floor", "cabinet", "cabinet/drawer"]
    assert [body.name for body in made.movable] == ["cabinet/drawer"]
    (joint,) = made.joints
    assert (joint.name, joint.parent, joint.child) == ("cabinet/slide", "cabinet", "cabinet/drawer")
    assert (joint.lower, joint.upper, joint.damping, joint.friction) == (0.0, 0.22, 4.0, 1.0)
    drawer = made.body("cabinet/drawer")
    np.testing.assert_allclose(drawer.X_WO.p - closed.body("cabinet/drawer").X_WO.p, [-0.1, 0, 0], atol=1e-12)
    assert drawer.mass == pytest.approx(1.3) and moved_inertia(made, joint) == pytest.approx(1.3)
    handle = made.frame("cabinet/handle")
    assert handle is not None and handle.parent == "cabinet/drawer"
    same = made.frame("cabinet/drawer/handle")
    assert same is not None and same.X_PF is handle.X_PF and "handle" in made.parts("cabinet/drawer")
    assert handle.size is not None
    np.testing.assert_allclose(handle.size, [0.012, 0.13, 0.012], atol=1e-12)


def test_a_body_can_lie_in_a_drawer_and_rest_on_the_cabinet() -> None:
    """Of the drawer's hollow: 0.292 by 0.304 by 0.072 m, found within a tenth of a percent of the body."""
    slide = {"slide": {"start": "15 cm"}}
    made = scene(
        ball=BALL | {"inside": "cabinet/drawer"}, can=BALL | {"rests_on": "cabinet", "at": [1, 0]},
        tag=BALL | {"pose": {"xyz": [-0.1, 0, 0]}, "frame": "cabinet/handle"},
        cabinet=thing("cabinet", joints=slide),
    )  # fmt: skip
    drawer = made.body("cabinet/drawer")
    assert drawer.interior is not None
    np.testing.assert_allclose(drawer.interior.shape.size, [0.292, 0.304, 0.072], atol=5e-4)  # type: ignore[union-attr]
    floor = drawer.X_WO.p[2] + 0.008
    assert made.body("ball").X_WO.p[2] == pytest.approx(floor + 0.02, abs=5e-4)
    assert made.body("can").X_WO.p[2] == pytest.approx(0.2 + 0.02, abs=3e-4)
    np.testing.assert_allclose(made.body("tag").X_WO.p, drawer.X_WO.apply([-0.152, 0, 0.09]), atol=1e-12)


def test_the_inertia_about_a_hinge_is_that_of_the_file() -> None:
    """The door: a panel of 1.8 kg and 0.36 m in the middle 0.182 m from the hinge, posts, and a bar of 100 g."""
    made = scene(door=thing("door"))
    bars = (((0.039, 0.012, 0.012), (-0.0295, 0.31)), ((0.039, 0.012, 0.012), (-0.0295, 0.31)))
    boxes = [((0.02, 0.36, 0.43), (0.0, 0.182)), *bars]
    volumes = np.array([np.prod(size) for size, _ in boxes])
    expected = sum(
        m * ((size[0] ** 2 + size[1] ** 2) / 12 + x * x + y * y)
        for m, (size, (x, y)) in zip(1.8 * volumes / volumes.sum(), boxes, strict=True)
    )
    expected += 0.1 * (2 * 0.012**2 / 12 + 0.055**2 + 0.31**2)
    assert moved_inertia(made, made.joints[0]) == pytest.approx(expected, rel=2e-3)  # the file has three digits


def test_a_scene_with_joints_is_read_as_written() -> None:
    spring = {"stiffness": "2 N m/rad", "rest": "10 deg"}
    made = scene(
        door=thing("door", joints={"hinge": {"start": "20 deg", "closed": "5 deg", "spring": spring}}),
        dial=thing("dial", at=[2, 0]),
    )  # fmt: skip
    text = scene_to_json(made)
    again = scene_from_json(text)
    assert scene_to_json(again) == text
    hinge = again.joints[0]
    values = np.degrees([hinge.rest, hinge.start, hinge.closed])
    assert hinge.stiffness == 2.0 and values == pytest.approx([10, 20, 5])
    assert [joint.child for joint in again.joints] == ["door/panel", "dial/disc"]
    assert b"joints" not in scene_to_json(scene(ball=BALL | {"rests_on": "floor", "at": [0, 0]}))


def test_a_xacro_file_takes_arguments(tmp_path: Path) -> None:
    text = (
        (OBJECTS / "button.urdf").read_text().replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ')
    )
    text = text.replace('upper="0.008"', 'upper="${travel}"').replace(
        '<link name="housing">', '<xacro:arg name="t" default="0.008"/><xacro:property name="travel" value="$(arg t)"/>'
        '<link name="housing">',
    )  # fmt: skip
    (tmp_path / "button.xacro").write_text(text)
    data = {"task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}]}
    button = {"urdf": {"file": "button.xacro", "args": {"t": 0.02}}, "fixed": True, "pose": {}}
    made = build_scene(
        task_spec().model_validate(data | {"scene": {"b": button}}), packages=Packages(tmp_path / "task.yaml")
    )
    assert made.joints[0].upper == 0.02


def test_a_valve_of_several_revolutions_is_refused(tmp_path: Path) -> None:
    (tmp_path / "valve.urdf").write_text((OBJECTS / "dial.urdf").read_text().replace('upper="4.712"', 'upper="6.3"'))
    data = {"task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}]}
    valve = {"urdf": {"file": "valve.urdf"}, "fixed": True, "pose": {}}
    spec = task_spec().model_validate(data | {"scene": {"valve": valve}})
    with pytest.raises(InvalidInput) as caught:
        build_scene(spec, packages=Packages(tmp_path / "task.yaml"))
    (finding,) = caught.value.findings
    assert finding.code == "TASK364" and "more than one revolution" in finding.message


@pytest.mark.parametrize(
    ("bodies", "code", "words"),
    [
        ({"door": thing("door", joints={"hnge": {}})}, "TASK360", "no joint 'hnge'"),
        ({"ball": BALL | {"rests_on": "floor", "at": [0, 0], "joints": {}}}, "TASK360", "without `urdf`"),
        ({"door": thing("door", joints={"hinge": {"start": -1.0}})}, "TASK361", "-57.3 deg, outside"),
        ({"door": thing("door", count=2)}, "TASK363", "joints and `count`"),
        ({"door": thing("door", mass=2.0)}, "TASK363", "joints and `mass`"),
        ({"ball": BALL | {"inside": "cabinet/lid"}, "cabinet": thing("cabinet")}, "TASK225", "'cabinet/lid'"),
        ({"x": BALL | {"pose": {"xyz": [0.95, 0, 0.2]}}, "cabinet": thing("cabinet")}, "TASK226", "'cabinet'"),
    ],
)  # fmt: skip
def test_what_does_not_go_with_joints_is_refused(bodies: dict[str, Any], code: str, words: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        scene(**bodies)
    assert code in {found.code for found in caught.value.findings}
    assert any(words in found.message for found in caught.value.findings), caught.value.findings


def test_units_that_do_not_fit_a_joint_are_refused() -> None:
    """Of a hinge: lengths, forces and stiffnesses of a slide; and the other way round; also in conditions."""
    text = """task: t
robot: r
controllers: c
scene:
  cabinet: {urdf: {file: cabinet.urdf}, fixed: true, pose: {}, joints: {slide: {start: 5 deg, closed: 1 cm}}}
  door:
    urdf: {file: door.urdf}
    fixed: true
    pose: {xyz: [2, 0, 0]}
    joints: {hinge: {start: 5 deg, friction: 2 N, spring: {stiffness: 2 N/m, rest: 1 deg}}}
steps: [{wait: 1 s}]
expect:
  - joint_at: {joint: door/hinge, at: 5 cm, within: 1 deg}
  - opened: {object: cabinet, by: 5 deg}
  - near: {object: cabinet/drawer, to: start, within: 1 cm}
"""
    task = load_task_text(text, "t.yaml", model=task_spec())
    made = build_scene(task.spec, packages=Packages(OBJECTS / "task.yaml"))
    found = [*misread_units(task.spec, task.source, (), (), made.joints)]
    assert [(one.place.line if one.place else 0, one.message.partition(": ")[0]) for one in found] == [
        (5, "scene.cabinet.joints.slide.start"),
        (10, "scene.door.joints.hinge.friction"),
        (10, "scene.door.joints.hinge.spring.stiffness"),
        (13, "expect[0].joint_at.at"),
        (14, "expect[1].opened.by"),
    ]
