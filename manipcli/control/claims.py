"""Who claims what: an interface of a joint belongs to one active controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from manipcli.control.command import may_go_together
from manipcli.control.controller import Controller
from manipcli.core.errors import Finding
from manipcli.core.text import did_you_mean
from manipcli.spec.controllers import Interface


@dataclass(frozen=True, slots=True)
class Claims:
    """`joint/interface` -> the name of the controller that claims it, in the order of claiming."""

    owners: dict[tuple[str, Interface], str]

    @staticmethod
    def of(controllers: Sequence[Controller]) -> Claims:
        """Of these controllers; where two claim the same, the first has it."""
        owners: dict[tuple[str, Interface], str] = {}
        for controller in controllers:
            for joint in controller.joints:
                for interface in controller.interfaces:
                    owners.setdefault((joint, interface), controller.name)
        return Claims(owners)

    def interfaces(self, joint: str) -> tuple[Interface, ...]:
        """What is claimed of a joint."""
        return tuple(interface for name, interface in self.owners if name == joint)


def conflicts(
    controllers: Sequence[Controller], joints: Sequence[str], following: Sequence[str] = ()
) -> tuple[Finding, ...]:
    """Everything for which these controllers cannot be active at once.

    Args:
        controllers: in the order in which they would claim.
        joints: all moving joints of the robot.
        following: those that follow others.
    """
    findings = []
    names = [controller.name for controller in controllers]
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            findings.append(Finding("CTRL141", f"two controllers are named '{name}'"))
    claims = Claims.of(controllers)
    for controller in controllers:
        for joint in controller.joints:
            findings += _conflicts_of(controller, joint, claims, joints, following)
    return tuple(findings)


def _conflicts_of(
    controller: Controller, joint: str, claims: Claims, joints: Sequence[str], following: Sequence[str]
) -> list[Finding]:
    name = controller.name
    if joint not in joints:
        message = f"controller '{name}' wants joint '{joint}', but the robot has no such moving joint"
        return [Finding("CTRL144", message, hint=did_you_mean(joint, joints, kind="joints"))]
    if joint in following and controller.interfaces:
        what = f"{joint}/{controller.interfaces[0]}"
        return [Finding("CTRL143", f"controller '{name}' claims {what}, but joint '{joint}' follows another joint")]
    others = [
        (interface, owner) for interface in controller.interfaces if (owner := claims.owners[joint, interface]) != name
    ]
    if others:
        interface, owner = others[0]
        message = f"controllers '{owner}' and '{name}' both claim {joint}/{interface}"
        return [Finding("CTRL142", message)]
    together = claims.interfaces(joint)
    if controller.interfaces and not may_go_together(together):
        listed = ", ".join(f"{joint}/{i} ({claims.owners[joint, i]})" for i in together)
        return [Finding("CTRL148", f"a joint cannot be commanded on all of these at once: {listed}")]
    return []
