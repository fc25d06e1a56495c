"""Content of a log without judging it, also of damaged logs and logs of other programs."""

from __future__ import annotations

from pathlib import Path

from manipcli.judge.steps import ENDED, RunStatus, block_outcomes, left_out, step_outcomes
from manipcli.judge.verdict import BlockOutcome, StepOutcome
from manipcli.record import channels
from manipcli.record.contents import RECORD
from manipcli.record.faults import BadRecording
from manipcli.record.foreign.namespaces import meant
from manipcli.record.foreign.topics import open_topics
from manipcli.record.read.reading import open_recording
from manipcli.report.logs.log_info import LogInfo

COMMON = (channels.ROBOT_DESCRIPTION, channels.JOINT_STATES, channels.TF)
"""Topics that manipcli reads from the log of any program."""


def log_info(path: Path) -> LogInfo:
    """Topics, steps, metadata and missing parts of a log.

    Raises:
        BadRecording: the file is not an MCAP file, or cannot be read.
    """
    found = open_topics(path, damaged=True)
    ours = RECORD in found.metadata
    missing = list(found.faults)
    steps: tuple[StepOutcome, ...] = ()
    blocks: tuple[BlockOutcome, ...] = ()
    if ours:
        try:
            recording = open_recording(path)
        except BadRecording as error:
            missing += [] if found.faults else [error.cause]
        else:
            status = recording.end.get("status", "")
            lacks = left_out(recording) if status == RunStatus.COMPLETE and recording.lost is None else ""
            interrupted = bool(lacks) or status not in ENDED
            steps = step_outcomes(recording, interrupted=interrupted)
            blocks = block_outcomes(recording, interrupted=interrupted)
            if recording.lost is not None:
                missing = [recording.lost]
            missing += [lacks] if lacks else []
            if channels.CONTACTS in recording.silent:
                missing.append(recording.unknown(channels.CONTACTS))
            if not status:
                missing.append("the run did not finish: the log has no status and no verdict")
    else:
        missing.append("not written by manipcli: no task, no steps and no verdict")
        known = meant({name: topic.type for name, topic in found.all.items()})
        there = {known[name].usual for name, topic in found.all.items() if topic.count and name in known}
        missing += [f"the log has no {topic}" for topic in COMMON if topic not in there]
    return LogInfo(found=found, ours=ours, steps=steps, missing=tuple(missing), blocks=blocks)
