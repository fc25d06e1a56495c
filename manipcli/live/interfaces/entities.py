"""Services of simulation_interfaces 2.1.0 on entities: the bodies of the scene, and the robot as `robot`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from manipcli.control.controller import Controller
from manipcli.core.geometry import Array, Transform
from manipcli.core.text import did_you_mean
from manipcli.live.command import Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.interfaces.simulation import PACKAGE, result
from manipcli.live.live_robot import LiveRobot
from manipcli.live.name_pattern import BadPattern, matches
from manipcli.live.names import Result
from manipcli.live.placing import misplaced
from manipcli.record.cdr import NS_PER_S
from manipcli.record.json_message import definition, from_json
from manipcli.scene.scene import Body
from manipcli.task.task import Task

ROBOT: Final = "robot"
"""The name of the robot; no body has it."""
OBJECT: Final = 0
ROBOT_CATEGORY: Final = 1
STATIC: Final = 5
"""Of simulation_interfaces/EntityCategory."""
ALL_TAGS: Final = 1
_NO_STATE = from_json(definition(f"{PACKAGE}/EntityState"), {})
_NO_INFO = from_json(definition(f"{PACKAGE}/EntityInfo"), {})


def endpoints(task: Task, controllers: Sequence[Controller]) -> Iterator[Endpoint]:
    """All of them."""
    for name, kind, handle in (
        ("/get_entities", "GetEntities", _entities),
        ("/get_entities_states", "GetEntitiesStates", _states),
        ("/get_entity_info", "GetEntityInfo", _info),
        ("/get_entity_state", "GetEntityState", _state),
        ("/set_entity_state", "SetEntityState", _set_state),
    ):
        yield Endpoint("service", name, f"{PACKAGE}/srv/{kind}", handle, reads=handle is not _set_state)


def _names(robot: LiveRobot) -> list[str]:
    return [*(body.name for body in robot.session.scene.bodies), ROBOT]


def _entities(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    names, code, why = _matching(robot, request["filters"])
    return result(code, why, entities=names)


def _states(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    names, code, why = _matching(robot, request["filters"])
    return result(code, why, entities=names, states=[_state_of(robot, name) for name in names])


def _info(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    name = request["entity"]
    if unknown := _unknown(robot, name):
        return result(Result.NOT_FOUND, unknown, info=_NO_INFO)
    return result(info=_info_of(robot, name))


def _state(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    name = request["entity"]
    if unknown := _unknown(robot, name):
        return result(Result.NOT_FOUND, unknown, state=_NO_STATE)
    return result(state=_state_of(robot, name))


def _set_state(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Put a movable body elsewhere; an event in the log says where it was put, or why not."""
    name, state = request["entity"], request["state"]
    if unknown := _unknown(robot, name):
        return result(Result.NOT_FOUND, unknown)
    position, quat = _vector(state["pose"]["position"]), _vector(state["pose"]["orientation"], "xyzw")
    twist = np.concatenate([_vector(state["twist"][word]) for word in ("linear", "angular")])
    frame = state["header"]["frame_id"]
    if frame not in ("", "world"):
        why, code = f"the pose is in frame '{frame[:80]}'; expected world", Result.UNSUPPORTED
    else:
        why, code = misplaced(robot, name, position, quat, twist), Result.FAILED
    if why:
        robot.event("refused", f"{command.op} {command.name}: '{name}': {why}", outcome="error")
        return result(code, f"'{name}': {why}")
    robot.session.engine.place(name, Transform.of(xyz=position, quat_xyzw=quat), twist)
    x, y, z = position.tolist()
    robot.event("entity_placed", f"'{name}' was put at {x:.4g} {y:.4g} {z:.4g} m by a client")
    return result()


def _unknown(robot: LiveRobot, name: str) -> str:
    """Why there is no such entity; "" if there is."""
    names = _names(robot)
    return "" if name in names else f"there is no entity '{name[:80]}'; {did_you_mean(name[:80], names)}"


def _matching(robot: LiveRobot, filters: Mapping[str, Any]) -> tuple[list[str], int, str]:
    """The names of the entities that pass all filters; a code, and why a filter is not carried out."""
    if filters["bounds"]["type"] or filters["bounds"]["points"]:
        return [], Result.UNSUPPORTED, "a filter by bounds is not supported"
    try:
        named = {name for name in _names(robot) if matches(filters["filter"], name)}
    except BadPattern as error:
        return [], Result.FAILED, str(error)
    categories = {each["category"] for each in filters["categories"]}
    tags, all_tags = set(filters["tags"]["tags"]), filters["tags"]["filter_mode"] == ALL_TAGS
    found = []
    for name in _names(robot):
        info: Any = _info_of(robot, name)
        own = set(info["tags"])
        tagged = not tags or (tags <= own if all_tags else bool(tags & own))
        if name in named and tagged and (not categories or info["category"]["category"] in categories):
            found.append(name)
    return found, Result.OK, ""


def _info_of(robot: LiveRobot, name: str) -> Values:
    if name == ROBOT:
        own = robot.session.robot
        text, category, tags = f"robot '{own.name}', {len(own.joint_names)} joints", ROBOT_CATEGORY, [own.name]
    else:
        body = robot.session.scene.body(name)
        text = f"{body.kind}, fixed" if body.fixed else f"{body.kind} of {body.mass:.4g} kg"
        category, tags = STATIC if body.fixed else OBJECT, [body.kind, "fixed" if body.fixed else "movable"]
    return {"category": {"category": category}, "description": text, "tags": tags}


def _state_of(robot: LiveRobot, name: str) -> Values:
    """Of the frame O of a body, or of the base of the robot, in the world; the acceleration is not measured: zeros."""
    session = robot.session
    body: Body | None = None if name == ROBOT else session.scene.body(name)
    pose, twist = session.robot.X_WB if body is None else body.X_WO, np.zeros(6)
    if body is not None and not body.fixed:
        pose, twist = session.engine.body_state(name)
    sec, nanosec = divmod(round(session.time * 1e9), NS_PER_S)
    return {
        "header": {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": "world"},
        "pose": {"position": _named(pose.p), "orientation": _named(pose.quat_xyzw)},
        "twist": {"linear": _named(twist[:3]), "angular": _named(twist[3:])},
        "acceleration": _NO_STATE["acceleration"],
    }


def _vector(message: Mapping[str, float], names: str = "xyz") -> Array:
    return np.array([message[name] for name in names])


def _named(values: Array) -> dict[str, float]:
    return dict(zip("xyzw", values.tolist(), strict=False))
