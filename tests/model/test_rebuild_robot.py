"""The description in a log is the robot of the run, bit for bit: what is simulated again starts from nothing else."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import Place
from manipcli.core.geometry import Transform
from manipcli.model.build_robot import build_robot, rebuild_robot
from manipcli.spec.load import load_robot, load_robot_text

ROOT = Path(__file__).parents[2]
ROBOTS = sorted(ROOT.glob("robots/*/robot.yaml"))


def _numbers(value: object, path: str = "") -> Iterator[tuple[str, object]]:
    """Everything a value is made of; arrays as bytes. Where files lie, and where in them, is left out."""
    if dataclasses.is_dataclass(value) and not isinstance(value, Place):
        for field in dataclasses.fields(value):
            yield from _numbers(getattr(value, field.name), f"{path}.{field.name}")
    elif isinstance(value, tuple):
        for k, each in enumerate(value):
            yield from _numbers(each, f"{path}[{k}]")
    elif isinstance(value, np.ndarray):
        yield path, value.tobytes()
    elif not isinstance(value, Path | Place):
        yield path, repr(value)


@pytest.mark.parametrize("file", ROBOTS, ids=lambda file: file.parent.name)
def test_every_robot_is_rebuilt_bit_for_bit(file: Path) -> None:
    spec = load_robot(file).spec
    robot, _ = build_robot(spec, file=file)
    assert dict(_numbers(rebuild_robot(spec, robot.urdf.encode()))) == dict(_numbers(robot))


def test_attached_at_a_quaternion_it_is_rebuilt_too(tmp_path: Path) -> None:
    """A rotation that no three angles say exactly is that of the angles which are written."""
    (tmp_path / "hand.urdf").write_text("<robot name='hand'><link name='hand'/></robot>")
    turning = "<joint name='turn' type='continuous'><parent link='arm'/><child link='upper'/></joint>"
    (tmp_path / "arm.urdf").write_text(f"<robot name='arm'><link name='arm'/><link name='upper'/>{turning}</robot>")
    quat = np.array([0.1, 0.7, -0.3, 0.2])
    quat /= np.linalg.norm(quat)
    text = (
        "robot: two\ndescription: arm.urdf\nattach:\n"
        f"- {{description: hand.urdf, parent: arm, pose: {{xyz: [-0.0, 1, 2], quat_xyzw: {quat.tolist()}}}}}\n"
    )
    spec = load_robot_text(text, "robot.yaml").spec
    robot, _ = build_robot(spec, file=tmp_path / "robot.yaml")
    wanted = Transform.of(quat_xyzw=quat)
    np.testing.assert_allclose(robot.joint("hand_attach").X_PJ.R, wanted.R, atol=1e-15)
    assert dict(_numbers(rebuild_robot(spec, robot.urdf.encode()))) == dict(_numbers(robot))


def test_angles_are_kept_as_they_are_given() -> None:
    rng = np.random.default_rng(3)
    for rpy in rng.uniform(-4.0, 4.0, (50, 3)):
        X = Transform.of(rpy=rpy)
        assert X.rpy.tobytes() == rpy.tobytes()
        assert Transform.of(rpy=X.rpy).R.tobytes() == X.R.tobytes()
        assert X.by_angles.R.tobytes() == X.R.tobytes()
    assert not np.signbit(Transform.of(rpy=(-0.0, 0.0, 0.0), xyz=(-0.0, 0.0, 1.0)).matrix).any()
