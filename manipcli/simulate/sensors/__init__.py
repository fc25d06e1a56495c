"""Registry of sensors."""

from manipcli.core.registry import Seam
from manipcli.simulate.sensor import AnySensor
from manipcli.simulate.sensors import camera, range

SENSORS: Seam[AnySensor] = Seam(kind="sensor", members=(range.MEMBER, camera.MEMBER))
