"""More joints than Bullet holds."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.description.lint.check import Check, Subject
from manipcli.description.lint.samples import one_joint

MAX_JOINTS: Final = 127
"""Moving and fixed; with one more PyBullet's `getJointState` fails, with thousands the process."""


def _find(subject: Subject) -> Iterator[Finding]:
    joints = subject.description.root.all("joint")
    if len(joints) > MAX_JOINTS:
        message = f"the robot has {len(joints)} joints; Bullet holds {MAX_JOINTS}, fixed ones included"
        hint = "join links that are fixed to each other"
        yield Finding("URDF332", message, joints[MAX_JOINTS].place, hint)


TOO_MANY_JOINTS = Check(
    code="URDF332",
    name="too-many-joints",
    tier="readiness",
    severity="error",
    summary="The robot has more than 127 joints",
    reason="From 128 on, fixed ones included, PyBullet cannot read a joint; with thousands it hangs or crashes.",
    bad=one_joint(
        more="".join(
            f'<link name="l{k}"/><joint name="j{k}" type="fixed"><parent link="base"/><child link="l{k}"/></joint>'
            for k in range(127)
        )
    ),
    find=_find,
)
