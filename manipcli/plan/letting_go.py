"""Refusal to let go with a hand that would still hold the object."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.hand import pressing
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner


def refuse_pressing(planner: Planner, state: PlanningState, q: Array, joints: Sequence[str], posture: str) -> None:
    """Refuse to let go of what is carried with a hand whose `joints` still hold it at `q` (n), in its pose `posture`.

    Raises:
        NotPlannable: names the deepest part.
    """
    if state.carried is None:
        return
    held = state.carried.body
    still = pressing(planner.robot, planner.grasping(state, held), q, joints)
    if still is not None:
        message = f"'{still}' still presses on '{held}' with the hand in its pose '{posture}'"
        raise NotPlannable(message, hint="set a pose in which the hand is open: `posture: POSE`")
