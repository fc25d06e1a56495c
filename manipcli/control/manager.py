"""Controller manager: states and claims of all controllers of a robot, and their update once per control tick.

    manager = build_controllers(spec, robot, period)       # factory.py; or ControllerManager([...], joints=..., ...)
    command = manager.update(time, state, contact_force)   # a JointCommand, before limits, until the next update

where `state` has the measured `position`, `velocity`, `effort` (n) in the order of `joints` (a `WorldState`, for
example), and `contact_force` (n) [N] is the normal force of contacts on the links that each joint moves (see
`Controller`); it need only be up to date while `senses_contact`. Send goals to the controllers:
`manager["arm_controller"].send_goal(...)`; `manager.serving(joints)` is the active controller that claims them.

A controller is unconfigured when loaded, inactive when configured, and active when switched on, as in ros2_control. A
switch is done as a whole or not at all, between two updates, so it has no timeout.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Protocol

import numpy as np

from manipcli.control.chain import broken_chains, depth_of, takes_references, target_of
from manipcli.control.claims import Claims, conflicts
from manipcli.control.command import JointCommand, mode_of
from manipcli.control.compiled import bind
from manipcli.control.compiled.library import integers
from manipcli.control.controller import Controller, ControllerOutput
from manipcli.control.feed_forward import FeedForwardLaw, Index, NoDynamics
from manipcli.control.lifecycle import (
    ControllerInfo,
    Slot,
    SwitchResult,
    cause_of,
    decided,
    names_of,
    strictness_of,
    ticks_between,
)
from manipcli.core.errors import Diagnostic, InvalidArgument, InvalidInput
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.plan.motion import Strictness, Switch
from manipcli.spec.controllers import Interface


class JointVectors(Protocol):
    """Measured joints of the whole robot, arrays (n)."""

    @property
    def position(self) -> Array: ...
    @property
    def velocity(self) -> Array: ...
    @property
    def effort(self) -> Array: ...


class ControllerManager:
    """Holds the controllers of one robot.

    Args:
        controllers: loaded, configured and activated at once.
        joints: (n) all moving joints of the robot, in the order of its joint vectors.
        period: [s] between two updates.
        following: joints that cannot be commanded, because they follow others (mimic).
        feed_forward: adds gravity or inverse dynamics for the controllers that want it.

    Attributes:
        locked: why no controller can be activated; "": they can.

    Raises:
        InvalidInput: every conflict at once: duplicate names or claims, joints that are unknown or follow others.
        InvalidArgument: a period that is not above 0.
    """

    def __init__(
        self,
        controllers: Sequence[Controller] = (),
        *,
        joints: Sequence[str],
        period: float,
        following: Sequence[str] = (),
        feed_forward: FeedForwardLaw | None = None,
    ) -> None:
        if not 0.0 < period < np.inf:
            raise InvalidArgument("CTRL165", f"the control period is {period} s; expected a time above 0")
        self.joints = tuple(joints)
        self.period = period
        self.following = tuple(following)
        self.command = JointCommand(len(self.joints))
        self.outputs: tuple[ControllerOutput | None, ...] = ()
        self.faults: tuple[Diagnostic, ...] = ()
        self.locked = ""
        self._feed_forward = feed_forward if feed_forward is not None else NoDynamics()
        self._slots: dict[str, Slot] = {}
        self._active: tuple[Slot, ...] = ()
        self._seen: tuple[Array, Array, Array] | None = None
        self._felt: Array | None = None
        self._tick = 0
        self._references = False
        self._copy = self._copier(())
        findings = (*conflicts(controllers, self.joints, self.following), *broken_chains(controllers))
        if findings:
            raise InvalidInput(findings)
        for controller in controllers:
            self.load(controller)
            self.configure(controller.name)
        self.switch(activate=[controller.name for controller in controllers])

    @property
    def started(self) -> bool:
        """Whether there has been an update."""
        return self._tick > 0

    @property
    def senses_contact(self) -> bool:
        """Whether an active controller needs contact forces at the next update."""
        return any(slot.controller.senses_contact for slot in self._active)

    @property
    def controllers(self) -> tuple[Controller, ...]:
        """All controllers in the order of their first loading, also those that were unloaded and may be reloaded."""
        return tuple(slot.controller for slot in self._slots.values())

    def load(self, controller: Controller, *, update_rate: float | None = None) -> None:
        """Load a controller; it is unconfigured.

        Args:
            controller: its name must not be loaded.
            update_rate: [Hz] of its updates, a whole fraction of the control rate; None: at every tick.

        Raises:
            InvalidArgument: its name is taken, its rate does not divide the control rate or is not above 0.
            InvalidInput: a joint that the robot does not have or that follows another.
        """
        if controller.name in self._slots:
            raise InvalidArgument("CTRL141", f"duplicate controller name '{controller.name}'")
        if findings := conflicts([controller], self.joints, self.following):
            raise InvalidInput(findings)
        every = 1 if update_rate is None else ticks_between(update_rate, self.period)
        where = [self.joints.index(name) for name in controller.joints]
        index: Index = np.array(where, dtype=np.intp)
        if where and where == list(range(where[0], where[0] + len(where))):
            index = slice(where[0], where[0] + len(where))
        self._slots[controller.name] = Slot(controller, index, every, self.period)
        self._rearrange()

    def configure(self, name: str) -> None:
        """Configure a controller, so that it can be activated.

        Raises:
            InvalidArgument: it is unknown or active.
        """
        slot = self._slot(name)
        if slot.state == "active":
            raise InvalidArgument("CTRL160", f"controller '{name}' is active; deactivate it before configuring it")
        slot.state = "inactive"

    def cleanup(self, name: str) -> None:
        """Return an inactive controller to unconfigured.

        Raises:
            InvalidArgument: it is unknown, active, or unconfigured already.
        """
        slot = self._slot(name)
        if slot.state != "inactive":
            message = f"controller '{name}' is {slot.state}; only an inactive controller can be cleaned up"
            raise InvalidArgument("CTRL160", message)
        slot.state = "unconfigured"

    def unload(self, name: str, *, keep: bool = False) -> None:
        """Unload a controller that is not active; `keep`: with its place in `controllers` and `outputs`, for `reload`.

        Raises:
            InvalidArgument: it is unknown or active.
        """
        slot = self._slot(name)
        if slot.state == "active":
            raise InvalidArgument("CTRL160", f"controller '{name}' is active; deactivate it before unloading it")
        if keep:
            slot.state, slot.loaded = "unconfigured", False
        else:
            del self._slots[name]
        self._rearrange()

    def reload(self, name: str) -> Controller:
        """Load a controller again that was unloaded and kept; it is unconfigured.

        Raises:
            InvalidArgument: it is unknown or loaded.
        """
        if (slot := self._slots.get(name)) is None:
            hint = did_you_mean(name, self._slots, kind="controllers")
            raise InvalidArgument("CTRL161", f"unknown controller '{name}'", hint=hint)
        if slot.loaded:
            raise InvalidArgument("CTRL141", f"controller '{name}' is loaded already")
        slot.loaded = True
        return slot.controller

    def switch(
        self,
        activate: Collection[str] = (),
        deactivate: Collection[str] = (),
        *,
        strictness: Strictness = "strict",
        time: float = 0.0,
    ) -> SwitchResult:
        """Deactivate and activate controllers, as a whole or, if refused, not at all.

        A name on both lists restarts that controller. With `best_effort`, names that cannot be switched are left out
        and reported, also if claims conflict; it is refused only if no name of a list is loaded.

        Args:
            activate, deactivate: names, or a single name.
            strictness: see above; case is ignored.
            time: simulated time [s], for the results of goals that end.

        Raises:
            InvalidArgument: an unknown strictness.
        """
        on, off = names_of(activate), names_of(deactivate)
        return self.carry_out(Switch(activate=on, deactivate=off, strictness=strictness_of(strictness)), time=time)

    def switch_to(
        self, names: Collection[str], *, strictness: Strictness = "strict", time: float = 0.0
    ) -> SwitchResult:
        """Activate `names` and deactivate all others on their joints; active ones are unchanged. See `switch`."""
        return self.carry_out(Switch(to=names_of(names), strictness=strictness_of(strictness)), time=time)

    def carry_out(self, switch: Switch, *, time: float) -> SwitchResult:
        """Carry out the switch of a step; see `switch` and `switch_to`."""
        controllers = {name: (slot.controller, slot.state) for name, slot in self._slots.items() if slot.loaded}
        decision = decided(controllers, switch, self.joints, self.following)
        if decision.activated and self.locked:
            decision = SwitchResult(False, (*decision.messages, self.locked))
        if not decision.ok:
            return decision
        for name in decision.deactivated:
            self._slots[name].controller.deactivate(time)
            self._slots[name].state = "inactive"
        for name in decision.activated:
            self._slots[name].state = "active"
            self._slots[name].first = self._tick
        self._rearrange()
        return decision

    def is_active(self, name: str) -> bool:
        """Whether a controller is loaded and active."""
        return any(slot.controller.name == name for slot in self._active)

    def list(self) -> tuple[ControllerInfo, ...]:
        """All loaded controllers, and their claims."""
        return tuple(ControllerInfo.of(s.controller, s.state, s.every) for s in self._slots.values() if s.loaded)

    def __getitem__(self, name: str) -> Controller:
        return self._slot(name).controller

    def _slot(self, name: str) -> Slot:
        slot = self._slots.get(name)
        if slot is None or not slot.loaded:
            hint = did_you_mean(name, [own.name for own in self.list()], kind="controllers")
            raise InvalidArgument("CTRL161", f"controller '{name}' is not loaded", hint=hint)
        return slot

    def serving(self, joints: Sequence[str]) -> Controller:
        """The active controller that claims all of `joints`.

        Raises:
            InvalidArgument: no active controller does.
        """
        active = [slot.controller for slot in self._active]
        for controller in active:  # a chain has its first controller first
            if controller.interfaces and set(joints) <= set(controller.joints):
                return controller
        claims = "; ".join(f"{c.name}: {', '.join(c.joints)}" for c in active) or "no controller is active"
        message = f"no active controller claims all of {', '.join(joints)} ({claims})"
        fault = self.faults[-1].message if self.faults else None
        raise InvalidArgument("CTRL140", message, hint=self.locked or fault)

    def keep_references(self) -> None:
        """Include the references in the command from now on."""
        self._references = True
        self._rearrange()

    def _rearrange(self) -> None:
        """Update the modes of the joints and the work per tick, after a change of loaded or active controllers."""
        active = [slot for slot in self._slots.values() if slot.state == "active"]
        targets = {slot.controller.name: target_of(slot.controller) for slot in active}
        self._active = tuple(sorted(active, key=lambda slot: -depth_of(slot.controller, targets)))  # preceding first
        self._chain()
        claimed = Claims.of([slot.controller for slot in self._active])
        modes = ["free" if joint in self.following else mode_of(claimed.interfaces(joint)) for joint in self.joints]
        self.command.obey(modes)
        self._feed_forward.serve([(s.controller, s.index, s.every, s.first) for s in self._active])
        self._copy = self._copier([copy for slot in self._active for copy in self._copies(slot)])
        self._seen = self._felt = None
        self.outputs = tuple(s.controller.output if s.state == "active" else None for s in self._slots.values())

    def _chain(self) -> None:
        """Connect the commands of each active controller that precedes another with the references of that one."""
        preceding = {target_of(slot.controller): slot.controller for slot in self._active}
        for slot in self._slots.values():
            controller, source = slot.controller, preceding.get(slot.controller.name)
            if not takes_references(controller):
                continue
            if source is None or slot.state != "active":
                controller.chain(None)
                continue
            order = [source.joints.index(joint) for joint in controller.joints]
            controller.chain(dict(zip(source.interfaces, source.output.commands, strict=True)), order)

    def _copier(self, copies: Sequence[tuple[Array, Index, Array]]) -> Callable[[], object]:
        """Copies (target, index, source) in one compiled call if possible."""
        n = len(self.joints)
        flat = [array for target, index, source in copies for array in (target, integers(index, n), source)]

        def law() -> None:
            for target, index, source in copies:
                target[index] = source

        return bind("copies", n, *flat) or law

    def _copies(self, slot: Slot) -> tuple[tuple[Array, Index, Array], ...]:
        """The copies into the command at every tick: target, index, source."""
        command, output = self.command, slot.controller.output
        commands: dict[Interface, Array] = {
            "position": command.position,
            "velocity": command.velocity,
            "acceleration": command.acceleration,
            "effort": command.effort,
        }
        if target_of(slot.controller):
            return ()
        pairs = zip(slot.controller.interfaces, output.commands, strict=True)
        copies = [(commands[interface], slot.index, row) for interface, row in pairs]
        if self._references and slot.controller.interfaces:
            copies.append((command.reference_position, slot.index, output.position))
            copies.append((command.reference_velocity, slot.index, output.velocity))
        return tuple(copies)

    def _look(self, state: JointVectors, contact_force: Array | None) -> None:
        """Set the slots' views of new measured vectors."""
        for name in ("position", "velocity", "effort"):
            vector = getattr(state, name)
            if not isinstance(vector, np.ndarray) or vector.shape != (len(self.joints),):
                message = f"measured {name} is {vector!r}; expected an array of {len(self.joints)} numbers"
                raise InvalidArgument("CTRL166", message)
        vectors = self._seen = (state.position, state.velocity, state.effort)
        self._felt = contact_force
        for slot in self._active:
            slot.look(vectors, contact_force)

    def update(self, time: float, state: JointVectors, contact_force: Array | None = None) -> JointCommand:
        """One control tick at `time` [s]; see the module for the vectors.

        A controller that raises is deactivated: its goal is aborted with the cause, its joints are held by a brake, and
        `faults` has a new entry.

        Raises:
            InvalidArgument: measured vectors that are not arrays with one number per joint.
        """
        seen = self._seen
        if seen is None or seen[0] is not state.position or self._felt is not contact_force:
            self._look(state, contact_force)
        tick, self._tick = self._tick, self._tick + 1
        for slot in self._active:
            if slot.scattered:
                slot.gather()
            if slot.every == 1 or (tick - slot.first) % slot.every == 0:
                try:
                    slot.controller.update(time, slot.period, slot.measured, contact_force=slot.contact_force)
                except Exception as error:  # noqa: BLE001  (an error in a controller stops only that controller)
                    self._fail(slot, cause_of(error), time)
        self._feed_forward.add(tick, state.position, state.velocity)
        self._copy()
        return self.command

    def _fail(self, slot: Slot, cause: str, time: float) -> None:
        text = f"controller '{slot.controller.name}' failed in its update: {cause}"
        self.faults += (Diagnostic("CTRL162", text),)
        slot.controller.deactivate(time, text)
        slot.state = "inactive"
        for other in self._active:
            if other.state == "active" and target_of(other.controller) == slot.controller.name:
                other.controller.deactivate(time, text)
                other.state = "inactive"
        self._rearrange()

    def stop_non_finite(self, time: float) -> None:
        """Deactivate, as failed, all controllers whose commands are not finite."""
        for slot in self._active:
            for interface, command in zip(slot.controller.interfaces, slot.controller.output.commands, strict=True):
                if len(bad := np.flatnonzero(~np.isfinite(command))):
                    joint = slot.controller.joints[bad[0]]
                    self._fail(slot, f"its command for {joint}/{interface} is {command[bad[0]]}", time)
                    break

    def deactivate(self, time: float) -> None:
        """Abort all goals; the next update re-activates the controllers."""
        for slot in self._active:
            slot.controller.deactivate(time)
