"""Proposed gains of `tune` as a table or as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from manipcli.control.gain_design import MARGIN, StepAnswer, Tuned, Wish
from manipcli.report.table import table


def render_text(robot: str, wish: Wish, joints: Sequence[Tuned], notes: Sequence[str]) -> str:
    """The gains, their step responses, and the meaning of the columns."""
    simulated = any(joint.simulated is not None for joint in joints)
    integral = any(joint.i for joint in joints)
    headers = ["joint", "inertia", "p", *(["i"] if integral else []), "d", "damping", "overshoot", "settles"]
    headers += ["simulated", "settles "] if simulated else []
    headers += ["frequency", "-3 dB", "margin"]
    rows = []
    for joint in joints:
        row = [
            joint.joint,
            f"{joint.inertia:.3g}",
            f"{joint.p:.4g}",
            *([f"{joint.i:.4g}"] if integral else []),
            f"{joint.d:.4g}",
        ]
        row += [f"{joint.damping:.2f}", *_answer(joint.predicted)]
        row += (_answer(joint.simulated) if joint.simulated is not None else ["-", "-"]) if simulated else []
        row += [f"{joint.frequency:.2g} Hz", f"{joint.bandwidth:.2g} Hz", f"x {joint.margin:.1f}"]
        rows.append((*row, joint.limited_by or "nothing"))
    lines = [
        f"{robot}: gains for {wish.bandwidth:g} Hz and a damping ratio of {wish.damping:g}, "
        f"at a control period of {1e3 * wish.period:g} ms",
        "",
        table((*headers, "limited by"), rows, right=tuple(headers[1:])),
        "",
    ]
    steps = sorted({joint.predicted.size for joint in joints})
    lines.append(
        f"Step of {' or '.join(f'{size:g}' for size in steps)} (rad or m): predicted for each joint alone, at its "
        "largest inertia, without gravity."
    )
    lines.append(
        "Frequency: natural frequency, set by --bandwidth. -3 dB: frequency at which a joint follows its reference "
        "with 1 / sqrt 2 of the amplitude."
    )
    if simulated:
        lines.append("Simulated: the whole robot in the engine, with gravity, the other joints held by these gains.")
    lines.append(
        f"Margin: factor by which all gains of the joint can grow before it is unstable, at its smallest inertia. All "
        f"joints together keep {MARGIN:g} in the most critical configurations found."
    )
    weak = {
        joint.joint: joint.damping
        for joint in joints
        if joint.interface == "effort" and joint.damping < min(0.5, wish.damping)
    }
    if weak:
        lines.append(
            f"Damping of {', '.join(weak)}: at least {min(weak.values()):.2f} at the largest inertia. More damping is "
            "unstable at the smallest inertia. Use a shorter control period, or inverse dynamics with lower gains."
        )
    return "\n".join([*lines, *notes])


def _answer(answer: StepAnswer) -> list[str]:
    settles = "not in time" if math.isinf(answer.settling_time) else f"{1e3 * answer.settling_time:.0f} ms"
    return [f"{100.0 * answer.overshoot:.1f} %", settles]


def render_json(robot: str, wish: Wish, joints: Sequence[Tuned], notes: Sequence[str]) -> str:
    """The gains as one JSON object; numbers are SI."""
    document: dict[str, object] = {
        "robot": robot,
        "bandwidth": wish.bandwidth,
        "damping": wish.damping,
        "period": wish.period,
    }
    document |= {"joints": [_joint(joint) for joint in joints], "notes": list(notes)}
    return json.dumps(document, indent=2)


def _joint(joint: Tuned) -> dict[str, object]:
    keys = "joint controller interface inertia least_inertia p i d i_clamp frequency damping bandwidth margin"
    return {
        **{key: getattr(joint, "least" if key == "least_inertia" else key) for key in keys.split()},
        "limited_by": joint.limited_by or None,
        "predicted": _measures(joint.predicted),
        "simulated": None if joint.simulated is None else _measures(joint.simulated),
    }


def _measures(answer: StepAnswer) -> dict[str, float | None]:
    settled = answer.settling_time
    return {
        "step": answer.size,
        "overshoot": answer.overshoot,
        "settling_time": None if math.isinf(settled) else settled,
    }
