"""States of controllers, and the rules of switching between them (ros2_control's, without its clocks)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Literal

from manipcli.control.controller import Controller
from manipcli.core.text import did_you_mean

ControllerState = Literal["unconfigured", "inactive", "active"]
Strictness = Literal["strict", "best_effort"]


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
    def of(controller: Controller, state: ControllerState) -> ControllerInfo:
        """Of a controller in this state."""
        wants = tuple(f"{joint}/{interface}" for joint in controller.joints for interface in controller.interfaces)
        return ControllerInfo(controller.name, state, wants, wants if state == "active" else ())


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


def _why_not(states: Mapping[str, ControllerState], name: str) -> str:
    if name in states:
        return f"it is {states[name]}"
    near = did_you_mean(name, states, kind="controllers")
    return "no such controller is loaded" + (f"; {near}" if near else "")
