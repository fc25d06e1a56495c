"""The conditions: one file a member. `CONDITIONS` is the registry that the pipeline hands to the loader."""

from __future__ import annotations

from typing import Any

from manipcli.core.registry import Seam
from manipcli.model.condition import Condition
from manipcli.model.conditions.at_pose import AT_POSE
from manipcli.model.conditions.at_rest import AT_REST
from manipcli.model.conditions.inside import INSIDE
from manipcli.model.conditions.near import NEAR
from manipcli.model.conditions.upright import UPRIGHT

# Any: a seam holds members of different specs; each is only ever called with its own.
CONDITIONS: Seam[Condition[Any]] = Seam(kind="condition", members=(INSIDE, UPRIGHT, NEAR, AT_REST, AT_POSE))
