"""`upright`: the held object's z axis within an angle of the vertical."""

from __future__ import annotations

import math

from manipcli.core.geometry import Array
from manipcli.core.prose import amount
from manipcli.plan.held_frame import tilts
from manipcli.plan.keep import POURING, KeepMember, Kept
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.spec.keep import KeepSpec

WITH_CONTENTS = math.radians(20.0)
"""[rad] The limit for an object with contents, if none is stated: chosen, well above what grasps and places tilt."""
RESERVE = math.radians(1.0)
"""[rad] Of a stated limit, at most a fifth of it: for the deviation of the arm from its plan, and a little slip."""
_SHARE = 0.2
_SLIPPED = math.radians(2.0)  # what an object that is held tilted may tilt more


def opened(spec: KeepSpec, planner: Planner, state: PlanningState) -> Kept | None:
    """As stated."""
    return None if spec.upright is None else _within(spec.upright, planner, state)


def derived(planner: Planner, state: PlanningState) -> Kept | None:
    """For an object with contents that is held upright: 20 deg, or a little more than its tilt now."""
    carried = state.carried
    if carried is None or not planner.contents(state, carried.body):
        return None
    now = float(tilts(planner, carried, state.position[None])[0])
    return _within(max(WITH_CONTENTS, now + _SLIPPED), planner, state, derived=True)


def _within(limit: float, planner: Planner, state: PlanningState, *, derived: bool = False) -> Kept | None:
    carried = state.carried
    if carried is None:
        return None

    def text(q: Array) -> str:
        tilt = math.degrees(float(tilts(planner, carried, q[None])[0]))
        why = ", which has contents" if derived else ""
        return f"'{carried.body}'{why} tilts by {tilt:.1f} deg, beyond `upright: {math.degrees(limit):g} deg`"

    reserve = 0.0 if derived else min(RESERVE, _SHARE * limit)
    return Kept(
        "upright", lambda q: limit - tilts(planner, carried, q), text, exempt=POURING, derived=derived, reserve=reserve
    )


def clause(spec: KeepSpec) -> str:
    return f"the held object is upright within {amount(spec.upright or 0.0, 'rad')}"


MEMBER = KeepMember("upright", opened, clause)
