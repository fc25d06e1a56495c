"""What can be wrong with a description: one file a check, in the order of what they are about."""

from manipcli.core.registry import Seam
from manipcli.model.check import Check
from manipcli.model.checks.robot_name import CHECK as ROBOT_NAME

_SCHEMA: tuple[Check, ...] = (ROBOT_NAME,)
_TOPOLOGY: tuple[Check, ...] = ()
_PHYSICS: tuple[Check, ...] = ()
_ASSETS: tuple[Check, ...] = ()
_READINESS: tuple[Check, ...] = ()

CHECKS: Seam[Check] = Seam(kind="check", members=(*_SCHEMA, *_TOPOLOGY, *_PHYSICS, *_ASSETS, *_READINESS))
