"""What happened in the session, from the messages of its log: states of steps, and the last messages."""

from __future__ import annotations

from collections import deque
from typing import Any, Final

from manipcli.live.offer import RESET, SESSION_ENDED
from manipcli.live.page.snapshot import ENDED, RESETTING
from manipcli.record import schemas
from manipcli.record.channels import EVENTS, ROSOUT
from manipcli.record.json_message import definition, to_json

TOPICS: Final = (EVENTS, ROSOUT)
"""Topics that it reads."""
SHOWN: Final = 12
"""Messages."""
MOST_STEPS: Final = 200
STARTED, STOPPED, RELEASED = "session_started", "emergency_stop", "emergency_stop_released"
"""Kinds of events."""
PHASES: Final = {STARTED: "", RESET: RESETTING, SESSION_ENDED: ENDED}
RUNNING: Final = "running"
DONE: Final = "done"
WAITING: Final = 2000
"""Messages that wait for the page; the oldest are dropped."""


class Story:
    """Collects events, in any thread, and reads them in the thread of the page.

    Attributes:
        steps: verb or text, and state ("running" or the outcome), by step, in the order of their first start.
        stopped: whether the emergency stop is active.
        phase: see `Snapshot`.
        messages: time [s], level and text of the last ones of this session.
    """

    def __init__(self) -> None:
        self.stopped = False
        self.phase = ""
        self.steps: dict[str, tuple[str, str]] = {}
        self.messages: deque[tuple[float, int, str]] = deque(maxlen=SHOWN)
        self._waiting: deque[tuple[str, bytes]] = deque(maxlen=WAITING)

    def hear(self, topic: str, data: bytes) -> None:
        """Keep a message in CDR for `read`; never blocks."""
        if topic in TOPICS:
            self._waiting.append((topic, data))

    def read(self) -> bool:
        """Read what waits; whether there was something."""
        found = False
        while self._waiting:
            topic, data = self._waiting.popleft()
            found = True
            if topic == ROSOUT:
                self._log(to_json(definition(schemas.LOG), data))
            else:
                self._step(to_json(definition(schemas.TASK_EVENT), data))
        return found

    def _log(self, message: dict[str, Any]) -> None:
        stamp = message["stamp"]
        if message["function"] == STARTED:  # what was before a reset has times of another session
            self.messages.clear()
        time = stamp["sec"] + 1e-9 * stamp["nanosec"]
        self.messages.append((time, message["level"], without_repetition(message["msg"])))

    def _step(self, event: dict[str, Any]) -> None:
        step, kind, verb, text = (event[key] for key in ("step", "kind", "verb", "text"))
        if kind == STARTED:  # also after a reset
            self.steps.clear()
        if kind in PHASES:
            self.phase = PHASES[kind]
        if kind in (STARTED, STOPPED, RELEASED):
            self.stopped = kind == STOPPED
        if not step or (step not in self.steps and len(self.steps) >= MOST_STEPS):
            return
        match kind:
            case "step_started":
                self.steps[step] = (verb, RUNNING)
            case "phase_started":
                self.steps[step] = (f"{verb}: {text}", RUNNING)
            case "step_ended" | "step_skipped":
                outcome = event["outcome"]
                self.steps[step] = (verb if outcome == DONE else text or verb, outcome)


def without_repetition(message: str) -> str:
    """A line of `/rosout`, `kind outcome: text`, without the word "error", which its color shows, and without a kind
    that its text repeats."""
    kind, colon, text = message.partition(": ")
    kind = kind.removesuffix(" error")
    return text if colon and text.startswith(f"{kind}:") else f"{kind}{colon}{text}"
