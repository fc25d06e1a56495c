"""Motion of links against Pinocchio, wrenches against statics; the kernels give the bits of the laws in Python."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform, cross, frozen
from manipcli.description.elements import Joint, JointLimits, JointType, Link
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.simulate.engines.pybullet_attachment import Pull
from manipcli.simulate.engines.pybullet_wrench import WrenchSensors
from manipcli.simulate.link_motion import Chain, LinkMomenta, PlaceMotion

G = np.array([0.3, -0.2, -9.7])
PERIOD = 1e-3
KINDS: tuple[JointType, ...] = ("revolute", "fixed", "prismatic", "continuous", "fixed", "revolute", "prismatic")
BULLET = 7
"""Number of the robot among the bodies."""


def pose(rng: np.random.Generator) -> Transform:
    return Transform.of(xyz=rng.uniform(-0.5, 0.5, 3), rpy=rng.uniform(-3.0, 3.0, 3))


def robot(rng: np.random.Generator) -> RobotModel:
    """A tree: every link on any link before it."""
    joints = []
    for k, kind in enumerate(KINDS):
        axis = rng.normal(size=3)
        parent = f"l{rng.integers(0, k + 1)}"
        axis = frozen(axis / np.linalg.norm(axis))
        joints.append(Joint(f"j{k}", kind, parent, f"l{k + 1}", pose(rng), axis, JointLimits(-3.0, 3.0, 5.0, 200.0)))
    links = tuple(Link(f"l{k}", None, (), ()) for k in range(len(KINDS) + 1))
    return RobotModel("tree", "l0", links, tuple(joints), (), (), (), pose(rng), "")


def moving(rng: np.random.Generator, model: RobotModel) -> tuple[Array, Array, Array]:
    q, v, a = rng.normal(size=(3, len(model.joint_names)))
    return q, v, a


@pytest.mark.parametrize("seed", range(20))
def test_an_imu_feels_the_acceleration_that_pinocchio_computes(seed: int) -> None:
    import pinocchio as pin

    rng = np.random.default_rng(seed)
    model = robot(rng)
    q, v, a = moving(rng, model)
    link, X_LS = f"l{rng.integers(1, len(KINDS) + 1)}", pose(rng)
    kinematics = Kinematics(model)
    frames = kinematics.model.copy()
    of = frames.frames[frames.getFrameId(link)]
    placement = of.placement * pin.SE3(np.array(X_LS.R), np.array(X_LS.p))
    S = frames.addFrame(pin.Frame("S", of.parentJoint, 0, placement, pin.FrameType.OP_FRAME), False)
    data = frames.createData()
    pin.forwardKinematics(frames, data, q, v, a)
    X_WS = pin.updateFramePlacement(frames, data, S)
    felt = pin.getFrameClassicalAcceleration(frames, data, S, pin.ReferenceFrame.LOCAL).linear - X_WS.rotation.T @ G
    turning = pin.getFrameVelocity(frames, data, S, pin.ReferenceFrame.LOCAL).angular
    motion = PlaceMotion(model, link, X_LS, G, PERIOD, q, v, v - PERIOD * a)
    motion.measure()
    np.testing.assert_allclose(motion.measured, [*turning, *felt], rtol=0, atol=1e-10)  # v - before loses digits


@pytest.mark.parametrize("seed", range(20))
def test_momenta_are_those_of_the_bodies_by_finite_differences(seed: int) -> None:
    """Of each body m p' and R I R' w, with p and R by Pinocchio a moment before and after."""
    rng = np.random.default_rng(seed)
    model = robot(rng)
    kinematics, h = Kinematics(model), 1e-6
    names = [f"l{k}" for k in sorted(rng.choice(np.arange(1, len(KINDS) + 1), 3, replace=False))]
    masses, moments, poses = rng.uniform(0.1, 2.0, 3), rng.uniform(0.1, 1.0, (3, 3)), [pose(rng) for _ in range(3)]
    q, v, _ = moving(rng, model)
    chain = Chain.to(model, names)
    nodes = np.array([chain.names[name] for name in names], dtype=np.int64)
    each = zip(masses, moments, poses, strict=True)
    inertias = np.array([[m, *i, *np.asarray(X.R).reshape(-1), *X.p] for m, i, X in each])
    bodies = LinkMomenta(chain, nodes, inertias, q, v)
    bodies.update()
    found = bodies.momenta.reshape(3, 3, 3)
    for k, name in enumerate(names):
        before, now, after = (kinematics.forward(q + s * h * v, name) @ poses[k] for s in (-1.0, 0.0, 1.0))
        W = (after.R - before.R) / (2 * h) @ now.R.T
        w = np.array([W[2, 1], W[0, 2], W[1, 0]])
        np.testing.assert_allclose(found[k, 0], now.p, atol=1e-12)
        np.testing.assert_allclose(found[k, 1], masses[k] * (after.p - before.p) / (2 * h), atol=1e-7)
        np.testing.assert_allclose(found[k, 2], now.R @ np.diag(moments[k]) @ now.R.T @ w, atol=1e-7)


class _Bullet:
    """What `WrenchSensors` asks of PyBullet: constants of links, and joints that a test moves."""

    def __init__(self, rng: np.random.Generator, model: RobotModel) -> None:
        self.joints: list[tuple[float, float]] = []
        quats = rng.normal(size=(len(KINDS), 4))
        self.infos = [
            (float(rng.uniform(0.1, 2.0)), 0.5, tuple(rng.uniform(0.1, 1.0, 3)), tuple(rng.normal(size=3)), tuple(quat))
            for quat in quats / np.linalg.norm(quats, axis=1, keepdims=True)
        ]

    def getDynamicsInfo(self, body: int, link: int, physicsClientId: int) -> Any:
        return self.infos[link]

    def getMatrixFromQuaternion(self, quat: Any) -> Any:
        return tuple(Transform.of(xyz=(0, 0, 0), quat_xyzw=quat).R.reshape(-1).tolist())

    def getJointStates(self, body: int, joints: Any, client: int) -> Any:
        return self.joints


def points(rng: np.random.Generator) -> tuple[tuple[Any, ...], ...]:
    """Contact points between any links of the robot and others, as PyBullet lists them."""
    found = []
    for _ in range(rng.integers(0, 8)):
        a, b = (int(body) for body in rng.choice([BULLET, 1], 2))
        links = (int(link) for link in rng.integers(-1, len(KINDS), 2))
        v = [tuple(row) for row in rng.normal(size=(5, 3)).tolist()]
        f = rng.normal(size=4).tolist()
        found.append((0, a, b, *links, v[0], v[1], v[2], f[0], f[1], f[2], v[3], f[3], v[4]))
    return tuple(found)


def sense(rng: np.random.Generator) -> tuple[RobotModel, list[Any]]:
    """The wrenches on two joints over three steps, and all that they follow from."""
    model = robot(rng)
    p: Any = _Bullet(rng, model)
    links = {f"l{k}": k - 1 for k in range(len(KINDS) + 1)}
    sensors = WrenchSensors(p, 0, model, BULLET, range(5), links, gravity=G, step=PERIOD)
    read = [sensors.add(f"l{k}").copy for k in rng.integers(1, len(KINDS) + 1, 2)]
    seen: list[Any] = []
    for tick in range(3):
        q, v, _ = moving(rng, model)
        p.joints = list(zip(q.tolist(), v.tolist(), strict=True))
        if tick % 2:
            sensors.moved()
        sensors.remember()
        sensors.moved()
        force, torque, at = rng.normal(size=(3, 3))
        sensors.measure(rng.normal(size=10), lambda: points(rng), [Pull(int(rng.integers(0, 7)), at, force, torque)])
        seen += [values() for values in read]
    return model, seen


def test_kernels_give_the_same_bits(equal_bits: Any) -> None:
    def imu(rng: np.random.Generator) -> list[Any]:
        model = robot(rng)
        q, v, a = moving(rng, model)
        motion = PlaceMotion(model, f"l{rng.integers(1, len(KINDS) + 1)}", pose(rng), G, PERIOD, q, v, v - PERIOD * a)
        motion.measure()
        return [motion.measured.copy()]

    equal_bits(imu, "imu", seeds=20)
    equal_bits(lambda rng: sense(rng)[1], "momenta", "wrenches", seeds=20)


def test_a_wrench_is_what_contacts_do_not_explain() -> None:
    """Of a link at rest in free space its weight; a contact that carries it leaves nothing."""
    rng = np.random.default_rng(3)
    model = robot(rng)
    model = replace(model, X_WB=Transform.identity())
    p: Any = _Bullet(rng, model)
    links = {f"l{k}": k - 1 for k in range(len(KINDS) + 1)}
    sensors = WrenchSensors(p, 0, model, BULLET, range(5), links, gravity=G, step=PERIOD)
    tip = "l7"
    values = sensors.add(tip)
    q = rng.normal(size=5)
    p.joints = [(angle, 0.0) for angle in q.tolist()]
    mass, _, _, centre, _ = p.infos[6]
    X_WL = Kinematics(model).forward(q, tip)
    up = tuple((-mass * G / np.linalg.norm(mass * G)).tolist())
    at = tuple(X_WL.apply(np.array(centre)).tolist())
    none = (0.0, 0.0, 0.0)
    carries = ((0, BULLET, 1, 6, -1, at, none, up, 0.0, float(np.linalg.norm(mass * G)), 0.0, none, 0.0, none),)
    for contacts, share in (((), 1.0), (carries, 0.0)):
        sensors.remember()
        sensors.moved()
        sensors.measure(np.concatenate((q, np.zeros(5))), partial(tuple, contacts))
        weight = X_WL.R.T @ (mass * G)
        want = share * np.concatenate((weight, cross(np.array(centre), weight)))
        np.testing.assert_allclose(values, want, atol=1e-9)
