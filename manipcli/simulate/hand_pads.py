"""The taxels with shear on the links of a hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from manipcli.model.robot import RobotModel
from manipcli.plan.hand import moved_links
from manipcli.simulate.sensors.tactile import TactileSpec
from manipcli.spec.sensors import SensorSpec


def hand_pads(
    sensors: Mapping[str, SensorSpec], robot: RobotModel, joints: Sequence[str]
) -> tuple[tuple[str, TactileSpec, str], ...]:
    """(name, spec, link) of each sensor with shear on a link that `joints` move."""
    if not any(isinstance(spec, TactileSpec) for spec in sensors.values()):
        return ()
    links = moved_links(robot, joints)
    return tuple(
        (name, spec, spec.link)
        for name, spec in sensors.items()
        if isinstance(spec, TactileSpec) and spec.shear and spec.link in links
    )
