"""A controller with misspelt joints replaced by the joints that are meant, so that one slip gives one finding."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from manipcli.core.text import nearest
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import ConstraintsSpec, ControllerSpec

S = TypeVar("S", bound=ControllerSpec)
V = TypeVar("V")


def as_meant(spec: S, robot: RobotModel) -> S:
    """The controller with each unknown joint under `joints` as the nearest joint of the robot that it does not name.

    Where no name is near, a single unknown joint is the single joint that has gains or tolerances but is not in
    `joints`. Unchanged where no joint can be meant.
    """
    known = [joint.name for joint in robot.joints]
    free = [name for name in known if name not in spec.joints]
    left_over = [name for name in free if name in _given(spec)]
    unknown = [name for name in spec.joints if name not in known]
    joints: list[str] = []
    for name in spec.joints:
        meant = nearest(name, free) if name in unknown else ()
        if name in unknown and not meant and len(left_over) == len(unknown) == 1:
            meant = tuple(left_over)
        joints.append(meant[0] if meant else name)
        free = [other for other in free if other not in meant]
    renamed = {wrong: right for wrong, right in zip(spec.joints, joints, strict=True) if wrong != right}
    return spec.model_copy(update={"joints": tuple(joints), **_renamed(spec, renamed)}) if renamed else spec


def _renamed(spec: ControllerSpec, renamed: Mapping[str, str]) -> dict[str, Any]:
    """The gains and tolerances under the names of the meant joints, which stay where both are given."""
    found: dict[str, Any] = {}
    gains = getattr(spec, "gains", None)
    if isinstance(gains, dict):
        found["gains"] = _moved(gains, renamed)
    constraints = getattr(spec, "constraints", None)
    if isinstance(constraints, ConstraintsSpec):
        found["constraints"] = constraints.model_copy(update={"joints": _moved(constraints.joints, renamed)})
    return found


def _given(spec: ControllerSpec) -> frozenset[str]:
    """The joints with gains or tolerances."""
    gains, constraints = getattr(spec, "gains", None), getattr(spec, "constraints", None)
    tolerances = constraints.joints if isinstance(constraints, ConstraintsSpec) else {}
    return frozenset((*(gains if isinstance(gains, dict) else ()), *tolerances))


def _moved(values: dict[str, V], renamed: Mapping[str, str]) -> dict[str, V]:
    return {renamed[name] if name in renamed and renamed[name] not in values else name: v for name, v in values.items()}
