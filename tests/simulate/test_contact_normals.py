"""Contacts push along the normals of the surfaces that touch, also of what has been turned in a hand."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Link
from manipcli.model.robot import RobotModel
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Shape
from manipcli.simulate.engine import EngineMember
from tests.contracts.test_engines import STEP, Opens, body, inertial, joint, opens, robot, scene, with_physics, write

__all__ = ["opens"]  # a fixture

TURN, TURNING, SETTLED = np.deg2rad(120.0), 0.6, 0.3


def hand() -> RobotModel:
    """A wrist at (0, 0, 1) that turns about y, and two pads that close along its x axis."""
    pad = (Geometry(Transform.identity(), Box((0.02, 0.06, 0.06))),)
    made = robot(
        [
            joint("wrist", "palm"),
            joint("left", "pad_left", parent="palm", kind="prismatic", axis=(1.0, 0.0, 0.0), at=(-0.035, 0.0, 0.0)),
            joint("right", "pad_right", parent="palm", kind="prismatic", axis=(-1.0, 0.0, 0.0), at=(0.035, 0.0, 0.0)),
        ],
        [inertial(0.5), inertial(0.2, moments=(1e-3,) * 3), inertial(0.2, moments=(1e-3,) * 3)],
    )
    links = tuple(
        Link(link.name, link.inertial, pad, pad) if link.name.startswith("pad") else link for link in made.links
    )
    return RobotModel("hand", "base", links, made.joints, (), (), (), Transform.identity(), "", friction=1.0)


@with_physics
@pytest.mark.parametrize("shape", [Cylinder(0.02, 0.06), Box((0.04, 0.04, 0.06))], ids=["cylinder", "box"])
def test_normals_turn_with_what_is_held(member: EngineMember, opens: Opens, shape: Shape) -> None:
    """The pads are plane, so every normal is theirs. Bullet alone presses along normals up to 51 degrees off."""
    held = body("cup", shape, (0.0, 0.0, 1.0), mass=0.1, moments=(4e-5,) * 3, friction=1.0)
    engine = opens(member, hand(), scene(held), modes=("velocity", "brake", "effort"))
    worst: list[float] = []
    for k in range(round((TURNING + SETTLED) / STEP)):
        state = engine.read()
        angle = float(state.position[0])
        plane: Array = frozen([np.cos(angle), 0.0, -np.sin(angle)])
        for contact in engine.contacts():
            along = [abs(plane @ np.array(point.normal)) for point in contact.points if point.force > 0.5]
            worst += np.arccos(np.minimum(along, 1.0)).tolist()
        turning = 0.1 <= k * STEP < 0.1 + TURNING
        write(engine, np.array([TURN / TURNING if turning else 0.0, 8.0, 8.0]))
        engine.advance()
    assert angle == pytest.approx(TURN, abs=1e-3)
    assert np.linalg.norm(state.body_position[0] - (0.0, 0.0, 1.0)) < 0.03, "it is still held"
    assert np.rad2deg(max(worst)) < 3.0
