"""Gain proposals for the controllers of a robot, with an optional test of the whole robot in the engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from manipcli.control.control_loop import InverseDynamicsLoop, NoLoop, PidLoop
from manipcli.control.controllers import CONTROLLERS
from manipcli.control.gain_design import MARGIN, Tuned, Wish, least_margin, tightness, tune_efforts, tune_velocity
from manipcli.control.joint_space_load import Configurations, JointSpaceLoad, load_of
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean, distinguished, listed
from manipcli.model.configuration import configuration, named_configurations, with_mimics
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.spec import load
from manipcli.spec.controllers import ControllerSpec, GainsSpec
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Located
from manipcli.spec.resolved import as_written
from manipcli.task.robot_file import read_robot
from manipcli.task.vocabulary import controllers_spec
from manipcli.tuning.extreme_configurations import climbed
from manipcli.tuning.step_responses import simulated_answers

if TYPE_CHECKING:
    from manipcli.replay.curves import Chart

__all__ = ["Tuning", "Wish", "chart_of", "tune", "written"]

RANDOM_CONFIGURATIONS: Final = 60
"""Number of random configurations within the limits, in addition to the named ones; always the same."""
WIDE: Final = 2.0
"""[rad or m] Range of a joint without limits, to each side of its start."""
HOPELESS: Final = 0.01
"""Least share of the asked bandwidth for useful gains."""
ROUNDS: Final = 12
"""Number of rounds of reducing all gains at the configuration with the least margin."""


@dataclass(frozen=True, slots=True)
class Tuning:
    """Proposed gains, the controllers file with them, and notes for the user."""

    robot: str
    wish: Wish
    joints: tuple[Tuned, ...]
    controllers: ControllersSpec
    notes: tuple[str, ...]


def tune(
    robot_path: Path,
    controllers_path: Path,
    wish: Wish,
    *,
    joints: Sequence[str] = (),
    step: float = 0.02,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
    simulated: bool = False,
) -> Tuning:
    """Propose gains for the loops of a controllers file.

    Args:
        robot_path, controllers_path: the two files.
        wish: bandwidth, damping and control period.
        joints: only these joints; (): all joints with gains.
        step: size of a step [rad] that must not saturate; prismatic joints: a tenth [m].
        package_path, allow_outside: see `read_robot`.
        simulated: also step every joint of the whole robot in the engine, under gravity.

    Raises:
        InvalidInput: a file is invalid, a joint has no loop, no controller has gains, or no gains are stable.
    """
    robot_file, robot, _ = read_robot(robot_path, package_path=package_path, allow_outside=allow_outside)
    file = load.load_controllers(controllers_path, model=controllers_spec(), args=robot_file.spec.args)
    tuner = _Tuner(robot, file, wish, step)
    everything = tuner.proposals()
    there = [tuned.joint for tuned in everything]
    for joint in joints:
        if joint not in there:
            hint = did_you_mean(joint, there, kind="joints with gains")
            raise InvalidInput([Diagnostic("TUNE001", f"joint '{joint}' has no loop to propose gains for", hint=hint)])
    found = tuple(tuned for tuned in everything if not joints or tuned.joint in joints)
    if simulated:
        found = simulated_answers(
            robot, file.spec, everything, [tuned.joint for tuned in found], wish, configuration(robot)
        )
    return Tuning(robot.name, wish, found, _with_gains(file.spec, found), tuner.notes)


def written(tuning: Tuning, controllers_path: Path) -> str:
    """The controllers file with the proposed gains."""
    wish = tuning.wish
    head = (
        f"# {controllers_path.name} with the gains of `manipcli tune --bandwidth '{wish.bandwidth:g} Hz' --damping "
        f"{wish.damping:g}`, for a control period of {1e3 * wish.period:g} ms.\n"
    )
    return head + as_written(tuning.controllers)


def chart_of(tuning: Tuning) -> Chart:
    """The step responses, predicted and simulated, with one panel per controller."""
    from manipcli.replay.curves import Chart, Curve, Panel

    panels, end = [], 0.1
    for name in dict.fromkeys(tuned.controller for tuned in tuning.joints):
        curves = []
        for tuned in tuning.joints:
            for log, answer in (("predicted", tuned.predicted), ("simulated", tuned.simulated)):
                if tuned.controller == name and answer is not None:
                    log = log if any(each.simulated for each in tuning.joints) else ""
                    curves.append(Curve(tuned.joint, tuned.joint, log, answer.times, 100.0 * answer.share))
                    end = max(end, min(1.6 * answer.settling_time, float(answer.times[-1])))
        panels.append(Panel(name, "step response", "%", tuple(curves)))
    return Chart(title=f"{tuning.robot}: step responses", panels=tuple(panels), steps=(), start=0.0, end=end)


class _Tuner:
    def __init__(self, robot: RobotModel, file: Located[ControllersSpec], wish: Wish, step: float) -> None:
        self._robot, self._file, self._wish = robot, file, wish
        self._kinematics = Kinematics(robot)
        self._step = step
        self.notes: tuple[str, ...] = ()
        known = {joint.name for joint in robot.moving_joints}
        missing = [
            Diagnostic("TUNE002", f"controller '{name}': joint '{joint}' is not in robot '{robot.name}'",
                    file.place("controllers", name, "joints", k), did_you_mean(joint, known, kind="joints"))
            for name, spec in file.spec.controllers.items() for k, joint in enumerate(spec.joints)
            if joint not in known
        ]  # fmt: skip
        if missing:
            raise InvalidInput(missing)

    def proposals(self) -> tuple[Tuned, ...]:
        """Proposals for every loop in the file; for several loops on one joint, for the active one."""
        efforts: list[tuple[str, str, bool]] = []
        velocities: list[tuple[str, str]] = []
        elsewhere = self._elsewhere()
        for name, spec in self._file.spec.controllers.items():
            if name in elsewhere:
                note = f"{name}: its gains are unchanged, it shares joints with {elsewhere[name]}"
                self.notes += (f"{note}; set `active` on the controller to tune",)
                continue
            match CONTROLLERS[spec.type].loop(spec):
                case PidLoop(tunable=True, carries_weight=carried):
                    if spec.interfaces == ("effort",):
                        efforts += [(name, joint, carried) for joint in spec.joints]
                    else:
                        velocities += [(name, joint) for joint in spec.joints]
                case PidLoop():
                    self.notes += (f"{name}: no gains are proposed for the type {spec.type}",)
                case InverseDynamicsLoop():
                    note = f"the type {spec.type} needs no gains, its `bandwidth` and `damping_ratio` define them"
                    self.notes += (f"{name}: {note}",)
                case NoLoop(reason) if spec.interfaces:
                    self.notes += (f"{name}: {reason}",)
        if not efforts and not velocities:
            message = "no controller has a loop to propose gains for"
            hint = "; ".join(self.notes) or None
            raise InvalidInput([Diagnostic("TUNE001", message, self._file.place("controllers"), hint=hint)])
        return self._of_efforts(efforts) + self._of_velocities(velocities)

    def _elsewhere(self) -> dict[str, str]:
        """Controllers that share joints with another loop -> that controller; active controllers come first."""
        owners: dict[str, str] = {}
        found: dict[str, str] = {}
        for name, spec in sorted(self._file.spec.controllers.items(), key=lambda item: not item[1].active):
            if _tunable(spec) is not None:
                first = next((owners[joint] for joint in spec.joints if joint in owners), None)
                if first is None:
                    owners |= dict.fromkeys(spec.joints, name)
                else:
                    found[name] = first
        return found

    def _of_efforts(self, loops: list[tuple[str, str, bool]]) -> tuple[Tuned, ...]:
        if not loops:
            return ()
        names = [name for name, _, _ in loops]
        joints = [joint for _, joint, _ in loops]
        carried = np.array([each for _, _, each in loops])
        steps = np.array([self._step_of(joint) for joint in joints])
        pressing = np.array([self._pressing(name, joint) for name, joint, _ in loops])
        known = self._configurations().position
        heaviest = [self._extreme(joints, partial(_inertia, k), known) for k in range(len(joints))]
        lightest = [self._extreme(joints, partial(_lightness, k), known) for k in range(len(joints))]
        known = np.vstack([known, *heaviest, *lightest])
        for _ in range(ROUNDS):
            met = self._load(joints, known)
            tuned = tune_efforts(names, met, self._wish, steps=steps, carried=carried, pressing=pressing)
            tight = partial(tightness, tuned=tuned, wish=self._wish)
            tightest = self._extreme(joints, tight, known, starts=3)
            margin = least_margin(self._load(joints, tightest[None]), tuned, self._wish)
            if margin >= MARGIN:
                break
            known = np.vstack([known, tightest])
        self._refuse_hopeless(tuned)
        raised = [each.joint for each in tuned if each.frequency > self._wish.bandwidth * (1.0 + 1e-9)]
        if raised:
            self.notes += (
                f"Gains raised so that a finger reaches its full effort over half its travel: {listed(raised)}.",
            )
        if margin < MARGIN:
            self._check_margin(margin)
        return tuned

    def _load(self, joints: list[str], q: Array) -> JointSpaceLoad:
        return load_of(self._robot, self._kinematics, joints, Configurations.at_rest(q))

    def _extreme(
        self, joints: list[str], score: Callable[[JointSpaceLoad], Array], known: Array, *, starts: int = 1
    ) -> Array:
        """(n) the configuration with the largest score of the joint-space load, searched from `known` (T, n)."""
        return climbed(self._robot, lambda q: score(self._load(joints, q)), known, *self._range(), starts=starts)

    def _check_margin(self, margin: float) -> None:
        """Add a note on a gain margin below `MARGIN`; raises InvalidInput for unstable gains (below 1)."""
        there = f"in the last configuration found, after {ROUNDS} rounds of reducing all gains"
        if margin < 1.0:
            hint = "use a shorter `--period` or a lower `--bandwidth`"
            message = f"no gains are stable in all configurations: they are unstable {there}"
            raise InvalidInput([Diagnostic("TUNE003", message, self._file.place("controllers"), hint)])
        left, wanted = distinguished(margin, MARGIN, form=".2g")
        self.notes += (f"Gain margin {left} of all loops together is below {wanted} {there}.",)

    def _refuse_hopeless(self, tuned: Sequence[Tuned]) -> None:
        """Raise InvalidInput if the stable bandwidth is below `HOPELESS`."""
        period = f"{1e3 * self._wish.period:g} ms"
        hint = "use a shorter `--period` or less actuator latency, or check the masses and inertias for a large ratio"
        hopeless = []
        for proposal in tuned:
            if proposal.limited_by not in ("control step", "other joints"):
                continue
            if proposal.frequency < HOPELESS * self._wish.bandwidth:
                unit = self._robot.joint(proposal.joint).inertia_unit
                message = (
                    f"{proposal.joint}: no useful gains are stable at {period}: bandwidth below "
                    f"{proposal.frequency:.2g} Hz instead of {self._wish.bandwidth:g} Hz; "
                    f"its inertia is {proposal.least:.2g} to {proposal.inertia:.2g} {unit}"
                )
                place = self._file.place("controllers", proposal.controller, "gains", proposal.joint)
                hopeless.append(Diagnostic("TUNE003", message, place, hint))
        if hopeless:
            raise InvalidInput(hopeless)

    def _of_velocities(self, loops: list[tuple[str, str]]) -> tuple[Tuned, ...]:
        if not loops:
            return ()
        found = load_of(self._robot, self._kinematics, [joint for _, joint in loops], self._configurations())
        tuned = []
        for k, (name, joint) in enumerate(loops):
            limits = self._robot.joint(joint).limits
            inertia = float(found.held_inertia[:, k].max())
            left = float(found.effort[k] - np.abs(found.gravity[:, k]).max())
            fastest = np.inf if limits.acceleration is None else limits.acceleration
            tuned.append(
                tune_velocity(
                    name,
                    joint,
                    self._wish,
                    step=self._step_of(joint),
                    inertia=inertia,
                    velocity=np.inf if limits.velocity is None else limits.velocity,
                    acceleration=min(fastest, max(left, 0.1 * float(found.effort[k])) / inertia),
                )
            )
        return tuple(tuned)

    def _pressing(self, controller: str, joint: str) -> float:
        """The p gain that gives the full effort of a hand joint over half its travel; 0 for others, and if unknown.

        An object that stops a finger on its way leaves it the rest of the travel to press with.
        """
        spec, limits = self._file.spec.controllers[controller], self._robot.joint(joint).limits
        hand = CONTROLLERS[spec.type].hand
        if hand is None:
            return 0.0
        effort = min((each for each in (limits.effort, hand(spec).max_effort) if each), default=0.0)
        lower, upper = limits.range
        return 2.0 * effort / (upper - lower) if 0.0 < upper - lower < np.inf else 0.0

    def _step_of(self, joint: str) -> float:
        return self._step * (0.1 if self._robot.joint(joint).type == "prismatic" else 1.0)

    def _configurations(self) -> Configurations:
        """Named configurations, and random ones from the whole range of the joints."""
        start = configuration(self._robot)
        rng = np.random.default_rng(0)
        spread = [with_mimics(self._robot, q) for q in rng.uniform(*self._range(), (RANDOM_CONFIGURATIONS, len(start)))]
        return Configurations.at_rest(np.vstack([named_configurations(self._robot, start), *spread]))

    def _range(self) -> tuple[Array, Array]:
        """(n), (n) lower and upper ends of the joint ranges."""
        start = configuration(self._robot)
        lower, upper = np.array([joint.limits.range for joint in self._robot.moving_joints]).reshape(-1, 2).T
        return np.where(np.isneginf(lower), start - WIDE, lower), np.where(np.isposinf(upper), start + WIDE, upper)


def _tunable(spec: ControllerSpec) -> PidLoop | None:
    """The loop of a controller if gains can be proposed for it; else None."""
    loop = CONTROLLERS[spec.type].loop(spec)
    return loop if isinstance(loop, PidLoop) and loop.tunable else None


def _inertia(k: int, load: JointSpaceLoad) -> Array:
    """(T,) inertia of joint `k` with all others fixed."""
    return load.held_inertia[:, k]


def _lightness(k: int, load: JointSpaceLoad) -> Array:
    """(T,) inverse of the inertia of joint `k` with all others free."""
    return np.asarray(1.0 / load.own_inertia[:, k])


def _with_gains(spec: ControllersSpec, tuned: Sequence[Tuned]) -> ControllersSpec:
    changed = dict(spec.controllers)
    for proposal in tuned:
        own = changed[proposal.controller]
        loop = _tunable(own)
        assert loop is not None
        old = loop.gains.get(proposal.joint, GainsSpec())
        update: dict[str, float | None] = {"p": proposal.p, "d": proposal.d}
        if proposal.i or old.i:
            update |= {"i": proposal.i, "i_clamp": proposal.i_clamp}
        if proposal.interface == "velocity":
            update["ff_velocity_scale"] = 1.0
        gains = {**loop.gains, proposal.joint: old.model_copy(update=update)}
        changed[proposal.controller] = own.model_copy(update={"gains": gains})
    return spec.model_copy(update={"controllers": changed})
