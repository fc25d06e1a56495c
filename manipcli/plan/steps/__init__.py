"""Registry of the steps of a task."""

from typing import Any

from manipcli.core.registry import Seam
from manipcli.plan.step import StepMember
from manipcli.plan.steps import (
    close,
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
    turn,
    wait,
)
from manipcli.plan.steps import open as open_step

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
        open_step.MEMBER,
        close.MEMBER,
        turn.MEMBER,
        press.MEMBER,
        insert.MEMBER,
        push.MEMBER,
        slide.MEMBER,
    ),
)
