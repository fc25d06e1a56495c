"""States of loaded controllers, and the rules for switching between them (those of ros2_control, without timeouts)."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from manipcli.control.chain import broken_chains, resources, target_of
from manipcli.control.claims import Claimant, conflicts
from manipcli.control.controller import Controller, JointState
from manipcli.control.feed_forward import Index
from manipcli.control.roles import takes_goals
from manipcli.core.errors import InvalidArgument, ManipcliError
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.plan.motion import Strictness, Switch

ControllerState = Literal["unconfigured", "inactive", "active"]


@dataclass(frozen=True, slots=True)
class SwitchResult:
    """Result of a switch: whether it was done, messages on refused or omitted names, and the changed controllers."""

    ok: bool
    messages: tuple[str, ...] = ()
    activated: tuple[str, ...] = ()
    deactivated: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ControllerInfo:
    """A loaded controller: `interfaces`, the `joint/interface` that it needs; `claimed`, the same while active;
    `every`, control ticks per update."""

    name: str
    state: ControllerState
    interfaces: tuple[str, ...]
    claimed: tuple[str, ...]
    every: int = 1

    @staticmethod
    def of(controller: Claimant, state: ControllerState, every: int = 1) -> ControllerInfo:
        """The info of a controller in this state."""
        wants = tuple(f"{joint}/{interface}" for joint in resources(controller) for interface in controller.interfaces)
        return ControllerInfo(controller.name, state, wants, wants if state == "active" else (), every)


class Slot:
    """A loaded controller, the index of its joints in a joint vector, and their measured state.

    `measured` and `contact_force` are read-only views of the manager's vectors, or, for joints that are not contiguous,
    copies that are updated every tick (`gathered`: copy, vector). The controller is updated at the tick `first`, at
    which it was activated, and at every `every`-th tick from there.
    """

    __slots__ = (
        "_state", "contact_force", "controller", "every", "first", "gathered", "index", "loaded", "measured", "period",
        "scattered",
    )  # fmt: skip

    def __init__(self, controller: Controller, index: Index, every: int, period: float) -> None:
        self.controller = controller
        self.index = index
        self.scattered = not isinstance(index, slice)
        self.every = every
        self.first = 0
        self.period = every * period
        self.loaded = True
        self.state: ControllerState = "unconfigured"
        none = np.zeros(0)
        self.measured = JointState(none, none, none)
        self.contact_force: Array | None = None
        self.gathered: list[tuple[Array, Array]] = []

    @property
    def state(self) -> ControllerState:
        """Its state, which decides whether it accepts goals."""
        return self._state

    @state.setter
    def state(self, state: ControllerState) -> None:
        self._state = state
        if takes_goals(self.controller):
            self.controller.accepts_goals = state == "active"

    def look(self, vectors: Sequence[Array], contact_force: Array | None) -> None:
        """Set the measured vectors: position, velocity, effort."""
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
        """Copy the measured values of joints that are not contiguous."""
        for part, vector in self.gathered:
            part[:] = vector[self.index]


def decided(
    controllers: Mapping[str, tuple[Claimant, ControllerState]],
    switch: Switch,
    joints: Collection[str],
    following: Collection[str],
) -> SwitchResult:
    """The result of a request; if claims conflict, strict refuses it and best_effort leaves out the later controller.

    Args:
        controllers: all loaded controllers and their states, by name.
        switch: the request.
        joints: all moving joints of the robot.
        following: joints that follow others (mimic).
    """
    active = [own for own, state in controllers.values() if state == "active"]
    activate, deactivate = switch.activate, switch.deactivate
    if switch.to:
        taken = {joint for name in switch.to if name in controllers for joint in _commanded(controllers[name][0])}
        others = [own for own in active if own.name not in switch.to]
        deactivate = tuple(own.name for own in others if taken & _commanded(own))
        activate = tuple(name for name in switch.to if name not in [own.name for own in active])
    states = {name: state for name, (_, state) in controllers.items()}
    request = requested(states, activate, deactivate, switch.strictness)
    if not request.ok:
        return request
    kept = [own for own in active if own.name not in request.deactivated]
    wanted = {name: controllers[name][0] for name in request.activated}
    if switch.strictness == "best_effort":
        return _without_clashes(request, kept, wanted, joints, following)
    together = [*kept, *wanted.values()]
    clashes = (*conflicts(together, joints, following), *broken_chains(together))
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
    """The request without controllers that conflict with those that stay active, or with an earlier name."""
    chosen = list(kept)
    messages = list(request.messages)
    for name, controller in wanted.items():
        clashes = conflicts([*chosen, controller], joints, following)
        messages += [f"cannot activate '{name}': {finding.message}" for finding in clashes]
        chosen += [] if clashes else [controller]
    while broken := tuple(broken_chains(chosen)):
        messages += [finding.message for finding in broken]
        chosen = [own for own in chosen if target_of(own) in ("", *(other.name for other in chosen))]
    names = {controller.name for controller in chosen}
    dropped = tuple(own.name for own in kept if own.name not in names)
    activated = tuple(name for name in wanted if name in names)
    return SwitchResult(True, tuple(messages), activated, (*request.deactivated, *dropped))


def requested(
    states: Mapping[str, ControllerState],
    activate: Collection[str],
    deactivate: Collection[str],
    strictness: Strictness,
) -> SwitchResult:
    """The part of a request that names and states allow; claims are not checked.

    strict: every name must be loaded; those to deactivate must be active, those to activate inactive or deactivated in
    the same request. best_effort: other names are left out; refused only if no name of a list is loaded.
    """
    off = tuple(name for name in dict.fromkeys(deactivate) if states.get(name) == "active")
    on = tuple(name for name in dict.fromkeys(activate) if states.get(name) == "inactive" or name in off)
    messages = [
        f"cannot {verb} '{name}': {_why_not(states, name)}"
        for verb, names, fit in (("deactivate", deactivate, off), ("activate", activate, on))
        for name in dict.fromkeys(names)
        if name not in fit
    ]
    lost = any(names and not any(name in states for name in names) for names in (activate, deactivate))
    if messages and (strictness == "strict" or lost):
        return SwitchResult(False, tuple(messages))
    return SwitchResult(True, tuple(messages), on, off)


def _commanded(controller: Claimant) -> set[str]:
    return set(controller.joints if controller.interfaces else ())


def _why_not(states: Mapping[str, ControllerState], name: str) -> str:
    if name in states:
        return f"it is {states[name]}"
    near = did_you_mean(name, states, kind="controllers")
    return "no such controller is loaded" + (f"; {near}" if near else "")


def names_of(given: Collection[str] | str) -> tuple[str, ...]:
    """A tuple of names, from names or a single name."""
    return (given,) if isinstance(given, str) else tuple(given)


def strictness_of(word: str) -> Strictness:
    """The strictness with this name; case is ignored.

    Raises:
        InvalidArgument: an unknown strictness.
    """
    known: dict[str, Strictness] = {name: name for name in get_args(Strictness)}
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
        raise InvalidArgument("CTRL163", f"update rate is {update_rate:g} Hz; expected a rate above 0")
    every = 1.0 / (update_rate * period)
    if abs(every - max(1, round(every))) > 1e-5 * every:  # six digits of a rate suffice, as in the hint
        message = f"update rate {update_rate:g} Hz does not divide the control rate of {1.0 / period:g} Hz"
        raise InvalidArgument("CTRL163", message, hint=f"use {1.0 / (period * max(1, round(every))):g} Hz")
    return round(every)


def cause_of(error: Exception) -> str:
    """An error on one line."""
    if isinstance(error, ManipcliError):
        return "; ".join(finding.message for finding in error.findings)
    return f"{type(error).__name__}: {error}"
