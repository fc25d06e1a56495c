"""Construction of Bullet's bodies for a scene and a robot."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from types import ModuleType
from typing import Final, cast

import numpy as np

from manipcli.core.errors import ManipcliError
from manipcli.core.geometry import Transform
from manipcli.description.elements import Inertial, Link, Mimic
from manipcli.model.normalised_urdf import MASSLESS, links_urdf
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body
from manipcli.shapes.mesh import clean_mesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Sphere
from manipcli.simulate.engines.pybullet_contacts import Vector
from manipcli.simulate.engines.pybullet_readback import body_differences

MIMIC_ERP: Final = 0.2
MIMIC_EFFORT: Final = 200.0
"""[N m or N] Effort limit of a mimic coupling."""
PIN_ERP: Final = 0.2
PIN_FORCE: Final = 1e4
"""[N] Largest force of a pin of a closed loop."""
MAX_SHAPES: Final = 16
"""Maximum size of an array of shapes: Bullet silently drops further ones."""


def add_body(p: ModuleType, client: int, body: Body, folder: Path) -> int:
    """Add a body of the scene and return its index; `folder` is for the mesh and description files for Bullet."""
    make = _from_shapes if len(body.geometries) <= MAX_SHAPES else _from_description
    k = make(p, client, body, folder)
    p.changeDynamics(
        k,
        -1,
        lateralFriction=body.friction,
        rollingFriction=body.rolling_friction,
        spinningFriction=body.spinning_friction,
        restitution=body.restitution,
        linearDamping=0.0,
        angularDamping=0.0,
        physicsClientId=client,
    )
    if not body.fixed:
        p.changeDynamics(k, -1, localInertiaDiagonal=list(np.diag(body.inertia)), physicsClientId=client)
    unlike = "; ".join(body_differences(p, client, k, body))
    if unlike:
        raise ManipcliError(f"Bullet loaded a different body than '{body.name}': {unlike}")
    return k


def _from_shapes(p: ModuleType, client: int, body: Body, folder: Path) -> int:
    kinds, half, radii, lengths, positions, quats = [], [], [], [], [], []
    files, scales = [], []
    for geometry in body.geometries:
        X_IS = body.X_OI.inverse() @ geometry.X_LS
        shape = geometry.shape
        kinds.append(_geometry_kind(p, shape))
        half.append([s / 2 for s in shape.size] if isinstance(shape, Box) else [0.0, 0.0, 0.0])
        radii.append(shape.radius if isinstance(shape, Sphere | Cylinder) else 0.0)
        lengths.append(shape.length if isinstance(shape, Cylinder) else 0.0)
        files.append(str(clean_mesh(shape, folder)) if isinstance(shape, Mesh) else "")
        scales.append(list(shape.scale) if isinstance(shape, Mesh) else [1.0, 1.0, 1.0])
        positions.append(list(X_IS.p))
        quats.append(list(X_IS.quat_xyzw))
    collision = p.createCollisionShapeArray(
        shapeTypes=kinds,
        halfExtents=half,
        radii=radii,
        lengths=lengths,
        fileNames=files,
        meshScales=scales,
        collisionFramePositions=positions,
        collisionFrameOrientations=quats,
        physicsClientId=client,
    )
    X_WI = body.X_WO @ body.X_OI
    made = p.createMultiBody(
        baseMass=0.0 if body.fixed else body.mass,
        baseCollisionShapeIndex=collision,
        basePosition=list(X_WI.p),
        baseOrientation=list(X_WI.quat_xyzw),
        physicsClientId=client,
    )
    return cast(int, made)


def _from_description(p: ModuleType, client: int, body: Body, folder: Path) -> int:
    """The body from a description file with one link, which may have any number of shapes."""
    X_IO = body.X_OI.inverse()
    shapes = [Geometry(X_LS=X_IO @ geometry.X_LS, shape=geometry.shape) for geometry in body.geometries]
    inertial = MASSLESS
    if not body.fixed:  # isotropic, as Bullet would otherwise rotate the frame; `add_body` sets the true inertia
        inertial = Inertial(mass=body.mass, X_LI=Transform.identity(), inertia=np.eye(3))
    file = folder / f"body_{p.getNumBodies(physicsClientId=client)}.urdf"
    file.write_text(links_urdf([Link("body", inertial, (), tuple(shapes))], (), folder), encoding="utf-8")
    X_WI = body.X_WO @ body.X_OI
    made = p.loadURDF(
        str(file),
        basePosition=list(X_WI.p),
        baseOrientation=list(X_WI.quat_xyzw),
        useFixedBase=body.fixed,
        flags=p.URDF_USE_INERTIA_FROM_FILE | p.URDF_USE_IMPLICIT_CYLINDER | p.URDF_IGNORE_VISUAL_SHAPES,
        physicsClientId=client,
    )
    return cast(int, made)


def _geometry_kind(p: ModuleType, shape: Box | Sphere | Cylinder | Mesh) -> int:
    if isinstance(shape, Box):
        return cast(int, p.GEOM_BOX)
    if isinstance(shape, Sphere):
        return cast(int, p.GEOM_SPHERE)
    if isinstance(shape, Cylinder):
        return cast(int, p.GEOM_CYLINDER)
    return cast(int, p.GEOM_MESH)


def centre(body: Body) -> tuple[Vector | None, tuple[float, ...] | None]:
    """Position of Bullet's frame of a body (that of its principal inertia) in the body's frame, and the inverse
    rotation; None for no offset."""
    x, y, z = (float(v) for v in body.X_OI.p)
    turned = None if np.allclose(body.X_OI.R, np.eye(3)) else tuple(body.X_OI.inverse().quat_xyzw)
    return (x, y, z) if x or y or z else None, turned


def collide_only(
    p: ModuleType, client: int, body: int, links: Mapping[int, str], pairs: Collection[tuple[str, str]]
) -> None:
    """Let only these pairs of links of `body` collide, of a body loaded with `URDF_USE_SELF_COLLISION`.

    `links`: their names by Bullet's indices.
    """
    colliding = {frozenset(pair) for pair in pairs}
    for (a, first), (b, second) in combinations(links.items(), 2):
        if frozenset((first, second)) not in colliding:
            p.setCollisionFilterPair(body, body, a, b, 0, physicsClientId=client)


def couple_mimics(p: ModuleType, client: int, robot: RobotModel, body: int, joints: Sequence[int]) -> None:
    """Couple the mimic joints of `body`; `joints`: Bullet's indices of the robot's moving joints."""
    for joint, index in zip(robot.moving_joints, joints, strict=True):
        if joint.mimic is not None and joint.mimic.curve is None:
            driver = joints[robot.joint_names.index(joint.mimic.joint)]
            _couple(p, client, body, index, driver, joint.axis.tolist(), joint.mimic)


def close_loops(p: ModuleType, client: int, robot: RobotModel, body: int, links: Mapping[str, int]) -> None:
    """Pin the links of closed loops of `body` to each other; `links`: Bullet's indices by name."""
    for pin in robot.pins:
        pivots = []
        for name, point in zip(pin.links, pin.points, strict=True):
            info = p.getDynamicsInfo(body, links[name], physicsClientId=client)
            X_LI = Transform.of(xyz=info[3], quat_xyzw=info[4])  # Bullet's frame of a link is that of its inertia
            pivots.append(X_LI.inverse().apply(point).tolist())
        constraint = p.createConstraint(
            body,
            links[pin.links[0]],
            body,
            links[pin.links[1]],
            jointType=p.JOINT_POINT2POINT,
            jointAxis=[0, 0, 0],
            parentFramePosition=pivots[0],
            childFramePosition=pivots[1],
            physicsClientId=client,
        )
        p.changeConstraint(constraint, erp=PIN_ERP, maxForce=PIN_FORCE, physicsClientId=client)


def _couple(p: ModuleType, client: int, body: int, follower: int, driver: int, axis: list[float], mimic: Mimic) -> None:
    """A gear constraint between the two joints' child links: follower - multiplier * driver = offset."""
    constraint = p.createConstraint(
        body,
        follower,
        body,
        driver,
        jointType=p.JOINT_GEAR,
        jointAxis=axis,
        parentFramePosition=[0, 0, 0],
        childFramePosition=[0, 0, 0],
        physicsClientId=client,
    )
    p.changeConstraint(
        constraint,
        gearRatio=-mimic.multiplier,
        relativePositionTarget=mimic.offset,
        erp=MIMIC_ERP,
        maxForce=MIMIC_EFFORT,
        physicsClientId=client,
    )
