"""Outline of a plan, which a log carries as `plan.json`; only this module writes and reads it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from manipcli.plan.motion import Motion

PLAN_FILE = "plan.json"
"""The attachment with the planned steps: `{"steps": [{"id", "verb", "place", "planned_duration", "motions"}, ...],
"judged": [...]}`."""


@dataclass(frozen=True, slots=True)
class StepOutline:
    """One planned step.

    Attributes:
        id, verb: of the step.
        place: where it is written, `pour.yaml:21:5`; "" where the log has none.
        planned_duration: [s].
        motions: written for the reader of a log; not read back.
    """

    id: str
    verb: str
    place: str
    planned_duration: float
    motions: tuple[Motion, ...] = ()


@dataclass(frozen=True, slots=True)
class PlanOutline:
    """All planned steps; `judged`: where expectations and watches are written."""

    steps: tuple[StepOutline, ...] = ()
    judged: tuple[str, ...] = ()

    def to_json(self) -> bytes:
        """The attachment; it has only the two ends of each trajectory."""
        steps = [
            {
                "id": step.id,
                "verb": step.verb,
                "place": step.place,
                "planned_duration": step.planned_duration,
                "motions": [_motion(motion) for motion in step.motions],
            }
            for step in self.steps
        ]
        return json.dumps({"steps": steps, "judged": list(self.judged)}, indent=1).encode()

    @classmethod
    def read(cls, content: bytes | None) -> PlanOutline:
        """The plan in an attachment; without steps if there is no attachment, or if it is not a plan."""
        try:
            plan: Any = json.loads(content or b"{}")  # Any: the content of a file is not known before
            steps = tuple(
                StepOutline(str(s["id"]), str(s["verb"]), str(s.get("place", "")), float(s["planned_duration"]))
                for s in plan.get("steps", ())
            )
            return cls(steps, tuple(str(place) for place in plan.get("judged", ())))
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
            return cls()


def _motion(motion: Motion) -> dict[str, object]:
    written: dict[str, object] = {"label": motion.label, "duration": motion.duration}
    if motion.trajectory is not None:
        written["joints"] = list(motion.trajectory.names)
        written["from"] = motion.trajectory.positions[0].tolist()
        written["to"] = motion.trajectory.positions[-1].tolist()
    if motion.grip is not None:
        written["hand"] = motion.grip.target.tolist()
        written["force"] = motion.grip.force
    if motion.takes is not None:
        written["attaches"] = motion.takes
    if motion.switch is not None:
        written["switch"] = {
            key: list(names) for key in ("to", "activate", "deactivate") if (names := getattr(motion.switch, key))
        }
    return written
