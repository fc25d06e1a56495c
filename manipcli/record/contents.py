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

FORMAT = 3
"""Version of the layout of a recording. Contacts of format 1 have no contact points. In format 3 an inactive controller
has no messages; a recording in which no controller is ever inactive has format 2, whose layout is the same."""


MAX_STRIDE = 1 << 20
"""Ticks."""
MAX_TIME = 9e9
"""[s] Log times are 64 bit numbers of nanoseconds."""
Interval = tuple[float, float | None]
"""Start and end [s]; None: until the end."""


@dataclass(frozen=True, slots=True)
class Contents:
    """Contents of a recording.

    Attributes:
        period: control period [s].
        joints, bodies, controllers: names in the order of the arrays: moving joints, movable bodies, joints of
            the controllers.
        strides: ticks between two messages of a topic, if not 1.
        absent: topics that the task excludes from the recording.
        inactive: when a controller is inactive and writes no messages: from a time [s] on, up to but without another,
            or None for the end; controllers that are always active are left out.
        believed: the bodies with believed poses of their own.
    """

    period: float
    joints: tuple[str, ...]
    bodies: tuple[str, ...]
    controllers: dict[str, tuple[str, ...]]
    strides: dict[str, int] = field(default_factory=dict)
    absent: tuple[str, ...] = ()
    inactive: dict[str, tuple[Interval, ...]] = field(default_factory=dict)
    believed: tuple[str, ...] = ()

    def metadata(self) -> dict[str, str]:
        strides = {topic: stride for topic, stride in self.strides.items() if stride != 1}
        return {
            "format": str(FORMAT if self.inactive else FORMAT - 1),
            "period": repr(self.period),
            "joints": json.dumps(self.joints),
            "bodies": json.dumps(self.bodies),
            "controllers": json.dumps(self.controllers),
            **({"strides": json.dumps(strides)} if strides else {}),
            **({"absent": json.dumps(self.absent)} if self.absent else {}),
            **({"inactive": json.dumps(self.inactive)} if self.inactive else {}),
            **({"believed": json.dumps(self.believed)} if self.believed else {}),
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
        strides, absent, inactive, believed = (
            json.loads(values.get(key, none))
            for key, none in (("strides", "{}"), ("absent", "[]"), ("inactive", "{}"), ("believed", "[]"))
        )
    except (KeyError, ValueError, RecursionError) as error:
        raise ValueError(f"has a damaged metadata record '{RECORD}'") from error
    whole = isinstance(strides, dict) and all(
        type(stride) is int and 0 < stride <= MAX_STRIDE for stride in strides.values()
    )
    groups = [joints, bodies, absent, believed, *(controllers.values() if isinstance(controllers, dict) else [None])]
    timed = isinstance(inactive, dict) and all(map(_are_intervals, inactive.values()))
    if not (math.isfinite(period) and period > 0 and whole and timed) or not all(map(_is_names, groups)):
        raise ValueError(f"has a damaged metadata record '{RECORD}'")
    known = all(set(controllers.get(name, ())) <= set(joints) for name in inactive)
    if not (known and set(believed) <= set(bodies)):
        raise ValueError(f"has a damaged metadata record '{RECORD}'")
    return Contents(
        period=period,
        joints=tuple(joints),
        bodies=tuple(bodies),
        controllers={name: tuple(claimed) for name, claimed in controllers.items()},
        strides=strides,
        absent=tuple(absent),
        inactive={name: tuple((start, end) for start, end in spans) for name, spans in inactive.items()},
        believed=tuple(believed),
    )


def _is_names(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(name, str) for name in value) and len(set(value)) == len(value)


def _are_intervals(value: object) -> bool:
    """Whether it is a list of pairs of times; the second of a pair can be missing."""
    return isinstance(value, list) and all(
        isinstance(pair, list) and len(pair) == 2 and _is_time(pair[0]) and (pair[1] is None or _is_time(pair[1]))
        for pair in value
    )


def _is_time(value: object) -> bool:
    return isinstance(value, int | float) and 0.0 <= value < MAX_TIME
