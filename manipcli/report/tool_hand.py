"""The tool frame of a robot and the hand that carries it, as text and as JSON."""

from __future__ import annotations

from collections.abc import Mapping

from manipcli.core.geometry import Array
from manipcli.model.hand.tool_hand import ToolHand
from manipcli.model.hand.words import millimetres, opening_text, pose_text
from manipcli.model.robot import Tool
from manipcli.report.json import Json, number


def render_text(tool: Tool | None, hand: ToolHand | None) -> str:
    """Tool frame, finger tips and opening, one line each; empty without a tool and a hand."""
    rows: dict[str, str] = {}
    shown = hand.tool if hand is not None else tool
    if shown is None:
        return ""
    origin = "measured on the hand" if hand is not None and hand.measured else "guessed for a hand without shapes"
    proposed = "" if tool is not None else f"; {origin}, not stated: `tool:` of a robot file states it"
    rows["tool"] = f"frame in link '{shown.link}', {pose_text(shown.X_LT)}; its +z is the approach direction{proposed}"
    if hand is not None:
        name, opened = hand.widest_pose()
        tips = zip(hand.tips, hand.tips_at(opened), strict=True)
        rows["finger tips"] = ", ".join(f"'{tip.link}' {millimetres(p)}" for tip, p in tips)
        rows["finger tips"] += " mm in the tool frame, " + (f"in the pose '{name}'" if name else "hand open")
        rows["opening"] = opening_text(hand)
    width = max(map(len, rows)) + 2
    return "\n".join(f"{name + ':':<{width}}{value}" for name, value in rows.items())


def tool_object(tool: Tool | None, hand: ToolHand | None) -> Mapping[str, Json] | None:
    """The same as JSON, in m and rad; null without a tool and a hand."""
    shown = hand.tool if hand is not None else tool
    if shown is None:
        return None
    return {
        "link": shown.link,
        "xyz": _numbers(shown.X_LT.p),
        "rpy": _numbers(shown.X_LT.rpy),
        "stated": tool is not None,
        "hand": None if hand is None else _hand_object(hand),
    }


def _hand_object(hand: ToolHand) -> Json:
    pose, opened = hand.widest_pose()
    tips = zip(hand.tips, hand.tips_at(opened), strict=True)
    gaps = hand.measured
    return {
        "joints": list(hand.joints),
        "tips_in_pose": pose or None,
        "tips": [{"link": tip.link, "xyz": _numbers(p)} for tip, p in tips],
        "opening_axis": _numbers(hand.axis),
        "along_y": hand.along_y,
        "out_along_z": hand.out_along_z,
        "narrowest": number(max(hand.narrowest, 0.0)) if gaps else None,
        "widest": number(max(hand.widest, 0.0)) if gaps else None,
        "poses": [
            {"pose": name, "gap": number(max(gap, 0.0)) if gaps else None} for name, gap in hand.gaps_of_poses().items()
        ],
    }


def _numbers(values: Array) -> list[Json]:
    return [number(float(value) + 0.0) for value in values]
