"""Gains of a controller that may change while it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final, Protocol, TypeGuard

from manipcli.control.controller import Controller
from manipcli.control.gains import gains_of
from manipcli.core.errors import InvalidArgument
from manipcli.spec.controllers import GainsSpec

FIXED: Final = frozenset({"antiwindup", "antiwindup_strategy", "angle_wraparound", "save_i_term"})
"""Gains that select a law, which is chosen when the controller is built."""


class TunableGains:
    """The gains of each joint, as in the controllers file, and their change.

    Args:
        name: of the controller.
        joints: (n) of the controller.
        initial: (n) as in its file.
        apply: makes the controller use gains (n) from its next update on; raises InvalidArgument and changes nothing.
    """

    def __init__(
        self,
        name: str,
        joints: Sequence[str],
        initial: Sequence[GainsSpec],
        apply: Callable[[tuple[GainsSpec, ...]], None],
    ) -> None:
        self._name, self._joints, self._initial = name, tuple(joints), tuple(initial)
        self._apply = apply
        self._now = dict(zip(self._joints, self._initial, strict=True))

    @property
    def now(self) -> Mapping[str, GainsSpec]:
        """By joint, those of the next update."""
        return self._now

    def change(
        self,
        values: Mapping[tuple[str, str], object],
        check: Callable[[Mapping[str, GainsSpec]], None] = lambda _: None,
    ) -> None:
        """Change gains from the next update on, all or none.

        Args:
            values: by joint and name of the gain, which `now` has; None removes a bound.
            check: called with the new gains by joint; raises InvalidArgument to refuse them.

        Raises:
            InvalidArgument: a value that the controllers file may not have either, or one of `FIXED`.
        """
        new = dict(self._now)
        for (joint, gain), value in values.items():
            if gain in FIXED:
                message = f"controller '{self._name}': {gain} of joint '{joint}' cannot change while it is loaded"
                raise InvalidArgument("CTRL222", message, hint="set it in the controllers file")
            given = new[joint].model_dump(exclude_unset=True) | {gain: value}
            new[joint] = gains_of(self._name, joint, given, type(new[joint]))
        check(new)
        self._apply(tuple(new[joint] for joint in self._joints))
        self._now = new

    def reset(self) -> None:
        """The gains of the file again."""
        self._apply(self._initial)
        self._now = dict(zip(self._joints, self._initial, strict=True))


class Tunable(Controller, Protocol):
    """A controller with gains; None: the gains that its file may give have no effect on its interface."""

    gains: TunableGains | None


def gains_in(controller: Controller) -> TunableGains | None:
    """The gains of a controller that may change; None: it has none."""
    return controller.gains if _has_gains(controller) else None


def _has_gains(controller: Controller) -> TypeGuard[Tunable]:
    return hasattr(controller, "gains")
