"""What happens at a time of a run, in one line: verdict, cause of failure, phase, what is in the hand, margin."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, Literal

import numpy as np

from manipcli.model.grasp import GRIP_FORCE, LINK, pressing
from manipcli.replay.curves_json import sampled
from manipcli.replay.playback import Playback, PlaybackStep

Mood = Literal["plain", "good", "bad"]

AT: Final = 0.03
"""[s] A cause is shown this long before and after its time."""
FINE: Final = ("done", "", "skipped", "not_run")


def failed_step(playback: Playback, time: float) -> PlaybackStep | None:
    """The active step at `time` [s], if it was not done."""
    step = playback.step_at(time)
    return None if step is None or step.outcome in FINE else step


def happening(playback: Playback, time: float) -> tuple[str, Mood]:
    """The line of a caption, and whether it is good or bad news; "" if there is nothing to say."""
    verdict, failed = playback.verdict, failed_step(playback, time)
    if failed is not None:
        when = "failed" if time >= failed.end - AT else f"fails at {failed.end:.2f} s"
        return f"{when}: {failed.text}" if failed.text else when, "bad"
    cause = next((one for one in playback.causes if one.at is not None and abs(one.at - time) <= AT), None)
    if cause is not None:
        return ": ".join(filter(None, (cause.title, cause.text))), "bad"
    if verdict is not None and time >= playback.end - AT:
        good = verdict.verdict == "passed"
        return (": ".join(filter(None, (verdict.verdict, verdict.text))), "good" if good else "bad")
    return "   ".join(_facts(playback, time)), "plain"


def _facts(playback: Playback, time: float) -> Iterator[str]:
    step = playback.step_at(time)
    phases = step.phases if step is not None else ()
    phase = next((phase.name for phase in reversed(phases) if phase.start <= time <= phase.end), "")
    if phase and step is not None and phase != step.verb:
        yield phase
    yield from _touched(playback, playback.index(time))
    yield from _tightest(playback, playback.index(time))


def _touched(playback: Playback, k: int) -> Iterator[str]:
    """The bodies that the robot grips, or else touches, with the force of its strongest link."""
    contacts = playback.contacts[k]
    bodies = dict.fromkeys(
        name for one in contacts for name in (one.a, one.b) if LINK in one.a + one.b and not name.startswith(LINK)
    )
    for body in bodies:
        forces = [force for force, _ in pressing(contacts, body)]
        if len(forces) > 1 and forces[1] >= GRIP_FORCE:
            yield f"grips '{body}' with {forces[0]:.3g} N"
        elif forces and forces[0] >= GRIP_FORCE:
            yield f"touches '{body}' with {forces[0]:.3g} N"


def _tightest(playback: Playback, k: int) -> Iterator[str]:
    """The expectation with the least margin now, in units of its tolerance."""
    found = []
    for curve in playback.margins:
        margin, relative = (float(values[k]) for values in sampled(curve, playback.times))
        if np.isfinite(relative) and playback.times[k] >= curve.since:
            found.append((relative, f"{curve.outcome.name}: margin {margin:.3g} {curve.unit or 'tolerances'}"))
    if found:
        yield min(found)[1]
