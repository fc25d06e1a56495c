"""Prediction of a hand that closes on nothing that is named: where it stops, and what it must not touch."""

from __future__ import annotations

from dataclasses import replace

from manipcli.core.geometry import Array, frozen
from manipcli.model.collision import pairs
from manipcli.plan.hand import closed_on, moved_links
from manipcli.plan.motion import CLOSING, Grip, PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.sweep import refuse_collision


def blindly_closed(planner: Planner, state: PlanningState, grip: Grip) -> Array:
    """(n) Where the fingers stop: each at the first body that it touches, which may be what is to be grasped.

    A finger may touch any body, no deeper than it did before, but no other link of the robot.

    Raises:
        NotPlannable: a finger comes too near to another link before it meets a body.
    """
    robot, bodies = planner.robot, [body.name for body in planner.scene.bodies]
    fingers = moved_links(robot, grip.joints)
    touching = planner.checker.at(state.bodies, ignore=pairs({link.name for link in robot.links} - fingers, *bodies))
    closed, _ = closed_on(robot, touching, state.position, grip.joints, grip.target)
    stopped = replace(grip, target=frozen(closed[robot.indices(grip.joints)]))
    own = planner.query(state, pairs({link.name for link in robot.links}, *bodies))
    refuse_collision(planner, state, own, CLOSING, None, stopped)
    return closed
