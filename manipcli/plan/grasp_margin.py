"""Margin of a planned grasp: the load that friction and the shape of the contacts hold with the grip force.

Model: rigid contacts with Coulomb friction at the points where the closed hand is predicted to touch the object. A
contact k presses with a normal force f_k >= 0 along its normal n_k, and rubs with at most mu f_k: its force lies in a
friction cone, here the pyramid of `EDGES` edges e inside it. The normal forces of a finger add up to at most the grip
force F, those of the palm, which only reacts, to at most F per finger. The object is held with a force d (3,) at its
centre of mass if

    sum_k,e w_ke e = -d,   sum_k,e w_ke (p_k - c) x e = 0,   w >= 0

has a solution. The largest s d for which it has one is a linear program (Kerr and Roth, Analysis of multifingered
hands, IJRR 4(4), 1986; Boyd and Wegbreit, Fast computation of optimal contact forces, IEEE T-RO 23(6), 2007).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.text import number_of
from manipcli.core.units import readable
from manipcli.model.grasp import friction_coefficient, friction_load
from manipcli.plan.attachment import MOST, AttachedForce
from manipcli.plan.grasp_contacts import PALM, GraspContact, finger_links, grasp_contacts
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.planner import Planner

EDGES: Final = 8
"""Edges of the pyramid inside a friction cone; it is at most 8 % narrower."""


@dataclass(frozen=True, slots=True)
class GraspMargin:
    """The margin of one grasp.

    Attributes:
        body: the object.
        force: [N] of each finger.
        friction: coefficient mu.
        weight: [N] of the object with its contents.
        ratio: largest multiple of its weight that is held, at rest and as it is grasped.
        acceleration: [m/s2] largest acceleration in any of 14 directions (axes and diagonals) that is held with the
            weight; 0 if the weight is not held.
        contacts: number of fingers that touch.
        contents: what lies in the object, which the hand carries, too.
        attachment: `suction (60 N)`: what holds instead of fingers, with `force` [N] as its limit; "" for fingers.
    """

    body: str
    force: float
    friction: float
    weight: float
    ratio: float
    acceleration: float
    contacts: int
    contents: tuple[str, ...] = ()
    attachment: str = ""

    @property
    def text(self) -> str:
        """One line of a report."""
        grip = (
            f"{number_of(self.contacts, 'finger')} at {readable(self.force, 'N')} each, "
            f"coefficient of friction {self.friction:.3g}"
        )
        grip = self.attachment or grip
        what = f"'{self.body}'{' with its contents' if self.contents else ''} ({readable(self.weight, 'N')})"
        if self.ratio < 1.0:
            return f"{what} is not held: {grip} holds {self.ratio:.2g} x its weight"
        most = f"{MOST:.0f} x or more" if self.ratio >= MOST else f"{self.ratio:.2g} x"
        return f"holds {most} the weight of {what} and {self.acceleration:.3g} m/s2 in any direction: {grip}"


def grasp_margin(planner: Planner, plan: StepPlan) -> GraspMargin | None:
    """The margin of the grasp with which a step ends; None if it grasps nothing, or without a stated grip force."""
    closed = _closed(planner, plan)
    if closed is None:
        return None
    joints, force, name = closed
    body, load = planner.scene.body(name), _load(planner, plan.end, name)
    mu = friction_coefficient(planner.robot, body)
    contacts: tuple[GraspContact, ...] = ()
    holding = planner.robot.holding
    held: HeldForce | AttachedForce
    if holding is not None:
        held = AttachedForce(planner, plan.end, load.centre, mu)
    else:
        contacts = grasp_contacts(planner, plan.end, joints)
        limits = force_limits(contacts, force, len(finger_links(planner.robot, joints)))
        held = HeldForce(contacts, limits, load.centre, mu)
    pull = planner.scene.gravity * load.mass
    weight = float(np.linalg.norm(planner.scene.gravity)) * load.mass
    ratio = held.most(pull) if weight else MOST
    acceleration = 0.0
    if ratio >= 1.0:
        acceleration = min(held.most(-direction, beside=pull) / load.mass for direction in DIRECTIONS)
    touching = len({contact.finger for contact in contacts} - {PALM})
    attachment = "" if holding is None else holding.limits
    return GraspMargin(name, force, mu, weight, ratio, acceleration, touching, load.contents, attachment)


def weakest_first(
    grasps: Sequence[tuple[str, GraspMargin]], of: Callable[[str], object]
) -> list[tuple[str, GraspMargin]]:
    """The grasps by what their step is part of, `of` its id, in the order of the first; the smallest margin first."""
    first: dict[object, int] = {}
    for step, _ in grasps:
        first.setdefault(of(step), len(first))
    return sorted(grasps, key=lambda grasp: (first[of(grasp[0])], round(grasp[1].ratio, 2)))


def carries(planner: Planner, plan: StepPlan) -> bool:
    """Whether the weight may be held, by a bound that needs no linear program: the forces along the vertical alone.

    It is the weight of the object with its contents.
    A finger that presses with F holds at most F (n . u + mu sqrt(1 - (n . u)^2)) against gravity, with u up and n the
    normal of one of its contacts: moments and the other components only lower that. A palm below the object holds all.
    True, too, where friction is too low for the hand at any level grasp: another grasp is then no better.
    """
    if planner.robot.holding is not None:
        margin = grasp_margin(planner, plan)
        return margin is None or margin.ratio >= 1.0
    closed, gravity = _closed(planner, plan), planner.scene.gravity
    g = float(np.linalg.norm(gravity))
    if closed is None or not g:
        return True
    joints, force, name = closed
    mu = friction_coefficient(planner.robot, planner.scene.body(name))
    most: dict[int, float] = {}
    for contact in grasp_contacts(planner, plan.end, joints):
        up = -float(contact.normal @ gravity) / g
        if contact.finger == PALM and up > 0.0:
            return True
        best = up + mu * math.sqrt(max(0.0, 1.0 - up * up)) if up < 1.0 / math.hypot(1.0, mu) else math.hypot(1.0, mu)
        most[contact.finger] = max(most.get(contact.finger, 0.0), best)
    weight = _load(planner, plan.end, name).mass * g
    hand = len(finger_links(planner.robot, joints))
    if friction_load(mu, [force] * hand) < weight:
        return True
    held = sum(share * (hand if finger == PALM else 1) for finger, share in most.items())
    return force * held >= weight


class _Load(NamedTuple):
    """What a hand carries: mass [kg], centre of mass (3,) in the world, and what lies in the object."""

    mass: float
    centre: Array
    contents: tuple[str, ...]


def _load(planner: Planner, state: PlanningState, name: str) -> _Load:
    """An object and its contents, as one rigid body."""
    contents = planner.contents(state, name)
    bodies = [planner.scene.body(each) for each in (name, *contents)]
    centres = [(planner.body_pose(state, body.name) @ body.X_OI).p for body in bodies]
    mass = sum(body.mass for body in bodies)
    if not contents:
        return _Load(mass, centres[0], ())
    moment = np.sum([body.mass * centre for body, centre in zip(bodies, centres, strict=True)], axis=0)
    return _Load(mass, moment / mass, contents)


def _closed(planner: Planner, plan: StepPlan) -> tuple[tuple[str, ...], float, str] | None:
    """Joints of the hand, force [N] and object of a step that grasps; None if it does not, or without a force.

    The force is that of the grip; of an attachment, its limit.
    """
    closing, holding = next((m for m in plan.motions if m.closes), None), planner.robot.holding
    if closing is None or plan.end.carried is None:
        return None
    grip, name = closing.grip, plan.end.carried.body
    if holding is not None:
        return () if grip is None else grip.joints, holding.force, name
    return None if grip is None or grip.force is None else (grip.joints, grip.force, name)


def force_limits(contacts: Sequence[GraspContact], force: float, count: int) -> dict[int, float]:
    """[N] The largest sum of normal forces by finger: the grip force; of the palm: that of all `count` fingers."""
    return {contact.finger: count * force if contact.finger == PALM else force for contact in contacts}


class HeldForce:
    """The forces on an object that its contacts hold.

    Args:
        contacts: of the hand with the object.
        limits: [N] largest sum of normal forces by finger.
        centre: (3,) [m] its centre of mass in the world.
        mu: coefficient of friction.
    """

    def __init__(self, contacts: Sequence[GraspContact], limits: dict[int, float], centre: Array, mu: float) -> None:
        wrenches: list[Array] = []
        pressed: list[int] = []
        # Moments in units of the object's own size: the program is then well scaled.
        reach = max((float(np.linalg.norm(contact.point - centre)) for contact in contacts), default=1.0) or 1.0
        for contact in contacts:
            for edge in cone_edges(contact.normal, mu):
                wrenches.append(np.concatenate((edge, np.cross(contact.point - centre, edge) / reach)))
                pressed.append(contact.finger)
        self._wrenches = np.array(wrenches).reshape(-1, 6).T
        self._fingers = np.array([[1.0 if k == finger else 0.0 for k in pressed] for finger in limits])
        self._limits = np.array([*limits.values()])

    def most(self, force: Array, *, beside: Array | None = None) -> float:
        """The largest s, at most `MOST`, for which s `force` (3,) [N] and `beside` (3,) [N] are held."""
        from scipy.optimize import linprog

        count = self._wrenches.shape[1]
        if not count:
            return 0.0
        along = np.concatenate((force, np.zeros(3)))[:, None]
        held = np.zeros(6) if beside is None else np.concatenate((beside, np.zeros(3)))
        result = linprog(
            np.append(np.zeros(count), -1.0),
            A_ub=np.hstack((self._fingers, np.zeros((len(self._limits), 1)))), b_ub=self._limits,
            A_eq=np.hstack((self._wrenches, along)), b_eq=-held,
            bounds=[*[(0.0, None)] * count, (0.0, MOST)], method="highs",
        )  # fmt: skip
        return max(0.0, float(result.x[-1])) if result.success else 0.0


def cone_edges(normal: Array, mu: float) -> Array:
    """(EDGES, 3) Edges of the friction pyramid about a unit normal, each with a component of 1 along it."""
    other = np.eye(3)[int(np.argmin(np.abs(normal)))]
    t1 = np.cross(normal, other)
    t1 /= np.linalg.norm(t1)
    t2 = np.cross(normal, t1)
    angles = np.arange(EDGES) * (2.0 * math.pi / EDGES)
    return np.asarray(normal + mu * (np.cos(angles)[:, None] * t1 + np.sin(angles)[:, None] * t2))


def _directions() -> Array:
    """(14, 3) The axes and the diagonals of space."""
    axes = [sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    diagonals = [np.array(signs) / math.sqrt(3.0) for signs in itertools.product((1.0, -1.0), repeat=3)]
    return np.array([*axes, *diagonals])


DIRECTIONS: Final = _directions()
