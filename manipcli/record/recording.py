"""A log read back: the only witness that judge, replay and report know. `read_recording` makes it."""

from __future__ import annotations

from dataclasses import dataclass

from manipcli.core.geometry import Array
from manipcli.model.state import Contact, WorldState


@dataclass(frozen=True, slots=True)
class TaskEvent:
    """`kind`: step_started, step_ended, phase_started, goal_sent, goal_ended, ...; `place`: file:line of the step."""

    time: float
    kind: str
    step: str
    verb: str
    outcome: str
    text: str
    place: str


@dataclass(frozen=True, slots=True)
class ControllerTrace:
    """What one controller did: arrays (T, n) on the control ticks."""

    name: str
    joints: tuple[str, ...]
    times: Array
    reference_position: Array
    reference_velocity: Array
    position: Array
    output: Array


@dataclass(frozen=True, slots=True)
class ContactSnapshot:
    """All contacts from `time` on, until the next snapshot."""

    time: float
    contacts: tuple[Contact, ...]


@dataclass(frozen=True, slots=True)
class Recording:
    """Everything in one log. `states` has a leading time axis T (control ticks, from 0).

    `metadata`: name -> key -> value; `attachments`: name -> bytes; `lost`: why the end is missing, or None.
    `period`: [s] of a tick. Velocities of bodies are central differences of their recorded poses.
    """

    joint_names: tuple[str, ...]
    body_names: tuple[str, ...]
    states: WorldState
    controllers: tuple[ControllerTrace, ...]
    contacts: tuple[ContactSnapshot, ...]
    events: tuple[TaskEvent, ...]
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, bytes]
    lost: str | None
    period: float = 0.0
