"""Can the gains of a task work? Asked before anything moves, over the postures in which the robot will be while they
are those of an active controller: from the start, or from a step on that switches.

Each loop on the effort interface alone at the least inertia that it meets, then all of them together (`stability.py`);
and whether there is effort enough for gravity, for the planned motions and grasps, and for standing near where it is
to stand (`weak.py`). Joints on other interfaces: `drives.py`; those that the model of the robot leads: `modelled.py`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.control.joint_space_load import Configurations, JointSpaceLoad, load_of
from manipcli.control.stability import (
    Loop,
    is_stable,
    largest_damping,
    largest_integral,
    largest_stiffness,
    poles,
    unstable_share,
)
from manipcli.core.errors import Finding, NotPlannable, Place
from manipcli.core.geometry import Array
from manipcli.core.text import digits
from manipcli.flow.deadlines import too_short
from manipcli.flow.doubt import Doubt
from manipcli.flow.drives import RINGING, drive_doubts, driven_joints
from manipcli.flow.grips import strained, too_heavy, too_light, too_soft, too_swift, unheeded
from manipcli.flow.hinges import hinged
from manipcli.flow.load import Task
from manipcli.flow.modelled import modelled_doubts, modelled_joints
from manipcli.flow.plan import Plan, plan_task, start_position
from manipcli.flow.switches import active_in
from manipcli.flow.weak import Held, weak
from manipcli.model.kinematics import Kinematics
from manipcli.model.posture import posture, with_mimics
from manipcli.model.robot import RobotModel
from manipcli.plan.claims import Claims
from manipcli.simulate.engines import ENGINES
from manipcli.spec.controllers import GainsSpec, GripperSpec, JointTrajectorySpec

PER_MOTION: Final = 12
"""Configurations that are looked at of each planned motion."""
TOGETHER: Final = 16
"""Configurations at which all loops are looked at together: those in which they are tightest."""
SWINGING: Final = 0.1
"""The least damping ratio that passes without a word: it overshoots by 73 %."""


def gain_findings(task: Task, plan: Plan | None = None) -> tuple[Finding, ...]:
    """Warnings about gains, efforts and timeouts, with the number that would do, each at its place in its file.

    On an engine without physics gains, efforts and forces are not doubted: it makes references come true anyhow.

    Args:
        task: what is run.
        plan: of it; None: it is planned here; where that is not possible, that is told, and named poses are looked at.
    """
    robot, spec = task.robot, task.controllers
    in_steps = tuple(active_in(task.spec.steps, Claims.of(spec), robot))
    shifts = {
        active: (_loops(task, active), driven_joints(task, active), modelled_joints(task, active))
        for active in dict.fromkeys(in_steps)
    }
    found: list[Finding] = []
    if plan is None:
        try:
            plan = plan_task(task)
        except NotPlannable as refusal:
            found += refusal.findings
    found += too_swift(task)
    if plan is not None:
        found += too_short(task, plan)
    if ENGINES[task.spec.simulation.engine].physics != "full":
        return tuple(found)
    if plan is not None:
        found += strained(task, plan)
        found += too_light(task, plan)
        found += too_heavy(task, plan)
        found += too_soft(task, plan)
        found += unheeded(task, plan)
        found += hinged(task, plan)
    kinematics = Kinematics(robot, gravity=task.scene.gravity)
    samples = None if plan is None else _planned(task, plan)
    named = Configurations.at_rest(named_postures(robot, start_position(task)))
    told: set[tuple[str, Place | None, str]] = set()
    for active, (loops, drives, modelled) in shifts.items():
        postures = named if samples is None else _while(samples, [there == active for there in in_steps])
        doubts: list[Doubt] = []
        if loops:
            load = load_of(robot, kinematics, [loop.joint for loop in loops], postures)
            doubts += _doubts(task, loops, load, postures, planned=plan is not None)
        if drives:
            doubts += drive_doubts(task, drives, kinematics, postures, planned=plan is not None)
        if modelled:
            doubts += modelled_doubts(task, modelled, kinematics, postures, planned=plan is not None)
        # Who stays while others change is looked at again: each doubt about each of its joints is told once.
        found += [doubt.finding for doubt in doubts if doubt.what not in told]
        told.update(doubt.what for doubt in doubts)
    return tuple(found)


def named_postures(robot: RobotModel, start: Array) -> Array:
    """(T, n): the start, and every named pose with the other joints as at the start."""
    return np.array([start, *(posture(robot, pose.name, rest=start) for pose in robot.poses)])


@dataclass(frozen=True, slots=True, eq=False)
class _Sample:
    """All joints (n) in a motion of a step: 1 + its index, or 0 before the first of them."""

    step: int
    position: Array
    velocity: Array
    acceleration: Array


def _planned(task: Task, plan: Plan) -> tuple[_Sample, ...]:
    """Samples of all motions, the other joints as they are then."""
    robot = task.robot
    here, still = np.array(plan.start.position), np.zeros(len(robot.joint_names))
    samples = [_Sample(0, here, still, still)]
    for k, step in enumerate(plan.steps, 1):
        for motion in step.plan.motions:
            if motion.trajectory is None:
                continue
            at = robot.indices(motion.trajectory.names)
            times = np.linspace(0.0, float(motion.trajectory.times[-1]), PER_MOTION)
            for q, v, a in zip(*motion.trajectory.sample(times), strict=True):
                position, velocity, acceleration = here.copy(), still.copy(), still.copy()
                position[at], velocity[at], acceleration[at] = q, v, a
                samples.append(_Sample(k, with_mimics(robot, position), velocity, acceleration))
            here = samples[-1].position
        here = np.array(step.plan.end.position)
        samples.append(_Sample(k, here, still, still))
    return tuple(samples)


def _while(samples: tuple[_Sample, ...], there: list[bool]) -> Configurations:
    """Those of the steps in which they are `there`; as in the samples, the first is the time before all steps."""
    chosen = [one for one in samples if there[one.step]]
    return Configurations(
        np.array([one.position for one in chosen]),
        np.array([one.velocity for one in chosen]),
        np.array([one.acceleration for one in chosen]),
    )


def _loops(task: Task, active: Collection[str]) -> tuple[Held, ...]:
    period = task.spec.simulation.control_period
    found = []
    for name, spec in task.controllers.controllers.items():
        if name not in active or not isinstance(spec, JointTrajectorySpec | GripperSpec):
            continue
        if spec.interfaces != ("effort",):
            continue
        ticks = spec.ticks(period)
        weightless = spec.gravity_compensation or (isinstance(spec, JointTrajectorySpec) and spec.inverse_dynamics)
        for joint in spec.joints:
            tolerance = None
            if isinstance(spec, JointTrajectorySpec) and joint in spec.constraints.joints:
                own = spec.constraints.joints[joint]
                tolerance = own.goal if own.goal is not None else own.trajectory
            gains = spec.gains.get(joint, GainsSpec())
            place = task.controllers_file.place("controllers", name, "gains", joint)
            found.append(Held(joint, gains, ticks, weightless, tolerance, place))
    return tuple(found)


def _doubts(
    task: Task, loops: tuple[Held, ...], load: JointSpaceLoad, postures: Configurations, *, planned: bool
) -> Iterator[Doubt]:
    where = f"{'planned' if planned else 'named'} postures"
    simulation = task.spec.simulation
    substeps = round(simulation.control_period / simulation.step)
    own, held = load.own_inertia, load.held_inertia
    sound = True
    for k, loop in enumerate(loops):
        gains = loop.gains
        least, most = float(own[:, k].min()), float(held[:, k].max())
        one = Loop.of_joint(
            least,
            p=gains.p,
            d=gains.d,
            i=gains.i,
            damping=float(load.damping[k]),
            period=loop.ticks * simulation.control_period,
            substeps=loop.ticks * substeps,
            delay=math.ceil(load.latency[k] / loop.ticks),
        )
        unit = task.robot.joint(loop.joint).inertia_unit
        finding = _unstable(loop.joint, one, f"inertia {least:.2g} {unit}, the least over the {where}")
        if finding is None:
            slow = Loop.of_joint(most, p=gains.p, d=gains.d, damping=float(load.damping[k]), period=one.period)
            finding = _swings(loop.joint, slow, f"inertia {most:.2g} {unit}, the most over the {where}")
        else:
            sound = False
        if finding is not None:
            code, message, hint = finding
            yield Doubt(loop.joint, Finding(code, message, loop.place, hint, "warning"))
        velocity = postures.velocity[:, task.robot.joint_names.index(loop.joint)]
        yield from weak(task.robot, loop, load, k, velocity=velocity, planned=planned)
    if sound:
        yield from _together(task, loops, load, substeps)


def _unstable(joint: str, loop: Loop, inertia: str) -> tuple[str, str, str | None] | None:
    """(code, message, hint) of a loop that diverges or rings."""
    p, d, i = float(loop.p[0]), float(loop.d[0]), float(loop.i[0])
    kp, kd, ki = f"p {digits(p)}", f"d {digits(d)}", f"i {digits(i)}"
    at = f"at {1e3 * loop.period:.3g} ms"
    if loop.delay is not None and loop.delay[0]:
        at += f" and {int(loop.delay[0])} ticks of latency"
    if is_stable(loop):
        worst = next((z for z in poles(loop) if z.real < 0.0 and abs(z.imag) < 1e-9), 0.0)
        if abs(worst) <= RINGING:
            return None
        most = largest_damping(loop)
        message = f"{joint}: {kd} rings {at}: its effort turns round every tick; {inertia}"
        return "CTRL150", message, f"it is unstable above {digits(most)}; stay below half of that"
    most = largest_damping(loop)
    if 0.0 < most < d:
        message = f"{joint}: {kd} is unstable above {digits(most)} {at}; {inertia}"
        return "CTRL150", message, f"stay below half of that: d {digits(0.5 * most)}"
    swift = largest_integral(loop)
    if 0.0 < swift < i:
        message = f"{joint}: {ki} with {kp} and {kd} is unstable above {digits(swift)} {at}; {inertia}"
        return "CTRL150", message, f"stay below half of that: i {digits(0.5 * swift)}"
    if most == 0.0:
        stiffest = largest_stiffness(loop)
        if 0.0 < stiffest < p:
            message = f"{joint}: {kp} with {kd} is unstable above {digits(stiffest)} {at}; {inertia}"
            return "CTRL150", message, "lower p; `manipcli tune` proposes both"
        message = f"{joint}: {kp}, {ki} and {kd} are unstable {at}; {inertia}"
        return "CTRL150", message, "`manipcli tune` proposes gains that are not"
    need = 1.4 * math.sqrt(p * float(loop.mass[0, 0]))
    message = f"{joint}: {kp}{f', {ki}' if i else ''} with {kd} swings up {at}; {inertia}"
    return "CTRL150", message, f"d {digits(min(need, 0.5 * most))} damps it"


def _swings(joint: str, loop: Loop, inertia: str) -> tuple[str, str, str | None] | None:
    p, d = float(loop.p[0]), float(loop.d[0])
    slowest = poles(loop)[0]
    if abs(slowest.imag) < 1e-12 or not 0.0 < abs(slowest) < 1.0:
        return None
    s = complex(np.log(slowest)) / loop.period
    ratio = -s.real / abs(s)
    if ratio >= SWINGING:
        return None
    message = (
        f"{joint}: p {digits(p)} with d {digits(d)} swings at {abs(s) / math.tau:.2g} Hz with a damping ratio of "
        f"{ratio:.2g}; {inertia}"
    )
    return "CTRL153", message, f"d {digits(1.4 * math.sqrt(p * float(loop.mass[0, 0])))} gives 0.7"


def _together(task: Task, loops: tuple[Held, ...], load: JointSpaceLoad, substeps: int) -> Iterator[Doubt]:
    """Loops that are stable one by one and not together, at the postures in which they are tightest."""
    period = task.spec.simulation.control_period
    if any(loop.ticks != 1 for loop in loops):
        return  # of different rates there is no one tick to look at
    p, d, i = (np.array([getattr(loop.gains, key) for loop in loops]) for key in ("p", "d", "i"))
    tightest = np.argsort(-(d / load.own_inertia).max(axis=1))[:TOGETHER]
    for k in tightest:
        latency = np.array(load.latency)
        whole = Loop(load.mass[k], p, d, i, load.damping, period, substeps, latency)
        if is_stable(whole):
            continue
        pole, share = unstable_share(whole)
        worst = [j for j in np.argsort(-share) if share[j] > 0.1][:3]
        names = ", ".join(f"{loops[j].joint} (d {digits(d[j])})" for j in worst)
        message = (
            f"each loop is stable, all together are not at {1e3 * period:.3g} ms: a pole at {abs(pole):.3g}, "
            f"mostly of {names}"
        )
        yield Doubt("", Finding("CTRL154", message, loops[worst[0]].place, "lower their d", "warning"))
        return
