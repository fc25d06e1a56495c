"""Registry of the steps of a task."""

from typing import Any

from manipcli.core.registry import Seam
from manipcli.plan.step import StepMember
from manipcli.plan.steps import (
    follow,
    grasp,
    insert,
    lift,
    locate,
    move,
    pick,
    place,
    pour,
    press,
    push,
    release,
    slide,
    switch_controllers,
    wait,
)

STEPS: Seam[StepMember[Any]] = Seam(
    kind="step",
    members=(
        move.MEMBER,
        follow.MEMBER,
        grasp.MEMBER,
        release.MEMBER,
        wait.MEMBER,
        locate.MEMBER,
        switch_controllers.MEMBER,
        pick.MEMBER,
        lift.MEMBER,
        pour.MEMBER,
        place.MEMBER,
        press.MEMBER,
        insert.MEMBER,
        push.MEMBER,
        slide.MEMBER,
    ),
)
