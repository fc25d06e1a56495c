"""Construction of MuJoCo's model of a robot and a scene by `MjSpec`.

The elements get numbered names: names of users may be empty, equal or contain any character.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import combinations
from types import ModuleType
from typing import Any, Final, NamedTuple

import numpy as np

from manipcli.core.geometry import Array, Transform, quat_from_matrix
from manipcli.description.elements import Inertial, Joint
from manipcli.model.drivetrain import reflected_inertia
from manipcli.model.normalised_urdf import inside_triangle
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Scene
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines.mujoco_attachment import add_welds
from manipcli.simulate.engines.mujoco_friction import friction_pairs, towards_robot
from manipcli.simulate.engines.mujoco_joints import HARD, add_joint, in_trees, name_of, place_in_parent
from manipcli.simulate.engines.mujoco_shapes import Shapes, wxyz

PIN_TIME: Final = (0.002, 1.0)
"""[s], damping ratio: how quickly a pin of a closed loop is pulled together; MuJoCo takes two steps at least."""
ROBOT, SCENE = 1, 2
"""Bits of collision masks: bodies collide with bodies and the robot; links with other links only by `_collide_only`."""
UNBOUNDED: Final = 1e9
"""[rad or m] Represents a missing limit on one side."""
MIN_INERTIA: Final = 1e-12
"""[kg m2] Smaller principal moments of inertia are raised to this: MuJoCo refuses 0."""


class ContactLaw(NamedTuple):
    """Compliance of contacts: time constant [s], and the depth [m] at which they reach their full impedance."""

    time: float
    depth: float


def contact_law(step: float, contact_time: float) -> ContactLaw:
    """The law for a physics step [s] and a wanted time constant [s], of which at least 4 steps are used.

    The impedance grows from 0 at the surface to 0.99 at this depth: 0.4 mm, more for steps above 1 ms. With MuJoCo's
    default, 0.9 at the surface, a sliding block hops: it touches in 14 % of the steps. With half this depth it does
    so at times, too.
    """
    return ContactLaw(max(contact_time, 4.0 * step), 4e-4 * max(1.0, step / 1e-3) ** 1.5)


@dataclass(frozen=True, slots=True)
class Built:
    """A compiled model.

    Attributes:
        model: `MjModel`. Its first n joints are the robot's moving joints, followed by those of things with joints and
            a free joint for each other movable body, at its centre of mass and with the axes of its frame O.
        parts: name of the part of each MuJoCo body: of a body of the scene, or `robot/<link>`.
        links: MuJoCo's number of the body of each link.
        joints: (n) MuJoCo's number of each moving joint of the robot.
        bodies: MuJoCo's number of each body of the scene.
        passive: MuJoCo's number of each joint of the scene.
    """

    model: Any
    parts: tuple[str, ...]
    links: dict[str, int]
    joints: tuple[int, ...]
    bodies: dict[str, int]
    passive: tuple[int, ...]


def build(
    mujoco: ModuleType,
    robot: RobotModel,
    scene: Scene,
    settings: EngineSettings,
    *,
    contact_time: float,
    impratio: float,
) -> Built:
    """Build the world.

    Args:
        mujoco: the library.
        robot, scene: what it contains.
        settings: step of the physics, and the links that collide with each other.
        contact_time: [s] time constant of contacts.
        impratio: stiffness ratio of friction to normal contact.

    Raises:
        InvalidInput: a mesh file cannot be used.
        ValueError: MuJoCo refuses the model.
    """
    spec = mujoco.MjSpec()
    _options(mujoco, spec, scene, settings.step, impratio)
    shapes = Shapes(mujoco, spec)
    law = contact_law(settings.step, contact_time)
    solver = {"solref": [law.time, 1.0], "solimp": [0.0, 0.99, law.depth, 0.5, 2.0]}
    bodies = _add_robot(mujoco, spec, robot, shapes, solver)
    if settings.self_collision:
        _collide_only(spec, robot, bodies, settings.self_collision)
    geoms: dict[str, list[str]] = {}
    made_of: dict[str, Any] = {}
    for k, body in in_trees(scene):
        geoms[body.name] = []
        moved = next(((n, joint) for n, joint in enumerate(scene.joints) if joint.child == body.name), None)
        if moved is None:
            made = spec.worldbody.add_body(name=f"body{k}", **_placed(body))
        else:
            number, joint = moved
            where = place_in_parent(joint, scene.body(joint.parent), body)
            made = made_of[joint.parent].add_body(name=f"body{k}", **(_placed(body) | where))
            add_joint(mujoco, made, joint, body, number)
        made_of[body.name] = made
        contact = {"contype": SCENE, "conaffinity": SCENE | ROBOT, "priority": 1, **solver}
        contact |= towards_robot(robot, body)
        for geometry in body.geometries:
            geoms[body.name] += shapes.add(made, geometry, Transform.of(xyz=-body.X_OI.p), **contact)
        if not body.fixed and moved is None:
            made.add_freejoint()
    for joint in scene.joints:  # MuJoCo lets a child collide with a fixed parent
        spec.add_exclude(bodyname1=made_of[joint.parent].name, bodyname2=made_of[joint.child].name)
    for one, two, friction, condim in friction_pairs(scene):
        for a in geoms[one]:
            for b in geoms[two]:
                spec.add_pair(geomname1=a, geomname2=b, friction=friction, condim=condim, **solver)
    if robot.holding is not None and robot.tool is not None:
        movable = [f"body{k}" for k, body in enumerate(scene.bodies) if not body.fixed]
        time = [2.0 * settings.step, 1.0]  # the stiffest that MuJoCo supports
        add_welds(mujoco, spec, bodies[robot.tool.link].name, movable, solimp=HARD, solref=time)
    model = spec.compile()
    parts = {spec.body(f"body{k}").id: body.name for k, body in enumerate(scene.bodies)}
    links = {name: made.id for name, made in bodies.items()}
    parts |= {k: f"robot/{name}" for name, k in links.items()}
    bodies_of = {body.name: spec.body(f"body{k}").id for k, body in enumerate(scene.bodies)}
    passive = tuple(spec.joint(name_of(k)).id for k in range(len(scene.joints)))
    joints = tuple(spec.joint(f"joint{k}").id for k, joint in enumerate(robot.joints) if joint.moves)
    return Built(model, tuple(parts.get(k, "world") for k in range(model.nbody)), links, joints, bodies_of, passive)


def _options(mujoco: ModuleType, spec: Any, scene: Scene, step: float, impratio: float) -> None:
    spec.compiler.degree = False
    spec.compiler.autolimits = False
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    option = spec.option
    option.timestep = step
    option.gravity = scene.gravity
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = impratio
    # A diverged world is an error; MuJoCo would put it back to its start. Islands would hide the compliance of
    # constraints, which `Motors.push` changes, from the solver.
    option.disableflags = mujoco.mjtDisableBit.mjDSBL_AUTORESET | mujoco.mjtDisableBit.mjDSBL_ISLAND


def _placed(body: Body) -> dict[str, Any]:
    """Pose and inertia of a body of the scene: at its centre of mass, with the axes of O."""
    X_OI = body.X_OI
    attributes: dict[str, Any] = {"pos": (body.X_WO @ X_OI).p, "quat": wxyz(body.X_WO.quat_xyzw)}
    if not body.fixed:
        attributes |= _inertia(body.mass, np.zeros(3), X_OI.R, body.inertia)
    return attributes


def _inertia(mass: float, p: Array, R: Array, inertia: Array) -> dict[str, Any]:
    """Mass and principal inertia; `p`, `R`: the inertial frame in that of the body."""
    inertia = inside_triangle(inertia)
    moments = np.diag(inertia)
    if np.any(inertia != np.diag(moments)):
        moments, axes = np.linalg.eigh(inertia)
        R = R @ (axes if np.linalg.det(axes) > 0.0 else -axes)
    return {
        "mass": mass, "ipos": p, "iquat": wxyz(quat_from_matrix(R)), "inertia": np.maximum(moments, MIN_INERTIA),
        "explicitinertial": True,
    }  # fmt: skip


def _add_robot(
    mujoco: ModuleType, spec: Any, robot: RobotModel, shapes: Shapes, solver: dict[str, Any]
) -> dict[str, Any]:
    """Add all links, depth-first as `RobotModel.joints`; returns their `MjsBody` by name.

    `solver`: attributes of geoms for the solver of contacts.
    """
    armature = dict(zip(robot.joint_names, reflected_inertia(robot), strict=True))
    root = spec.worldbody.add_body(name="link0", pos=robot.X_WB.p, quat=wxyz(robot.X_WB.quat_xyzw))
    bodies = {robot.root: root}
    for k, joint in enumerate(robot.joints):
        X = joint.X_PJ
        made = bodies[joint.parent].add_body(name=f"link{k + 1}", pos=X.p, quat=wxyz(X.quat_xyzw))
        bodies[joint.child] = made
        if joint.moves:
            moving = made.add_joint(name=f"joint{k}", armature=armature[joint.name], **_joint(mujoco, joint))
            moving.damping[0] = joint.damping  # the others are of a polynomial
    numbers = {joint.name: f"joint{k}" for k, joint in enumerate(robot.joints)}
    contact = {"contype": ROBOT, "conaffinity": SCENE, "priority": 0, **solver}
    for name, made in bodies.items():
        link = robot.link(name)
        for key, value in _link_inertia(link.inertial).items():
            setattr(made, key, value)
        for geometry in link.collisions:
            shapes.add(made, geometry, Transform.identity(), **contact)
    for joint in robot.moving_joints:
        if joint.mimic is not None and joint.mimic.curve is None:
            coupling = spec.add_equality(
                type=mujoco.mjtEq.mjEQ_JOINT,
                objtype=mujoco.mjtObj.mjOBJ_JOINT,
                name1=numbers[joint.name],
                name2=numbers[joint.mimic.joint],
                solimp=HARD,
            )
            coupling.data[:] = 0.0  # coefficients of a polynomial
            coupling.data[:2] = joint.mimic.offset, joint.mimic.multiplier
    for k, pin in enumerate(robot.pins):
        sites = [f"pin{k}{side}" for side in "ab"]
        for site, name, point in zip(sites, pin.links, pin.points, strict=True):
            bodies[name].add_site(name=site, pos=point)
        spec.add_equality(
            type=mujoco.mjtEq.mjEQ_CONNECT,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            name1=sites[0],
            name2=sites[1],
            solimp=HARD,
            solref=PIN_TIME,
        )
    return bodies


def _collide_only(spec: Any, robot: RobotModel, bodies: Mapping[str, Any], pairs: Collection[tuple[str, str]]) -> None:
    """Let only these pairs of links collide; `bodies`: `MjsBody` by link."""
    colliding = {frozenset(pair) for pair in pairs}
    shaped = [name for name in bodies if robot.link(name).collisions]
    for a, b in combinations(shaped, 2):
        if frozenset((a, b)) not in colliding:
            spec.add_exclude(bodyname1=bodies[a].name, bodyname2=bodies[b].name)
    for name in frozenset().union(*colliding):
        for geom in bodies[name].geoms:
            geom.conaffinity = ROBOT | SCENE
            geom.friction[0] = robot.friction**2  # MuJoCo takes the larger of two equal priorities


def _link_inertia(inertial: Inertial | None) -> dict[str, Any]:
    if inertial is None:
        return {"mass": 0.0, "ipos": np.zeros(3), "inertia": np.zeros(3), "explicitinertial": True}
    return _inertia(inertial.mass, inertial.X_LI.p, inertial.X_LI.R, inertial.inertia)


def _joint(mujoco: ModuleType, joint: Joint) -> dict[str, Any]:
    lower, upper = joint.limits.lower, joint.limits.upper
    limited = joint.type != "continuous" and (lower is not None or upper is not None)
    slides = joint.type == "prismatic"
    return {
        "type": mujoco.mjtJoint.mjJNT_SLIDE if slides else mujoco.mjtJoint.mjJNT_HINGE,
        "axis": joint.axis,
        "limited": limited,
        "range": [-UNBOUNDED if lower is None else lower, UNBOUNDED if upper is None else upper],
        "solimp_limit": HARD,
        "solref_limit": [0.004, 1.0],
        "solimp_friction": HARD,
    }
