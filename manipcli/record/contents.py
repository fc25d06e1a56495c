"""Metadata record with the contents of a recording, for its readers."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

RECORD = "recording"
"""Name of the metadata record."""

REPAIR = "repair"
"""Name of the metadata record of a repaired file, with what it `lost`."""

FORMAT = 2
"""Version of the layout of a recording. Contacts of format 1 have no contact points."""


MAX_STRIDE = 1 << 20
"""Ticks."""


@dataclass(frozen=True, slots=True)
class Contents:
    """Contents of a recording.

    Attributes:
        period: control period [s].
        joints, bodies, controllers: names in the order of the arrays: moving joints, movable bodies, joints of
            the controllers.
        strides: ticks between two messages of a topic, if not 1.
        absent: topics that the task excludes from the recording.
    """

    period: float
    joints: tuple[str, ...]
    bodies: tuple[str, ...]
    controllers: dict[str, tuple[str, ...]]
    strides: dict[str, int] = field(default_factory=dict)
    absent: tuple[str, ...] = ()

    def metadata(self) -> dict[str, str]:
        strides = {topic: stride for topic, stride in self.strides.items() if stride != 1}
        return {
            "format": str(FORMAT),
            "period": repr(self.period),
            "joints": json.dumps(self.joints),
            "bodies": json.dumps(self.bodies),
            "controllers": json.dumps(self.controllers),
            **({"strides": json.dumps(strides)} if strides else {}),
            **({"absent": json.dumps(self.absent)} if self.absent else {}),
        }


def contents(values: Mapping[str, str]) -> Contents:
    """The inverse of `Contents.metadata`.

    Raises:
        ValueError: a later format, or an invalid record; see the message.
    """
    version = values.get("format", "")
    if version not in (str(number) for number in range(1, FORMAT + 1)):
        if version.isdecimal() and int(version) > FORMAT:
            raise ValueError(f"has format {version}; this manipcli reads up to {FORMAT}")
        raise ValueError(f"has the unknown format '{version}'")
    try:
        period = float(values["period"])
        joints, bodies, controllers = (json.loads(values[key]) for key in ("joints", "bodies", "controllers"))
        strides, absent = json.loads(values.get("strides", "{}")), json.loads(values.get("absent", "[]"))
    except (KeyError, ValueError, RecursionError) as error:
        raise ValueError(f"has a damaged metadata record '{RECORD}'") from error
    whole = isinstance(strides, dict) and all(
        type(stride) is int and 0 < stride <= MAX_STRIDE for stride in strides.values()
    )
    groups = [joints, bodies, absent, *(controllers.values() if isinstance(controllers, dict) else [None])]
    if not (math.isfinite(period) and period > 0 and whole) or not all(map(_is_names, groups)):
        raise ValueError(f"has a damaged metadata record '{RECORD}'")
    return Contents(
        period=period,
        joints=tuple(joints),
        bodies=tuple(bodies),
        controllers={name: tuple(claimed) for name, claimed in controllers.items()},
        strides=strides,
        absent=tuple(absent),
    )


def _is_names(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(name, str) for name in value) and len(set(value)) == len(value)
