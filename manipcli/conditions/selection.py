"""Conditions over the bodies of a selection: one condition, with the name of each body in place of `ball[*]`.

all_of: {of: 'ball[*]', at_rest: {}}
at_least: {n: 18, of: 'ball[*]', inside: tray}
"""

from __future__ import annotations

from collections.abc import Callable

from manipcli.conditions.condition import CheckContext, Problem
from manipcli.core.text import did_you_mean
from manipcli.scene.scene import Scene
from manipcli.spec.condition import SELECTING, ConditionSpec, SelectedSpec
from manipcli.spec.counted import ALL, selected, selections, with_member


def bodies_of(spec: ConditionSpec, scene: Scene) -> tuple[str, ...]:
    """The bodies that a condition over a selection is about."""
    return selections(body.name for body in scene.bodies)[selected(spec.members[0])[0]]


def each(spec: ConditionSpec, scene: Scene) -> tuple[ConditionSpec, ...]:
    """The condition of each body of the selection."""
    (member,) = spec.members
    (selection,) = selected(member)
    found = (with_member(member, selection, name) for name in bodies_of(spec, scene))
    return tuple(one for one in found if isinstance(one, ConditionSpec))


def least_number(spec: ConditionSpec, count: int) -> int:
    """For how many of `count` bodies the condition must hold."""
    (member,) = spec.members
    if isinstance(member, SelectedSpec) and member.n is not None:
        return member.n
    return count if spec.name == "all_of" else 1


def selection_problems(
    spec: ConditionSpec, context: CheckContext, check: Callable[[ConditionSpec], tuple[Problem, ...]]
) -> tuple[Problem, ...]:
    """No selection or several, an unknown one, more bodies than it has, and what is wrong with one of its conditions.

    Args:
        spec: a condition over a selection.
        context: the scene.
        check: the problems of the condition of one body.
    """
    (member,), (loc,) = spec.members, spec.where
    known = selections(body.name for body in context.scene.bodies)
    named = selected(member)
    if isinstance(member, SelectedSpec) and member.of is not None:
        loc = (*loc, "of")
    if inner := next((word for word in _words(member) if word in SELECTING), None):
        hint = "write one of them; combine several with `all` and `any`"
        return (Problem(loc, f"`{inner}` inside `{spec.name}`: a condition is over one selection", hint),)
    if len(named) != 1:
        what = f"names {len(named)} selections, '{named[0]}' and '{named[1]}'" if named else "names no selection"
        example = next(iter(known), None)
        hint = (
            f"name one in place of a body: '{example}'" if example else f"give a body a `count` and name it 'BODY{ALL}'"
        )
        return (Problem(loc, f"the condition of `{spec.name}` {what}, expected one", hint),)
    if named[0] not in known:
        owner = named[0].removesuffix(ALL)
        if any(body.name == owner for body in context.scene.bodies):
            return (
                Problem(loc, f"'{owner}' is one body: it has no `count`", f"name it '{owner}', without `{spec.name}`"),
            )
        message = f"'{named[0]}' selects no body: no body of the scene has this name and a `count`"
        return (Problem(loc, message, did_you_mean(named[0], known, kind="selections")),)
    count = len(known[named[0]])
    if (wanted := least_number(spec, count)) > count:
        return (Problem((spec.name, "n"), f"`n: {wanted}` is more than the {count} bodies of '{named[0]}'"),)
    found: list[Problem] = []
    for one in each(spec, context.scene):
        where = {problem.loc for problem in found}
        more = (Problem((spec.name, *p.loc), p.message, p.hint, p.code) for p in check(one))
        found += [problem for problem in more if problem.loc not in where]
    return tuple(found)


def _words(spec: ConditionSpec) -> tuple[str, ...]:
    return (spec.name, *(word for member in spec.members for word in _words(member)))
