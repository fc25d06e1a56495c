"""What the driven joints meet, against sums of masses by hand."""

import numpy as np
import pytest

from manipcli.control.joint_space_load import Configurations, load_of
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link, Mimic
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel

MASSES = {"lead": 2.0, "half": 3.0, "back": 5.0}
DAMPING = {"lead": 0.5, "half": 4.0, "back": 7.0}
SHARES = {"lead": 1.0, "half": 0.5, "back": -1.5}
"""How far each slides while the first goes 1 m; the last follows the second, -3 times."""


def slides():
    """Three weights beside each other, each on a slide of its own, upright."""
    inertia = frozen(0.01 * np.eye(3))
    mimics = {"lead": None, "half": Mimic("lead", 0.5, 0.1), "back": Mimic("half", -3.0)}
    joints = tuple(
        Joint(
            name, "prismatic", "base", f"{name}_link", Transform.identity(), frozen([0.0, 0.0, 1.0]),
            JointLimits(-1.0, 1.0, 1.0, 100.0), mimic, DAMPING[name],
        )
        for name, mimic in mimics.items()
    )  # fmt: skip
    links = tuple(
        Link(f"{name}_link", Inertial(mass, Transform.identity(), inertia), (), ()) for name, mass in MASSES.items()
    )
    return RobotModel(
        name="slides", root="base", links=(Link("base", None, (), ()), *links), joints=joints, groups=(), poses=(),
        transmissions=(), X_WB=Transform.identity(), urdf="",
    )  # fmt: skip


def test_what_follows_is_met_by_the_square_of_its_share_and_weighs_by_its_share():
    robot = slides()
    load = load_of(robot, Kinematics(robot), ("lead",), Configurations.at_rest(np.zeros((1, 3))))
    assert load.mass[0, 0, 0] == pytest.approx(sum(MASSES[one] * share**2 for one, share in SHARES.items()))
    assert load.damping == pytest.approx([sum(DAMPING[one] * share**2 for one, share in SHARES.items())])
    assert load.gravity[0] == pytest.approx([9.81 * sum(MASSES[one] * share for one, share in SHARES.items())])
    assert load.needed == pytest.approx(load.gravity)
