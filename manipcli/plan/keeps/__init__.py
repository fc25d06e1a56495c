"""Registry of the constraints on the motions of a step."""

from manipcli.core.registry import Seam
from manipcli.plan.keep import KeepMember
from manipcli.plan.keeps import above, inside, slosh, tool_motion, upright

KEEPS: Seam[KeepMember] = Seam(
    kind="constraint",
    members=(
        upright.MEMBER,
        above.MEMBER,
        inside.MEMBER,
        tool_motion.SPEED,
        tool_motion.ACCELERATION,
        slosh.MEMBER,
    ),
)
