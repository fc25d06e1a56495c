"""Registry of sensors."""

from manipcli.core.registry import Seam
from manipcli.simulate.sensor import SensorMember
from manipcli.simulate.sensors import wrench

SENSORS: Seam[SensorMember] = Seam(kind="sensor", members=(wrench.MEMBER,))
