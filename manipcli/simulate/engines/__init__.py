"""Registry of engines."""

from manipcli.core.registry import Seam
from manipcli.simulate.engine import EngineMember
from manipcli.simulate.engines import kinematic, mujoco, pybullet

ENGINES: Seam[EngineMember] = Seam(kind="engine", members=(pybullet.MEMBER, mujoco.MEMBER, kinematic.MEMBER))
