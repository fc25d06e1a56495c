"""Parameters of the controllers of a robot, as nodes of ROS 2 have them: gains, and what cannot change."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Final, cast

from annotated_types import Ge, Le

from manipcli.control.controller import Controller
from manipcli.control.controllers import CONTROLLERS
from manipcli.control.manager import ControllerManager
from manipcli.control.tunable_gains import FIXED, gains_in
from manipcli.core.errors import InvalidArgument
from manipcli.core.text import did_you_mean
from manipcli.live.live_robot import LiveRobot
from manipcli.spec.controllers import GainsSpec

NOT_SET, BOOL, INTEGER, DOUBLE, STRING, STRING_ARRAY = 0, 1, 2, 3, 4, 9
FIELDS: Final = {
    BOOL: "bool_value", INTEGER: "integer_value", DOUBLE: "double_value", STRING: "string_value",
    5: "byte_array_value", 6: "bool_array_value", 7: "integer_array_value", 8: "double_array_value",
    STRING_ARRAY: "string_array_value",
}  # fmt: skip
"""Field of rcl_interfaces/ParameterValue by its type (rcl_interfaces/ParameterType)."""
_OF: Final[dict[type, int]] = {bool: BOOL, int: INTEGER, float: DOUBLE, str: STRING, list: STRING_ARRAY}

Value = bool | int | float | str | list[str] | None


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a controller.

    Attributes:
        value: None: a bound that is not set.
        type: of rcl_interfaces/ParameterType.
        description: for people.
        gain: joint and name of the gain that it is; None: it cannot change.
        least, most: bounds of a number.
    """

    value: Value
    type: int
    description: str = ""
    gain: tuple[str, str] | None = None
    least: float | None = None
    most: float | None = None

    @property
    def read_only(self) -> bool:
        """Whether it cannot change while its controller is loaded."""
        return self.gain is None


def parameter_names(manager: ControllerManager, name: str) -> list[str]:
    """The names of the parameters of a controller, those of ros2_controllers.

    Raises:
        InvalidArgument: it is not loaded.
    """
    gains = gains_in(manager[name])
    own = {} if gains is None else gains.now
    return [*_FIXED, *(f"gains.{joint}.{gain}" for joint, each in own.items() for gain in _fields(type(each)))]


def parameter_of(manager: ControllerManager, name: str, word: str) -> Parameter | None:
    """A parameter of a controller; None: it has no such parameter. Raises as `parameter_names`."""
    controller = manager[name]
    if word in _FIXED:
        return _FIXED[word](manager, controller)
    first, _, rest = word.partition(".")
    joint, _, gain = rest.rpartition(".")
    gains = gains_in(controller)
    own = None if gains is None or first != "gains" else gains.now.get(joint)
    if own is None or gain not in _fields(type(own)):
        return None
    value, field = cast("Value", getattr(own, gain)), _fields(type(own))[gain]
    kind = NOT_SET if value is None and gain in FIXED else DOUBLE if value is None else _OF[type(value)]
    return replace(field, value=value, type=kind, gain=None if gain in FIXED else (joint, gain))


def _update_rate(manager: ControllerManager, controller: Controller) -> Parameter:
    every = next(info.every for info in manager.list() if info.name == controller.name)
    return Parameter(round(1.0 / (manager.period * every)), INTEGER, "Updates per second [Hz].")


_FIXED: Final[dict[str, Callable[[ControllerManager, Controller], Parameter]]] = {
    "joints": lambda _, own: Parameter(list(own.joints), STRING_ARRAY, "The joints that it claims."),
    "command_interfaces": lambda _, own: Parameter(list(own.interfaces), STRING_ARRAY, "What it commands."),
    "update_rate": _update_rate,
    "use_sim_time": lambda _, own: Parameter(True, BOOL, "Its time is the simulated time."),
}
"""What every controller has, and cannot change."""


@cache
def _fields(kind: type[GainsSpec]) -> dict[str, Parameter]:
    """The gains of a joint without their values."""
    found = {}
    for gain, field in kind.model_fields.items():
        least = next((float(str(one.ge)) for one in field.metadata if isinstance(one, Ge)), None)
        most = next((float(str(one.le)) for one in field.metadata if isinstance(one, Le)), None)
        found[gain] = Parameter(None, DOUBLE, field.description or "", None, least, most)
    return found


def change(robot: LiveRobot, name: str, values: Mapping[str, Value], *, suggest: bool = True) -> None:
    """Change parameters of a controller from the next tick on, all or none.

    Args:
        robot, name: its robot and name.
        values: by name; None removes a bound.
        suggest: see `known`.

    Raises:
        InvalidArgument: the controller is not loaded; a parameter that is unknown, cannot change, or is of another
            type; a value that is not finite, or that a controllers file may not have either.
    """
    wanted: dict[tuple[str, str], object] = {}
    for word, value in values.items():
        parameter = known(robot.manager, name, word, suggest=suggest)
        if parameter.gain is None:
            message = f"parameter '{word}' of controller '{name}' is read-only"
            raise InvalidArgument("LIVE152", message, hint="set it in the controllers file")
        wanted[parameter.gain] = _typed(word, parameter, value)
    gains = gains_in(robot.manager[name])
    if gains is not None and wanted:
        gains.change(wanted, partial(_check, robot, name))


def _check(robot: LiveRobot, name: str, gains: Mapping[str, GainsSpec]) -> None:
    """The checks of the controllers file, with these gains.

    Raises:
        InvalidArgument: an error.
    """
    spec = robot.task.true.controllers.spec.controllers[name].model_copy(update={"gains": dict(gains)})
    for problem in CONTROLLERS[spec.type].check(spec, robot.task.robot):
        if problem.severity == "error":
            text = f"controller '{name}': {problem.message}"
            raise InvalidArgument(problem.code or "CTRL100", text, hint=problem.hint)


def known(manager: ControllerManager, name: str, word: str, *, suggest: bool = True) -> Parameter:
    """As `parameter_of`; `suggest`: with the nearest name, which takes longer than all else.

    Raises:
        InvalidArgument: the controller is not loaded, or has no such parameter.
    """
    found = parameter_of(manager, name, word)
    if found is None:
        names = parameter_names(manager, name) if suggest else ()
        hint = did_you_mean(word[:80], names, kind="parameters")
        raise InvalidArgument("LIVE151", f"controller '{name}' has no parameter '{word[:80]}'", hint=hint)
    return found


def _typed(word: str, parameter: Parameter, value: Value) -> Value:
    """A value of the type of the parameter: a whole number is a number, too."""
    if value is None:
        return None
    given = _OF.get(type(value), NOT_SET)
    if parameter.type == DOUBLE and given == INTEGER:
        value, given = float(cast("int", value)), DOUBLE
    if given != parameter.type:
        expected = FIELDS[parameter.type].removesuffix("_value").replace("_", " ")
        message = f"parameter '{word}' is of type {expected}; a value of another type was given: {str(value)[:60]!r}"
        raise InvalidArgument("LIVE153", message)
    if isinstance(value, float) and not math.isfinite(value):
        message = f"parameter '{word}' cannot be {value}; expected a finite number"
        raise InvalidArgument("LIVE153", message, hint="null removes a bound")
    return value
