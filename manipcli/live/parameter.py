"""Parameters of the controllers of a robot, as nodes of ROS 2 have them: gains, and what cannot change."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, cast

from annotated_types import Ge, Le

from manipcli.control.manager import ControllerManager
from manipcli.control.tunable_gains import FIXED, TunableGains, gains_in
from manipcli.core.errors import InvalidArgument
from manipcli.core.text import did_you_mean

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


def parameters_of(manager: ControllerManager, name: str) -> dict[str, Parameter]:
    """The parameters of a controller, by their names in ros2_controllers.

    Raises:
        InvalidArgument: it is not loaded.
    """
    controller = manager[name]
    every = next(info.every for info in manager.list() if info.name == name)
    found = {
        "joints": Parameter(list(controller.joints), STRING_ARRAY, "The joints that it claims."),
        "command_interfaces": Parameter(list(controller.interfaces), STRING_ARRAY, "What it commands of each joint."),
        "update_rate": Parameter(round(1.0 / (manager.period * every)), INTEGER, "Updates per second [Hz]."),
        "use_sim_time": Parameter(True, BOOL, "Its time is the simulated time."),
    }
    gains = gains_in(controller)
    return found if gains is None else found | dict(_gains(gains))


def _gains(gains: TunableGains) -> Iterator[tuple[str, Parameter]]:
    for joint, own in gains.now.items():
        for gain, field in type(own).model_fields.items():
            value = cast("Value", getattr(own, gain))
            kind = NOT_SET if value is None and gain in FIXED else DOUBLE if value is None else _OF[type(value)]
            where = None if gain in FIXED else (joint, gain)
            least = next((float(str(one.ge)) for one in field.metadata if isinstance(one, Ge)), None)
            most = next((float(str(one.le)) for one in field.metadata if isinstance(one, Le)), None)
            yield f"gains.{joint}.{gain}", Parameter(value, kind, field.description or "", where, least, most)


def change(manager: ControllerManager, name: str, values: Mapping[str, Value]) -> None:
    """Change parameters of a controller from the next tick on, all or none.

    Args:
        manager, name: its manager and name.
        values: by name; None removes a bound.

    Raises:
        InvalidArgument: the controller is not loaded; a parameter that is unknown, cannot change, or is of another
            type; a value that is not finite, or that a controllers file may not have either.
    """
    known = parameters_of(manager, name)
    wanted: dict[tuple[str, str], object] = {}
    for word, value in values.items():
        parameter = known.get(word)
        if parameter is None:
            raise unknown(name, word, known)
        if parameter.gain is None:
            message = f"parameter '{word}' of controller '{name}' is read-only"
            raise InvalidArgument("LIVE152", message, hint="set it in the controllers file")
        wanted[parameter.gain] = _typed(word, parameter, value)
    gains = gains_in(manager[name])
    if gains is not None and wanted:
        gains.change(wanted)


def unknown(name: str, word: str, known: Mapping[str, Parameter]) -> InvalidArgument:
    """The error for a parameter that a controller does not have."""
    hint = did_you_mean(word[:80], known, kind="parameters")
    return InvalidArgument("LIVE151", f"controller '{name}' has no parameter '{word[:80]}'", hint=hint)


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
