"""Outline of a plan, which a log carries as `plan.json`; only this module writes and reads it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Any

from manipcli.plan.motion import Motion

PLAN_FILE = "plan.json"
"""The attachment with the planned steps: `{"steps": [{"id", "verb", "place", "planned_duration", "motions"}, ...],
"judged": [...]}`; with `"blocks": [...]` if steps are grouped."""


@dataclass(frozen=True, slots=True)
class StepOutline:
    """One planned step.

    Attributes:
        id, verb: of the step.
        place: where it is written, `pour.yaml:21:5`; "" where the log has none.
        planned_duration: [s]; None if it is planned during the run.
        motions: written for the reader of a log; not read back.
    """

    id: str
    verb: str
    place: str
    planned_duration: float | None
    motions: tuple[Motion, ...] = ()


@dataclass(frozen=True, slots=True)
class BlockOutline:
    """One block: `steps[first:last]`, of an `if` with `else` from `split` on; see `spec.block`."""

    id: str
    kind: str
    word: str
    first: int
    last: int
    split: int
    parent: int | None
    place: str


@dataclass(frozen=True, slots=True)
class PlanOutline:
    """All steps; `judged`: where expectations and watches are written; `blocks`: groups of steps."""

    steps: tuple[StepOutline, ...] = ()
    judged: tuple[str, ...] = ()
    blocks: tuple[BlockOutline, ...] = ()

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
        blocks = {"blocks": [asdict(block) for block in self.blocks]} if self.blocks else {}
        return json.dumps({"steps": steps, "judged": list(self.judged), **blocks}, indent=1).encode()

    @classmethod
    def read(cls, content: bytes | None) -> PlanOutline:
        """The plan in an attachment; without steps if there is no attachment, or if it is not a plan."""
        try:
            plan: Any = json.loads(content or b"{}")  # Any: the content of a file is not known before
            steps = tuple(
                StepOutline(str(s["id"]), str(s["verb"]), str(s.get("place", "")), _seconds(s["planned_duration"]))
                for s in plan.get("steps", ())
            )
            judged = tuple(str(place) for place in plan.get("judged", ()))
            return cls(steps, judged, tuple(_block(b) for b in plan.get("blocks", ())))
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
            return cls()


def _seconds(value: Any) -> float | None:
    return None if value is None else float(value)


def _block(b: Any) -> BlockOutline:
    """A block as it was written; raises KeyError, TypeError or ValueError for anything else."""
    parent = None if b["parent"] is None else int(b["parent"])
    first, last, split = int(b["first"]), int(b["last"]), int(b["split"])
    return BlockOutline(str(b["id"]), str(b["kind"]), str(b["word"]), first, last, split, parent, str(b["place"]))


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
