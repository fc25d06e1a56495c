"""Registry of engines."""

from manipcli.core.registry import Seam
from manipcli.simulate.engine import EngineMember
from manipcli.simulate.engines import kinematic, pybullet

ENGINES: Seam[EngineMember] = Seam(kind="engine", members=(pybullet.MEMBER, kinematic.MEMBER))
