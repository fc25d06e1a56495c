"""Joints of the scene in conditions: the names that a spec can give, and whether their motion is known."""

from __future__ import annotations

from manipcli.conditions.condition import Problem, World, unknown_body, unmoving
from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean
from manipcli.scene.joints import SceneJoint, joints_of
from manipcli.scene.scene import Scene


def joint_named(scene: Scene, name: str) -> SceneJoint:
    """The joint of this name, which is known to exist."""
    return next(joint for joint in scene.joints if joint.name == name)


def joint_of(scene: Scene, body: str) -> SceneJoint:
    """The only joint of a jointed thing, or the joint that moves a link; it is known to exist."""
    return joints_of(scene.joints, body)[0]


def unknown_joint(scene: Scene, name: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem if the scene has no joint of this name."""
    known = [joint.name for joint in scene.joints]
    if name in known:
        return ()
    hint = did_you_mean(name, known, kind="joints") if known else "joints come with `urdf:` of a body"
    return (Problem(loc, f"the scene has no joint '{name}'", hint),)


def not_one_joint(scene: Scene, body: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem unless this is a body with one joint, or one that a joint moves."""
    if found := unknown_body(scene, body, loc):
        return found
    joints = joints_of(scene.joints, body)
    if len(joints) == 1 or (joints and not scene.body(body).kind):  # a placeholder has no kind
        return ()
    if joints:
        links = ", ".join(f"'{joint.child}'" for joint in joints)
        return (Problem(loc, f"'{body}' has {len(joints)} joints, expected one", f"name what one moves: {links}"),)
    jointed = sorted({joint.name.rpartition("/")[0] for joint in scene.joints})
    hint = did_you_mean(body, jointed, kind="bodies with joints") if jointed else "joints come with `urdf:` of a body"
    return (Problem(loc, f"'{body}' has no joint", hint),)


def unknown_motion(world: World, joint: SceneJoint) -> str | None:
    """Why the positions of a joint are unknown; None if they are known."""
    return unmoving(world, (joint.parent, joint.child))
