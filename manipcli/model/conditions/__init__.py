"""The conditions: one file a family. `CONDITIONS` is the registry that the pipeline hands to the loader."""

from __future__ import annotations

from typing import Any

from manipcli.core.registry import Seam
from manipcli.model.condition import Condition
from manipcli.model.conditions.above import ABOVE
from manipcli.model.conditions.at_pose import AT_POSE
from manipcli.model.conditions.at_rest import AT_REST
from manipcli.model.conditions.collision import COLLISION, NO_COLLISION
from manipcli.model.conditions.contact_force import CONTACT_FORCE
from manipcli.model.conditions.duration import DURATION
from manipcli.model.conditions.energy import ENERGY
from manipcli.model.conditions.grasped import GRASPED
from manipcli.model.conditions.inside import INSIDE, OUTSIDE
from manipcli.model.conditions.limits import LIMITS
from manipcli.model.conditions.moved import MOVED, UNMOVED
from manipcli.model.conditions.near import NEAR
from manipcli.model.conditions.rests_on import RESTS_ON
from manipcli.model.conditions.slip import SLIP
from manipcli.model.conditions.step_done import STEP_DONE
from manipcli.model.conditions.tool_speed import TOOL_SPEED
from manipcli.model.conditions.tracking import TRACKING
from manipcli.model.conditions.upright import UPRIGHT

# Any: a seam holds members of different specs; each is only ever called with its own.
CONDITIONS: Seam[Condition[Any]] = Seam(
    kind="condition",
    members=(
        INSIDE, OUTSIDE, UPRIGHT, NEAR, ABOVE, RESTS_ON, AT_REST, MOVED, UNMOVED, GRASPED, SLIP, CONTACT_FORCE,
        COLLISION, NO_COLLISION, AT_POSE, TRACKING, LIMITS, TOOL_SPEED, ENERGY, DURATION, STEP_DONE,
    ),
)  # fmt: skip
