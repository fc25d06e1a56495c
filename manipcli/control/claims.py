"""Claims of controllers: a command interface of a joint belongs to one active controller."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Protocol

from manipcli.control.chain import resources
from manipcli.control.command import may_go_together
from manipcli.core.errors import Diagnostic
from manipcli.core.text import did_you_mean, listed
from manipcli.spec.controllers import Interface


class Claimant(Protocol):
    """The attributes of a controller that matter for claims."""

    @property
    def name(self) -> str: ...
    @property
    def joints(self) -> tuple[str, ...]: ...
    @property
    def interfaces(self) -> tuple[Interface, ...]: ...


@dataclass(frozen=True, slots=True)
class Claims:
    """Name of the controller that claims each (joint, interface), in the order of claiming."""

    owners: dict[tuple[str, Interface], str]

    @staticmethod
    def of(controllers: Sequence[Claimant]) -> Claims:
        """The claims of these controllers; of two that claim the same, the first owns it."""
        owners: dict[tuple[str, Interface], str] = {}
        for controller in controllers:
            for joint in resources(controller):
                for interface in controller.interfaces:
                    owners.setdefault((joint, interface), controller.name)
        return Claims(owners)

    def interfaces(self, joint: str) -> tuple[Interface, ...]:
        """The claimed interfaces of a joint."""
        return tuple(interface for name, interface in self.owners if name == joint)


def conflicts(
    controllers: Sequence[Claimant], joints: Collection[str], following: Collection[str]
) -> tuple[Diagnostic, ...]:
    """Every conflict that keeps these controllers from being active together.

    Args:
        controllers: in the order of claiming.
        joints: all moving joints of the robot.
        following: joints that follow others (mimic).
    """
    findings = []
    names = [controller.name for controller in controllers]
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            findings.append(Diagnostic("CTRL141", f"duplicate controller name '{name}'"))
    claims = Claims.of(controllers)
    twice: dict[tuple[str, str], list[str]] = {}
    excluded: dict[tuple[tuple[Interface, str], ...], dict[str, None]] = {}
    for controller in controllers:
        for own, joint in zip(controller.joints, resources(controller), strict=True):
            unfit = _unfit(controller, own, joints, following)
            if unfit is not None:
                findings.append(unfit)
                continue
            for interface in controller.interfaces:
                owner = claims.owners[joint, interface]
                if owner != controller.name:
                    twice.setdefault((owner, controller.name), []).append(f"{joint}/{interface}")
            together = claims.interfaces(joint)
            if not may_go_together(together):
                excluded.setdefault(tuple((i, claims.owners[joint, i]) for i in together), {})[joint] = None
    for (owner, name), what in twice.items():
        findings.append(Diagnostic("CTRL142", f"controllers '{owner}' and '{name}' both claim {listed(what, most=3)}"))
    for claimed, (first, *others) in excluded.items():
        all_of = ", ".join(f"{first}/{interface} ({owner})" for interface, owner in claimed)
        more = f"; likewise for {listed(others, most=3)}" if others else ""
        findings.append(Diagnostic("CTRL148", f"conflicting command interfaces of one joint: {all_of}{more}"))
    return tuple(findings)


def _unfit(controller: Claimant, joint: str, joints: Collection[str], following: Collection[str]) -> Diagnostic | None:
    """Why a controller can never claim a joint."""
    name = controller.name
    if joint not in joints:
        message = f"controller '{name}': joint '{joint}' is not a moving joint of the robot"
        return Diagnostic("CTRL144", message, hint=did_you_mean(joint, joints, kind="joints"))
    if joint in following and controller.interfaces:
        what = f"{joint}/{controller.interfaces[0]}"
        return Diagnostic("CTRL143", f"controller '{name}' claims {what}, but joint '{joint}' mimics another joint")
    return None
