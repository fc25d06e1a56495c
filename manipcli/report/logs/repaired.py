"""Result of repairing a log, as text and JSON."""

from __future__ import annotations

from manipcli.record.foreign.repair import Repaired
from manipcli.report.json import dumps


def render_text(done: Repaired) -> str:
    """Losses, then what is kept."""
    lines = [f"lost {loss}" for loss in done.losses]
    if done.messages_lost:
        lines.append(f"lost in total: {done.messages_lost} of {done.messages + done.messages_lost} messages")
    span = "" if done.start is None or done.end is None else f", t = {done.start:.3f} s to {done.end:.3f} s"
    lines.append(f"kept: {done.messages} messages{span}; {len(done.attachments)} attachments")
    lines.append("nothing was lost" if not done.losses else "the repaired log records these losses in its metadata")
    return "\n".join([*lines, f"log: {done.output}"])


def render_json(done: Repaired) -> str:
    """The result as one JSON object; times in s."""
    return dumps(
        {
            "log": str(done.path),
            "output": str(done.output),
            "start": done.start,
            "end": done.end,
            "messages": done.messages,
            "messages_lost": done.messages_lost,
            "attachments": list(done.attachments),
            "losses": [{"what": loss.what, "after": loss.after, "before": loss.before} for loss in done.losses],
        }
    )
