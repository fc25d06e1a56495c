"""Registry of sensors."""

from manipcli.core.registry import Seam
from manipcli.simulate.sensor import AnySensor
from manipcli.simulate.sensors import contact, force_torque, imu, joint, tactile

SENSORS: Seam[AnySensor] = Seam(
    kind="sensor",
    members=(force_torque.MEMBER, joint.MEMBER, imu.MEMBER, contact.MEMBER, tactile.MEMBER),
)
