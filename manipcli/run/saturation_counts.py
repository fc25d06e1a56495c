"""How often joints and actuators of a session were at a limit so far."""

from __future__ import annotations

from manipcli.control.saturation import KINDS
from manipcli.judge.saturations import Saturations
from manipcli.simulate.session import Session


def saturations_of(session: Session) -> Saturations:
    """The saturations of joints, by limit, and of actuators so far."""
    names = session.robot.joint_names
    joints = dict(zip(names, map(int, session.saturations), strict=True))
    kinds = {
        kind: dict(zip(names, map(int, counts), strict=True))
        for kind, counts in zip(KINDS, session.saturations_by_kind, strict=True)
    }
    actuators = dict(zip(session.actuation.names, map(int, session.actuation.saturations), strict=True))
    return Saturations(joints, actuators, session.ticks, kinds)


def saturated_since(before: Saturations, session: Session) -> str:
    """The saturations since `before`; "" without any."""
    saturated = str(saturations_of(session).since(before))
    return f"; {saturated}" if saturated else ""
