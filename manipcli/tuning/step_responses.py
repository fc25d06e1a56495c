"""Step responses of the joints of a whole robot in the engine, with proposed gains, under gravity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.control.controller import ControllerOutput, FeedForward, JointState
from manipcli.control.feed_forward import ModelFeedForward
from manipcli.control.gain_design import StepAnswer, Tuned, Wish
from manipcli.control.manager import ControllerManager
from manipcli.control.pid import Pid
from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Array
from manipcli.core.units import EARTH_GRAVITY
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.quiet import stdout_to_stderr
from manipcli.simulate.session import Session
from manipcli.spec.controllers import Interface, Role
from manipcli.spec.controllers_file import ControllersSpec

RETURN: Final = 0.5
"""[s] Least time for a joint to return before the next joint steps."""


def simulated_answers(
    robot: RobotModel,
    spec: ControllersSpec,
    proposals: tuple[Tuned, ...],
    joints: Sequence[str],
    wish: Wish,
    start: Array,
) -> tuple[Tuned, ...]:
    """Step the joints one after the other and back, while all others hold.

    Args:
        robot: the whole robot.
        spec: the controllers, with the proposed gains.
        proposals: for all held joints.
        joints: those that step.
        wish: gives the control period.
        start: (n) the configuration.

    Returns:
        The proposals for `joints`, with their step responses.

    Raises:
        InvalidInput: the engine cannot hold this robot.
    """
    holders = [
        _Holder(name, [tuned for tuned in proposals if tuned.controller == name], spec, robot, start)
        for name in dict.fromkeys(tuned.controller for tuned in proposals)
    ]
    member = next(member for member in ENGINES if member.physics == "full")
    scene = Scene(bodies=(), frames=(), gravity=np.array(EARTH_GRAVITY))
    refused = member.refuses(robot, scene, None)
    if refused:
        raise InvalidInput([refusal.finding for refusal in refused])
    with stdout_to_stderr():
        engine = member.open(robot, scene, EngineSettings(wish.period / wish.substeps, wish.substeps, start))
        try:
            manager = ControllerManager(
                holders,
                joints=robot.joint_names,
                period=wish.period,
                following=robot.following,
                feed_forward=ModelFeedForward(robot, Kinematics(robot)),
            )
            session = Session(robot=robot, scene=scene, engine=engine, manager=manager, period=wish.period)
            for _ in range(round(RETURN / wish.period)):
                session.tick()
            answers = {
                tuned.joint: _stepped(session, holder, tuned)
                for holder in holders
                for tuned in holder.tuned
                if tuned.joint in joints
            }
        finally:
            engine.close()
    return tuple(replace(tuned, simulated=answers[tuned.joint]) for tuned in proposals if tuned.joint in joints)


class _Holder:
    """Holds joints with proposed gains at a reference that can step, in place of their controller."""

    role: Role = "other"
    senses_contact = False
    sensors = ()

    def __init__(self, name: str, tuned: list[Tuned], spec: ControllersSpec, robot: RobotModel, start: Array) -> None:
        own = spec.controllers[name]
        self.name, self.tuned = name, tuned
        self.joints = tuple(each.joint for each in tuned)
        self.interfaces: tuple[Interface, ...] = (tuned[0].interface,)
        weightless = getattr(own, "gravity_compensation", False) or getattr(own, "inverse_dynamics", False)
        self.feed_forward: FeedForward = "gravity" if weightless else "none"
        clamp = np.array([np.inf if each.i_clamp is None else each.i_clamp for each in tuned])
        self._pid = Pid(
            p=[each.p for each in tuned],
            i=[each.i for each in tuned],
            d=[each.d for each in tuned],
            i_min=-clamp,
            i_max=clamp,
        )
        self.output = ControllerOutput.of(len(tuned), 1)
        self.reference = self.output.position
        self.reference[:] = start[robot.indices(self.joints)]
        self.measured = self.reference.copy()

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        self.measured[:] = measured.position
        error = self.reference - measured.position
        self.output.command[:] = self._pid.update(error, period, -measured.velocity)
        return self.output

    def deactivate(self, time: float, reason: str = "") -> None:
        self._pid.reset()


def _stepped(session: Session, holder: _Holder, tuned: Tuned) -> StepAnswer:
    """Step the joint away from its upper limit, and back."""
    k = holder.joints.index(tuned.joint)
    limits = session.robot.joint(tuned.joint).limits
    before = float(holder.reference[k])
    beyond = limits.upper is not None and before + 2.0 * tuned.predicted.size > limits.upper
    size = -tuned.predicted.size if beyond else tuned.predicted.size
    rest = float(session.state.position[session.robot.joint_names.index(tuned.joint)])
    count = len(tuned.predicted.times)
    share = np.zeros(count)
    holder.reference[k] += size
    for tick in range(count):
        session.tick()
        share[tick] = (float(holder.measured[k]) - rest) / size
    holder.reference[k] = before
    for _ in range(max(count, round(RETURN / session.period))):
        session.tick()
    return StepAnswer(abs(size), tuned.predicted.times, share)
