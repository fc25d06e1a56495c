"""Proposed gains: as a table for people, as JSON for programs."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from manipcli.control.tuning import MARGIN, StepAnswer, Tuned, Wish
from manipcli.report.table import table


def render_text(robot: str, wish: Wish, joints: Sequence[Tuned], notes: Sequence[str]) -> str:
    """The gains, what they do, and what the numbers stand for."""
    simulated = any(one.simulated is not None for one in joints)
    integral = any(one.i for one in joints)
    headers = ["joint", "inertia", "p", *(["i"] if integral else []), "d", "damping", "overshoot", "settles"]
    headers += ["simulated", "settles "] if simulated else []
    headers += ["frequency", "-3 dB", "margin"]
    rows = []
    for one in joints:
        row = [one.joint, f"{one.inertia:.3g}", f"{one.p:.4g}", *([f"{one.i:.4g}"] if integral else []), f"{one.d:.4g}"]
        row += [f"{one.damping:.2f}", *_answer(one.predicted)]
        row += (_answer(one.simulated) if one.simulated is not None else ["-", "-"]) if simulated else []
        row += [f"{one.frequency:.2g} Hz", f"{one.bandwidth:.2g} Hz", f"x {one.margin:.1f}"]
        rows.append((*row, one.limited_by or "nothing"))
    lines = [
        f"{robot}: gains for {wish.bandwidth:g} Hz and a damping ratio of {wish.damping:g}, "
        f"at a control period of {1e3 * wish.period:g} ms",
        "",
        table((*headers, "limited by"), rows, right=tuple(headers[1:])),
        "",
    ]
    steps = sorted({one.predicted.size for one in joints})
    lines.append(
        f"Step of {' or '.join(f'{size:g}' for size in steps)} (rad or m), of each joint alone with the most inertia "
        "that it meets, without gravity."
    )
    lines.append(
        "Frequency: the natural one, which --bandwidth asks for; -3 dB: where a joint follows its reference "
        "with 1 / sqrt 2 of the swing."
    )
    if simulated:
        lines.append("Simulated: the whole robot in the engine, with gravity, the other joints held by these gains.")
    lines.append(
        f"Margin: all gains of the joint may grow by it at its smallest inertia; {MARGIN:g} is left to all together, "
        "in the tightest postures that were found."
    )
    weak = {
        one.joint: one.damping for one in joints if one.interface == "effort" and one.damping < min(0.5, wish.damping)
    }
    if weak:
        lines.append(
            f"Damping of {', '.join(weak)}: {min(weak.values()):.2f} at least, at the largest inertia, because more "
            "would be unstable at the smallest; a shorter control period, or inverse dynamics with softer gains, "
            "helps."
        )
    return "\n".join([*lines, *notes])


def _answer(answer: StepAnswer) -> list[str]:
    settles = "not in time" if math.isinf(answer.settling_time) else f"{1e3 * answer.settling_time:.0f} ms"
    return [f"{100.0 * answer.overshoot:.1f} %", settles]


def render_json(robot: str, wish: Wish, joints: Sequence[Tuned], notes: Sequence[str]) -> str:
    """All numbers in SI."""
    document: dict[str, object] = {
        "robot": robot,
        "bandwidth": wish.bandwidth,
        "damping": wish.damping,
        "period": wish.period,
    }
    document |= {"joints": [_joint(one) for one in joints], "notes": list(notes)}
    return json.dumps(document, indent=2)


def _joint(one: Tuned) -> dict[str, object]:
    keys = "joint controller interface inertia least_inertia p i d i_clamp frequency damping bandwidth margin"
    return {
        **{key: getattr(one, "least" if key == "least_inertia" else key) for key in keys.split()},
        "limited_by": one.limited_by or None,
        "predicted": _measures(one.predicted),
        "simulated": None if one.simulated is None else _measures(one.simulated),
    }


def _measures(answer: StepAnswer) -> dict[str, float | None]:
    settled = answer.settling_time
    return {
        "step": answer.size,
        "overshoot": answer.overshoot,
        "settling_time": None if math.isinf(settled) else settled,
    }
