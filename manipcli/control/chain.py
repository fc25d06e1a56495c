"""Chains of controllers: one whose commands are the references of another, as in ros2_control.

The preceding controller (`chained_to` names the other) claims no joints but the references `NAME/joint/interface`. It
is updated first; both are active, or the chain is refused. Only a `pid` takes references.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol, TypeGuard

import numpy.typing as npt

from manipcli.control.controller import Controller
from manipcli.core.errors import Diagnostic, Place
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.spec.controllers import ControllerSpec, Interface


class Follows(Protocol):
    """The attributes of a controller that matter for chains."""

    @property
    def name(self) -> str: ...
    @property
    def joints(self) -> tuple[str, ...]: ...


class TakesReferences(Controller, Protocol):
    """A controller whose references another may command."""

    references: tuple[Interface, ...]

    def chain(self, sources: Mapping[Interface, Array] | None, order: npt.ArrayLike = ()) -> None:
        """Follow these live arrays from the next update on, `order` [j] being the index of joint j; None: stop it."""
        ...


def takes_references(controller: Controller) -> TypeGuard[TakesReferences]:
    """Whether another controller may command its references."""
    return hasattr(controller, "chain")


def target_of(controller: object) -> str:
    """The name of the controller whose references it commands; empty: it commands joints."""
    return getattr(controller, "chained_to", None) or ""


def resources(controller: Follows) -> tuple[str, ...]:
    """What its interfaces belong to: its joints, or the references of another controller."""
    target = target_of(controller)
    return tuple(f"{target}/{joint}" for joint in controller.joints) if target else controller.joints


def broken_chains(controllers: Sequence[Follows]) -> Iterator[Diagnostic]:
    """Controllers that command references of one that is not among those that are active together."""
    names = [controller.name for controller in controllers]
    for controller in controllers:
        target = target_of(controller)
        if target and target not in names:
            message = f"controller '{controller.name}' commands the references of '{target}', which is not active"
            yield Diagnostic("CTRL171", message, hint="activate both, or deactivate both")


def depth_of(controller: object, targets: Mapping[str, str]) -> int:
    """How many controllers follow it; at most as many as there are, also if they follow each other in a circle."""
    depth, target = 0, target_of(controller)
    while target and depth <= len(targets):
        depth, target = depth + 1, targets.get(target, "")
    return depth


def chain_problem(
    name: str, spec: ControllerSpec, every: Mapping[str, ControllerSpec]
) -> tuple[str, str | None] | None:
    """Why a controller cannot be chained, and a hint; None if it can, or is not chained."""
    target = target_of(spec)
    if not target:
        return None
    other = every.get(target)
    if other is None:
        near = did_you_mean(target, [known for known, own in every.items() if own.references], kind="`pid` controllers")
        return f"it commands the references of '{target}', which is not in the file or not supported", near
    if not other.references:
        return f"it commands the references of '{target}' of type `{other.type}`, which has none", "only `pid` has"
    targets = {known: target_of(own) for known, own in every.items()}
    if depth_of(spec, targets) > len(targets):
        return f"it follows itself through '{target}'", "end the chain at a controller of joints"
    if set(spec.joints) != set(other.joints):
        return (
            f"its joints are not those of '{target}': {', '.join(other.joints)}",
            "command all of them, and no others",
        )
    extra = [interface for interface in spec.interfaces if interface not in other.references]
    if extra or other.references[0] not in spec.interfaces:
        wanted, given = ", ".join(other.references), ", ".join(spec.interfaces)
        return f"it commands {given}, but the references of '{target}' are {wanted}", f"command {wanted}"
    return None


def chain_finding(
    name: str, spec: ControllerSpec, every: Mapping[str, ControllerSpec], place: Place | None
) -> Iterator[Diagnostic]:
    """The refusal of a controller that cannot be chained, or is active without the one that it needs."""
    found = chain_problem(name, spec, every)
    if found is not None:
        yield Diagnostic("CTRL172", f"controller '{name}' cannot be chained: {found[0]}", place, hint=found[1])
    elif (target := target_of(spec)) and spec.active and not every[target].active:
        message = f"controller '{name}' is active, but '{target}', whose references it commands, is not"
        yield Diagnostic("CTRL171", message, place, hint=f"activate both, or set `active: false` for '{name}'")
