"""Registry of sensors."""

from manipcli.core.registry import Seam
from manipcli.simulate.sensor import AnySensor
from manipcli.simulate.sensors import camera, contact, force_torque, imu, joint, range, tactile

SENSORS: Seam[AnySensor] = Seam(
    kind="sensor",
    members=(
        force_torque.MEMBER,
        joint.MEMBER,
        imu.MEMBER,
        contact.MEMBER,
        tactile.MEMBER,
        range.MEMBER,
        camera.MEMBER,
    ),
)
