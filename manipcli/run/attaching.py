"""Attachments of a running task: made and freed with the phases of steps, and their events in the log."""

from __future__ import annotations

from collections.abc import Callable

from manipcli.model.holding import Holding
from manipcli.plan.motion import Motion
from manipcli.simulate.session import Session
from manipcli.task.plan_steps import PlannedStep

Event = Callable[[str, PlannedStep, str, str], None]
"""Records an event: kind, step, outcome, text."""


class Attaching:
    """The attachments of one run; has no effect where contact and friction hold objects.

    Args:
        session: the running world.
        event: records.
    """

    def __init__(self, session: Session, event: Event) -> None:
        self._session, self._holder, self._event = session, session.holder, event
        self._broken = ""

    @property
    def holding(self) -> Holding | None:
        """What attaches objects to the tool."""
        return None if self._holder is None else self._holder.holding

    def before(self, motion: Motion, step: PlannedStep) -> None:
        """Free what is attached, if the motion begins with that."""
        if self._holder is not None and motion.lets_go:
            if self._holder.attached:
                self._event("detached", step, "", f"'{self._holder.attached}' freed")
            self._holder.let_go()

    def after(self, motion: Motion, step: PlannedStep) -> str:
        """Attach the object that the motion takes; why it could not be attached, or ""."""
        if self._holder is None or motion.takes is None:
            return ""
        missed = self._holder.take(motion.takes, self._session.engine.read(), self._session.touching)
        if missed:
            return f"{motion.label}: the {self._holder.holding.kind} does not hold '{motion.takes}': {missed}"
        self._event("attached", step, "", self._holder.holding.held(motion.takes))
        return ""

    def resumed(self, step: PlannedStep) -> None:
        """Record what is attached in the start state, before its first step."""
        if self._holder is not None and self._holder.attached:
            self._event("attached", step, "", self._holder.holding.held(self._holder.attached))

    def look(self, step: PlannedStep | None) -> None:
        """At every tick: record that an attachment broke."""
        if self._holder is not None and self._holder.broken != self._broken:
            self._broken = self._holder.broken
            if self._broken and step is not None:
                self._event("attachment_broken", step, "", self._broken)
