"""A 7-joint arm, roll and pitch alternating, with two sliding fingers, built by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.model.robot import (
    Box,
    Cylinder,
    Geometry,
    Group,
    Joint,
    JointLimits,
    Link,
    RobotModel,
    Shape,
)

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
        groups=(Group("arm", ARM, base="base", tip="link_7"),),
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


def _link(name: str, shape: Shape, z: float) -> Link:
    return Link(name=name, inertial=None, visuals=(), collisions=(Geometry(Transform.of(xyz=(0, 0, z)), shape),))
