"""Conditions, expectations and watches in English."""

from __future__ import annotations

from manipcli.conditions.formula import Seams, scopes
from manipcli.core.prose import amount, listing, named, sentence
from manipcli.model.robot import RobotModel
from manipcli.spec.condition import END, SELECTING, ConditionSpec, ExpectationSpec, SelectedSpec
from manipcli.spec.counted import selected


def condition_clause(spec: ConditionSpec, robot: RobotModel, seam: Seams) -> str:
    """A condition or combination as a statement: `'ball' is inside 'tray', and 'cup' is at rest`."""
    if not spec.combines:
        clause: str = seam[spec.name].clause(spec.body, robot)
        return clause
    inner = [condition_clause(member, robot, seam) for member in spec.members]
    if spec.name == "not":
        return f"it is not true that {inner[0]}"
    if spec.name == "believed":
        return f"the robot believes that {inner[0]}"
    if spec.name in SELECTING:
        (selection,) = selected(spec.members[0]) or ("",)
        (member,) = spec.members
        number = member.n if isinstance(member, SelectedSpec) else None
        many = f"at least {number}" if number else "all" if spec.name == "all_of" else "at least one"
        return f"for {many} of {named(selection)}, {inner[0]}"
    if len(inner) == 1:
        return inner[0]
    if any(len(member.members) > 1 for member in spec.members):
        inner = [f"({text})" for text in inner]
    word = "and" if spec.name == "all" else "or"
    return ", ".join((*inner[:-1], f"{word} {inner[-1]}"))


def expectation_sentence(spec: ExpectationSpec, robot: RobotModel, seam: Seams) -> str:
    """An expectation: `At the end, 'ball' is inside 'tray'.`"""
    clause = condition_clause(spec.condition, robot, seam)
    during = f"during {listing([named(step) for step in spec.steps])}" if spec.steps else ""
    if spec.quantifier == "never":
        return sentence(f"{during or 'at all times'}, it never happens that {clause}")
    if spec.quantifier == "eventually":
        within = "" if spec.within is None else f"within {amount(spec.within, 's')}"
        return sentence(f"at some time {' '.join(filter(None, (during, within))) or 'in the run'}, {clause}")
    if spec.at not in (None, END):
        return sentence(f"at the end of {named(str(spec.at))}, {clause}")
    always = spec.quantifier == "always" or "always" in scopes(spec.condition, seam)
    if during:
        return sentence(f"{'all the time ' if always else ''}{during}, {clause}")
    return sentence(f"{'at all times' if always and spec.at is None else 'at the end'}, {clause}")


def watch_sentence(spec: ExpectationSpec, robot: RobotModel, seam: Seams) -> str:
    """A watch: `The robot stops and the run ends as soon as the robot touches 'desk'.`"""
    clause = condition_clause(spec.condition, robot, seam)
    during = f"during {listing([named(step) for step in spec.steps])}, " if spec.steps else ""
    no_longer = "" if spec.quantifier == "never" else "this is no longer true: "
    return sentence(f"{during}the robot stops and the run ends as soon as {no_longer}{clause}")
