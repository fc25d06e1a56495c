"""Registry of path planners."""

from typing import Any

from manipcli.core.registry import Seam
from manipcli.plan.path_planner import PathPlannerMember
from manipcli.plan.path_planners import ompl, rrt_connect

PATH_PLANNERS: Seam[PathPlannerMember[Any]] = Seam(kind="path planner", members=(rrt_connect.MEMBER, ompl.MEMBER))
