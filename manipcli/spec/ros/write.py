"""Writing of controllers in the form of ROS 2, by the tables that read it."""

from __future__ import annotations

from dataclasses import dataclass

from manipcli.spec.controllers import ControllerSpec
from manipcli.spec.resolved import plain_data
from manipcli.spec.ros.table import Block, Data, Table
from manipcli.spec.ros.tables import DEFAULTS, ELSEWHERE, TABLES

_UNIVERSAL = frozenset({"update_rate"})
"""Parameters of every ROS controller."""
_ALWAYS = frozenset(
    {
        "allow_stalling", "command_interface", "command_interfaces", "gains", "reference_and_state_interfaces",
        "set_current_state_as_first_setpoint", "state_interfaces",
    }
)  # fmt: skip
"""Keys that are written even with their defaults, because those of ROS differ or are missing."""


@dataclass(frozen=True, slots=True)
class Written:
    """A controller in the form of ROS 2: its type, its parameters, and those keys among them that ROS ignores."""

    type: str
    parameters: Data
    ignored: tuple[str, ...]


def written(spec: ControllerSpec) -> Written | None:
    """A controller in the form of ROS 2; None if ROS has no such controller.

    Values that differ from our defaults are written, and those whose defaults differ from ROS's.
    """
    table = next((table for table in TABLES if table.own == spec.type), None)
    if table is None:
        return None
    word = _type(table, spec)
    data = table.unshape(_chosen(spec))
    names = _names(table.parameters)
    parameters = {names.get(key, key): value for key, value in data.items()}
    implied = table.types[word]
    parameters = {key: value for key, value in parameters.items() if key not in implied}
    ignored = tuple(key for key in parameters if not _in_ros(table, key))
    return Written(word, parameters, ignored)


def type_in_ros(spec: ControllerSpec) -> str | None:
    """Its type in ROS 2; None if ROS has no such controller."""
    return next((_type(table, spec) for table in TABLES if table.own == spec.type), None)


def types_in_ros(own: str) -> tuple[str, ...]:
    """The types of ROS 2 of our type `own`."""
    return tuple(word for table in TABLES if table.own == own for word in table.ros2.values())


def _type(table: Table, spec: ControllerSpec) -> str:
    interface = spec.interfaces[0] if spec.interfaces else ""
    return table.ros2.get(interface) or table.ros2[""]


def _chosen(spec: ControllerSpec) -> Data:
    """The keys to write, `constraints` with all its defaults."""
    fields = type(spec).model_fields
    differing = {key.partition(".")[0] for key in DEFAULTS.get(spec.type, {})}
    return {
        key: value
        for key, value in plain_data(spec).items()
        if key != "type"
        and (
            key in differing or key in _ALWAYS or fields[key].is_required() or getattr(spec, key) != fields[key].default
        )
    }


def _names(block: Block) -> dict[str, str]:
    """Our name -> ROS's."""
    return {own: ros for ros, own in block.renamed.items() if ros not in block.unwritten}


def _in_ros(table: Table, key: str) -> bool:
    return key in ELSEWHERE or key in _UNIVERSAL or key in table.parameters.names
