"""Start of a run in the state of another run: the world of the engine, the controllers and their references."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from manipcli.core.errors import SimulationFailed
from manipcli.core.geometry import Array, Transform
from manipcli.model.collision import Carried
from manipcli.plan.planner import Planner
from manipcli.record.start_state import StartState
from manipcli.run.belief import Belief
from manipcli.scene.scene import Scene
from manipcli.simulate.session import Session

RESUMED: Final = 0.1
"""[s] Simulated, and recorded, before the first step: a state has no contact forces and no integrals of controllers."""


@dataclass(frozen=True, slots=True)
class _Joints:
    """Joints (n) as controllers measure them."""

    position: Array
    velocity: Array
    effort: Array


def scene_at(scene: Scene, state: StartState) -> Scene:
    """The scene with its movable bodies where they were."""
    poses = dict(zip(state.bodies, state.poses, strict=True))
    bodies = tuple(body if body.fixed else replace(body, X_WO=_pose(poses[body.name])) for body in scene.bodies)
    return replace(scene, bodies=bodies)


def _pose(numbers: Array) -> Transform:
    return Transform.of(xyz=numbers[:3], quat_xyzw=numbers[3:])


def restore_controllers(session: Session, state: StartState) -> None:
    """Switch to the controllers that were active; each holds its recorded reference, and the tool its object.

    Raises:
        SimulationFailed: a controller cannot be switched.
    """
    manager = session.manager
    known = {controller.name for controller in manager.controllers}
    result = manager.switch(
        [name for name in state.active if name in known and manager[name].name not in _active(session)],
        [name for name in state.inactive if name in _active(session)],
    )
    if not result.ok:
        raise SimulationFailed(
            f"the controllers of the start state cannot be active: {'; '.join(result.messages)}", time=0.0
        )
    # A controller that begins holds the position that it measures; here it measures the reference that it had.
    position = np.where(np.isnan(state.reference), state.position, state.reference)
    still = np.zeros(len(position))
    manager.update(0.0, _Joints(position, still, still.copy()), still.copy())
    if session.holder is not None and state.held:
        session.holder.hold(state.held)


def restore_belief(belief: Belief, state: StartState, planner: Planner, session: Session) -> None:
    """What the robot believed then; what the hand holds keeps its believed pose in it."""
    poses = dict(zip(state.bodies, state.planned, strict=True))
    for name, covariance in zip(state.uncertain, state.covariances, strict=True):
        belief.update(name, _pose(poses[name]), covariance.reshape(6, 6))
    now = session.engine.read()
    belief.look(now)
    if state.held:
        link = planner.tool_link
        X_WL = planner.kinematics.forward(now.position, link)
        belief.hold(Carried(state.held, link, X_WL.inverse() @ _pose(poses[state.held])), now)


def _active(session: Session) -> set[str]:
    manager = session.manager
    return {one.name for one, output in zip(manager.controllers, manager.outputs, strict=True) if output is not None}
