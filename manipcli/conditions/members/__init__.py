"""The built-in conditions, one file per family, and their registry `CONDITIONS`."""

from __future__ import annotations

from typing import Any

from manipcli.conditions.condition import Condition
from manipcli.conditions.members.above import ABOVE
from manipcli.conditions.members.at_pose import AT_POSE
from manipcli.conditions.members.at_rest import AT_REST
from manipcli.conditions.members.collision import COLLISION, NO_COLLISION
from manipcli.conditions.members.contact_force import CONTACT_FORCE
from manipcli.conditions.members.duration import DURATION
from manipcli.conditions.members.energy import ENERGY
from manipcli.conditions.members.force import FORCE
from manipcli.conditions.members.grasped import GRASPED
from manipcli.conditions.members.inside import INSIDE, OUTSIDE
from manipcli.conditions.members.joint_at import CLOSED, JOINT_AT, OPENED
from manipcli.conditions.members.limits import LIMITS
from manipcli.conditions.members.moved import MOVED, UNMOVED
from manipcli.conditions.members.near import NEAR
from manipcli.conditions.members.rests_on import RESTS_ON
from manipcli.conditions.members.saturation import SATURATION
from manipcli.conditions.members.sees import SEES
from manipcli.conditions.members.slip import SLIP
from manipcli.conditions.members.slips import SLIPS
from manipcli.conditions.members.step_done import STEP_DONE
from manipcli.conditions.members.tool_speed import TOOL_SPEED
from manipcli.conditions.members.touches import TOUCHES
from manipcli.conditions.members.tracking import TRACKING
from manipcli.conditions.members.upright import UPRIGHT
from manipcli.conditions.members.wrench import WRENCH
from manipcli.core.registry import Seam

# Any: the members of a seam have different specs; each is called with its own.
CONDITIONS: Seam[Condition[Any]] = Seam(
    kind="condition",
    members=(
        INSIDE, OUTSIDE, UPRIGHT, NEAR, ABOVE, RESTS_ON, AT_REST, MOVED, UNMOVED, GRASPED, SLIP, CONTACT_FORCE,
        COLLISION, NO_COLLISION, AT_POSE, TRACKING, LIMITS, SATURATION, TOOL_SPEED, ENERGY, DURATION, STEP_DONE,
        TOUCHES, WRENCH, FORCE, SEES, SLIPS, JOINT_AT, OPENED, CLOSED,
    ),
)  # fmt: skip
