"""What is accepted means the same to Bullet and to Pinocchio: a hundred descriptions of pybullet_data.

Pinocchio reads the file of the user; Bullet, in a process of its own as it may crash, the one that is written for it.
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from manipcli.description.lint.examine import examine
from manipcli.description.packages import Packages
from manipcli.model.build_robot import build_robot
from manipcli.model.kinematics import Kinematics
from manipcli.model.normalised_urdf import engine_urdf, massless_joints
from manipcli.model.robot import RobotModel
from manipcli.spec.robot import RobotSpec

SAMPLE = 100
AT_LEAST = 70
"""Accepted of the sample; the rest have errors that their list of findings tells."""
POSE = 1e-9
"""[m], and of the entries of rotation matrices: numbers are printed so that they read back exactly."""
BULLET_POSE = 1e-6
"""As `POSE`, in Bullet, whose frames are of single precision: 0.075 m is 3e-9 m off, 0.5 rad is 4e-8 rad off."""

IN_BULLET = """
import json, sys
import pybullet as p

p.connect(p.DIRECT)
for line in open(sys.argv[1]):
    file, positions = json.loads(line)
    p.resetSimulation()
    body = p.loadURDF(file, useFixedBase=True, flags=p.URDF_IGNORE_VISUAL_SHAPES)
    links = {}
    for k in range(p.getNumJoints(body)):
        name = p.getJointInfo(body, k)[1].decode()
        if name in positions:
            p.resetJointState(body, k, positions[name])
    for k in range(p.getNumJoints(body)):
        info = p.getJointInfo(body, k)
        state = p.getLinkState(body, k, computeForwardKinematics=True)
        links[info[12].decode()] = [info[2], p.getDynamicsInfo(body, k)[0], state[4], state[5]]
    print("RESULT" + json.dumps([file, links]), flush=True)
"""


@dataclass
class Compared:
    """A robot at some positions: poses of its links (4, 4) in the root's frame."""

    path: Path
    robot: RobotModel
    positions: dict[str, float]
    poses: dict[str, np.ndarray]


def sample() -> list[Path]:
    """All but the thousand random objects, whose inertia no body has: five of those."""
    import pybullet_data

    root = Path(pybullet_data.getDataPath())
    paths = sorted(path for path in root.rglob("*.urdf") if "random_urdfs" not in path.parts)
    others = sorted(path for path in root.rglob("*.urdf") if "random_urdfs" in path.parts)
    return [*paths[: SAMPLE - 5], *others[:: max(1, len(others) // 5)][:5]]


def matrix(p: list[float], quat_xyzw: list[float]) -> np.ndarray:
    """(4, 4)"""
    x, y, z, w = quat_xyzw
    R = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.block([[np.array(R), np.array(p)[:, None]], [np.zeros(3), 1.0]])


def poses_of(kinematics: Kinematics, q: np.ndarray) -> dict[str, np.ndarray]:
    return {link.name: np.asarray(kinematics.forward(q, link.name).matrix) for link in kinematics.robot.links}


def compared(path: Path) -> Compared | None:
    if examine(path, packages=Packages(path)).errors:
        return None
    robot, _ = build_robot(RobotSpec(robot="r", description=path.name), file=path.parent / "robot.yaml")
    rng = np.random.default_rng(len(robot.joints))
    q = np.zeros(len(robot.moving_joints))
    for k, joint in enumerate(robot.moving_joints):
        lower, upper = joint.limits.lower, joint.limits.upper
        q[k] = rng.uniform(-1.0 if lower is None else max(lower, -2.0), 1.0 if upper is None else min(upper, 2.0))
    kinematics = Kinematics(robot)
    positions = dict(zip(robot.joint_names, q.tolist(), strict=True))
    return Compared(path, robot, positions, poses_of(kinematics, q))


@pytest.fixture(scope="module")
def accepted() -> list[Compared]:
    found = [compared(path) for path in sample()]
    return [each for each in found if each is not None]


@pytest.mark.slow
def test_enough_descriptions_are_accepted(accepted: list[Compared]) -> None:
    assert len(sample()) == SAMPLE
    assert len(accepted) >= AT_LEAST


@pytest.mark.slow
def test_pinocchio_reads_the_same_robot(accepted: list[Compared], capfd: pytest.CaptureFixture[str]) -> None:
    import pinocchio as pin

    count = 0
    for each in accepted:
        robot = each.robot
        text = each.path.read_text(encoding="utf-8", errors="replace")
        try:
            model = (
                pin.buildModelFromXML(text) if each.path.suffix != ".urdf" else pin.buildModelFromUrdf(str(each.path))
            )
        except ValueError:
            continue  # urdfdom refuses what is harmless: a name given to two materials, numbers of another form
        count += 1
        data = model.createData()
        q = pin.neutral(model)
        for k in range(1, model.njoints):
            position, at = each.positions[model.names[k]], model.joints[k].idx_q
            if model.joints[k].nq == 2:  # a continuous joint is a point on a circle there
                q[at : at + 2] = np.cos(position), np.sin(position)
            else:
                q[at] = position
        pin.framesForwardKinematics(model, data, q)
        frames = {frame.name: k for k, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY}
        assert model.njoints - 1 == len(robot.moving_joints), each.path
        assert set(frames) - {"universe"} == {link.name for link in robot.links}, each.path
        for name, pose in each.poses.items():
            np.testing.assert_allclose(
                data.oMf[frames[name]].homogeneous, pose, atol=POSE, err_msg=f"{each.path} {name}"
            )
        moved = sum(link.inertial.mass for link in robot.links if link.inertial is not None)
        assert pin.computeTotalMass(model) + model.inertias[0].mass == pytest.approx(moved, rel=1e-9), each.path
    with capfd.disabled():
        sys.stdout.write(f"\ncompared with Pinocchio: {count} of {len(accepted)}\n")
    assert count >= AT_LEAST


@pytest.mark.slow
def test_bullet_holds_the_same_robot(
    accepted: list[Compared], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    by_file, lines = {}, []
    for k, each in enumerate(accepted):
        if massless_joints(each.robot) or len(each.robot.joints) > 127:
            continue
        folder = tmp_path / str(k)
        folder.mkdir()
        file = folder / "robot.urdf"
        file.write_text(engine_urdf(each.robot, folder), encoding="utf-8")
        by_file[str(file)] = each
        lines.append(json.dumps([str(file), each.positions]))
    (tmp_path / "jobs").write_text("\n".join(lines) + "\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", IN_BULLET, str(tmp_path / "jobs")],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    results = [json.loads(line[6:]) for line in done.stdout.splitlines() if line.startswith("RESULT")]
    assert len(results) == len(lines)
    for file, links in results:
        each = by_file[file]
        robot = each.robot
        assert len(links) == len(robot.joints), each.path
        kinds = {name: kind for name, (kind, *_) in links.items()}
        assert sum(kind != 4 for kind in kinds.values()) == len(robot.moving_joints), each.path
        for name, (_, mass, p, quat_xyzw) in links.items():
            inertial = robot.link(name).inertial
            assert mass == pytest.approx(inertial.mass if inertial is not None else 0.0, rel=1e-9), (each.path, name)
            where = f"{each.path} {name}"
            np.testing.assert_allclose(
                matrix(p, quat_xyzw), each.poses[name], rtol=0.0, atol=BULLET_POSE, err_msg=where
            )
    with capfd.disabled():
        sys.stdout.write(f"\ncompared with Bullet: {len(results)} of {len(accepted)}\n")
