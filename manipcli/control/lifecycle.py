"""Loaded controllers and their states, and the rules of switching between them (ros2_control's, without its clocks)."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from manipcli.control.claims import Claimant, conflicts
from manipcli.control.controller import Controller, JointState
from manipcli.control.feed_forward import Index
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.plan.motion import Strictness, Switch

ControllerState = Literal["unconfigured", "inactive", "active"]


@dataclass(frozen=True, slots=True)
class SwitchResult:
    """What came of a switch: whether it was done, what was left out or refused and why, and who changed."""

    ok: bool
    messages: tuple[str, ...] = ()
    activated: tuple[str, ...] = ()
    deactivated: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ControllerInfo:
    """A loaded controller: `interfaces`, the `joint/interface` that it wants; `claimed`, the same while active."""

    name: str
    state: ControllerState
    interfaces: tuple[str, ...]
    claimed: tuple[str, ...]

    @staticmethod
    def of(controller: Claimant, state: ControllerState) -> ControllerInfo:
        """Of a controller in this state."""
        wants = tuple(f"{joint}/{interface}" for joint in controller.joints for interface in controller.interfaces)
        return ControllerInfo(controller.name, state, wants, wants if state == "active" else ())


class Slot:
    """A loaded controller, where its joints stand in a joint vector, and what is measured there.

    `measured` and `contact_force` are read-only parts of the vectors that the manager was given, or, where the joints
    do not stand side by side, copies that are taken anew every tick (`gathered`: copy, vector). It is updated at the
    tick `first`, at which it was activated, and at every `every`-th one from there.
    """

    __slots__ = (
        "contact_force", "controller", "copies", "every", "first", "gathered", "index", "measured", "period",
        "scattered", "state",
    )  # fmt: skip

    def __init__(self, controller: Controller, index: Index, every: int, period: float) -> None:
        self.controller = controller
        self.index = index
        self.scattered = not isinstance(index, slice)
        self.every = every
        self.first = 0
        self.period = every * period
        self.state: ControllerState = "unconfigured"
        none = np.zeros(0)
        self.measured = JointState(none, none, none)
        self.contact_force: Array | None = None
        self.copies: tuple[tuple[Array, Index, Array], ...] = ()
        self.gathered: list[tuple[Array, Array]] = []

    def look(self, vectors: Sequence[Array], contact_force: Array | None) -> None:
        """From now on at these vectors: position, velocity, effort."""
        self.gathered = []
        self.measured = JointState(*map(self._part, vectors))
        self.contact_force = None if contact_force is None else self._part(contact_force)

    def _part(self, vector: Array) -> Array:
        part = vector[self.index]
        if self.scattered:
            self.gathered.append((part, vector))
            part = part.view()
        part.flags.writeable = False
        return part

    def gather(self) -> None:
        """Copies what is measured now."""
        for part, vector in self.gathered:
            part[:] = vector[self.index]


def decided(
    controllers: Mapping[str, tuple[Claimant, ControllerState]],
    switch: Switch,
    joints: Collection[str],
    following: Collection[str],
) -> SwitchResult:
    """What comes of a request; where claims clash, strict refuses it and best_effort leaves out who came later.

    Args:
        controllers: all that are loaded, by name, and their states.
        switch: the request.
        joints: all moving joints of the robot.
        following: those that follow others.
    """
    active = [one for one, state in controllers.values() if state == "active"]
    activate, deactivate = switch.activate, switch.deactivate
    if switch.to:
        taken = {joint for name in switch.to if name in controllers for joint in _commanded(controllers[name][0])}
        others = [one for one in active if one.name not in switch.to]
        deactivate = tuple(one.name for one in others if taken & _commanded(one))
        activate = tuple(name for name in switch.to if name not in [one.name for one in active])
    states = {name: state for name, (_, state) in controllers.items()}
    request = requested(states, activate, deactivate, switch.strictness)
    if not request.ok:
        return request
    kept = [one for one in active if one.name not in request.deactivated]
    wanted = {name: controllers[name][0] for name in request.activated}
    if switch.strictness == "best_effort":
        return _without_clashes(request, kept, wanted, joints, following)
    clashes = conflicts([*kept, *wanted.values()], joints, following)
    if clashes:
        return SwitchResult(False, (*request.messages, *(finding.message for finding in clashes)))
    return request


def _without_clashes(
    request: SwitchResult,
    kept: Sequence[Claimant],
    wanted: Mapping[str, Claimant],
    joints: Collection[str],
    following: Collection[str],
) -> SwitchResult:
    """The request without whoever claims what those that stay active, or one that was named before, claim."""
    there = list(kept)
    told = list(request.messages)
    for name, one in wanted.items():
        clashes = conflicts([*there, one], joints, following)
        told += [f"cannot activate '{name}': {finding.message}" for finding in clashes]
        there += [] if clashes else [one]
    names = {one.name for one in there}
    return SwitchResult(True, tuple(told), tuple(name for name in wanted if name in names), request.deactivated)


def requested(
    states: Mapping[str, ControllerState],
    activate: Collection[str],
    deactivate: Collection[str],
    strictness: Strictness,
) -> SwitchResult:
    """What of a request can be done, as far as names and states tell; claims are not looked at.

    strict: every name must be loaded, those to deactivate active, those to activate inactive or deactivated in the same
    request. best_effort: names that are not are left out; refused only where no name of a list is loaded.
    """
    off = tuple(name for name in dict.fromkeys(deactivate) if states.get(name) == "active")
    on = tuple(name for name in dict.fromkeys(activate) if states.get(name) == "inactive" or name in off)
    told = [
        f"cannot {verb} '{name}': {_why_not(states, name)}"
        for verb, names, fit in (("deactivate", deactivate, off), ("activate", activate, on))
        for name in dict.fromkeys(names)
        if name not in fit
    ]
    lost = any(names and not any(name in states for name in names) for names in (activate, deactivate))
    if told and (strictness == "strict" or lost):
        return SwitchResult(False, tuple(told))
    return SwitchResult(True, tuple(told), on, off)


def _commanded(controller: Claimant) -> set[str]:
    return set(controller.joints if controller.interfaces else ())


def _why_not(states: Mapping[str, ControllerState], name: str) -> str:
    if name in states:
        return f"it is {states[name]}"
    near = did_you_mean(name, states, kind="controllers")
    return "no such controller is loaded" + (f"; {near}" if near else "")


def names_of(given: Collection[str] | str) -> tuple[str, ...]:
    """Names, or one name."""
    return (given,) if isinstance(given, str) else tuple(given)


def strictness_of(word: str) -> Strictness:
    """In any case of letters.

    Raises:
        InvalidArgument: another word.
    """
    known: dict[str, Strictness] = {each: each for each in get_args(Strictness)}
    found = known.get(str(word).lower())
    if found is None:
        message = f"unknown strictness '{word}'; expected {' or '.join(known)}"
        raise InvalidArgument("CTRL164", message, hint=did_you_mean(str(word), known))
    return found


def ticks_between(update_rate: float, period: float) -> int:
    """Control ticks of `period` [s] between two updates at `update_rate` [Hz].

    Raises:
        InvalidArgument: the rate does not divide the control rate, or is not above 0.
    """
    if not 0.0 < update_rate < math.inf:
        raise InvalidArgument("CTRL163", f"an update rate of {update_rate:g} Hz; expected one above 0")
    every = 1.0 / (update_rate * period)
    if abs(every - max(1, round(every))) > 1e-5 * every:  # six digits of a rate do, as those of the hint
        message = f"an update rate of {update_rate:g} Hz does not divide the control rate of {1.0 / period:g} Hz"
        raise InvalidArgument("CTRL163", message, hint=f"say {1.0 / (period * max(1, round(every))):g} Hz")
    return round(every)
