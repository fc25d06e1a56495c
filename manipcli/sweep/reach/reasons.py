"""Reasons of refusals without their numbers, so that neighbouring points share one."""

from __future__ import annotations

import re
from typing import Final

from manipcli.core.errors import Diagnostic, NotPlannable
from manipcli.core.text import shorten

WIDTH: Final = 72
_STAGE: Final = re.compile(r"([a-z_]+(?: back)?): ")
_LINK: Final = re.compile(r"robot/[\w.-]+")
_NUMBER: Final = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?")
_DROPPED: Final = re.compile(r"the arm reaches \(#, #, #\) m only where | by # [a-z]+\b| at \[#, #\] m| at t = # s")


def refusal_reason(refusal: NotPlannable) -> str:
    """`pick_1 approach: out of reach`: what most candidates of the refused step were refused for."""
    first = next((group for group in refusal.candidates if group.step == refusal.step), None)
    cause = refusal.cause if first is None else first.cause
    stage = _STAGE.match(cause)
    text = cause if stage is None else cause[stage.end() :]
    if text.startswith("no joint positions reach"):
        text = "beyond the limits of a joint" if ", at the limits of " in text else "out of reach"
    else:
        text = _general(text)
    step = f"{refusal.step or ''} {stage[1] if stage is not None else ''}".strip()
    return shorten(f"{step}: {text}" if step else text, width=WIDTH)


def finding_reason(finding: Diagnostic) -> str:
    """`'cup' and 'tray' overlap at the start`."""
    return shorten(_general(finding.message), width=WIDTH)


def _general(text: str) -> str:
    text = _NUMBER.sub("#", _LINK.sub("robot", text))
    return _DROPPED.sub("", text).replace("robot and robot overlap", "the robot overlaps itself")
