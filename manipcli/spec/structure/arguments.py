"""Values of the parameters of a sub-task, from `with:` and the defaults of its `params:`."""

from __future__ import annotations

from collections.abc import Collection

from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean, escape, listed, nearest
from manipcli.spec.expression import Scope, names_used
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, mapped, shown
from manipcli.spec.structure.params import Param, Wrong, check, declared
from manipcli.spec.structure.reports import Reports


def arguments(
    item: MappingNode, task: MappingNode, at: Loc, outer: Scope, reports: Reports, bodies: Collection[str]
) -> Scope:
    """The parameters of a sub-task, from `with:` and the defaults; faulty ones are reported and lost."""

    def wrong(name: str, error: Wrong) -> None:
        reports.at(error.number, ("params", name) if name else ("params",), error.node, error.message, error.hint)

    params = declared(task.get("params"), wrong)
    given = item.get("with") or MappingNode({}, item.place)
    if not isinstance(given, MappingNode):
        reports.at(
            267, (*at, "with"), given, f"expected names with values, not {shown(given)}", "write `{NAME: VALUE}`"
        )
        return outer.inner({}, lost=(param.name for param in params), isolated=True)
    known = [param.name for param in params]
    for name in given.entries:
        if name not in known:
            near = did_you_mean(name, known, kind="params") or "the sub-task declares no `params`"
            reports.at_key(267, (*at, "with"), given, name, f"the sub-task has no parameter '{escape(name)}'", near)
    steps = task.get("steps")
    used = frozenset[str]() if steps is None else names_used(steps)
    used |= names_used(task.get("params") or given)
    for param in params:
        if param.type and param.name not in used:
            node, hint = ScalarNode(None, param.place), "write `$name` where its value belongs, or remove it"
            message = f"the steps do not use `${param.name}`"
            reports.at(272, ("params", param.name), node, message, hint.replace("name", param.name), "warning")
    missing = [param for param in params if param.type and param.name not in given.entries and not param.default]
    misspelt = {near for name in given.entries if name not in known for near in nearest(name, known)}
    absent = [param for param in missing if param.name not in misspelt]
    if absent:
        named = listed([f"`{param.name}` ({param.type})" for param in absent])
        hint = f"add `with: {{{absent[0].name}: ...}}`; it is declared at {absent[0].place}"
        reports.at(267, (*at, "with"), item.entries["do"].node, f"no value for {named}", hint)
    return _values(
        params,
        given,
        {param.name for param in params if param in missing or not param.type},
        at,
        outer,
        reports,
        bodies,
    )


def _values(
    params: list[Param],
    given: MappingNode,
    lost: set[str],
    at: Loc,
    outer: Scope,
    reports: Reports,
    bodies: Collection[str],
) -> Scope:
    values: dict[str, Node] = {}
    for param in params:
        entry = given.entries.get(param.name)
        if param.name in lost:
            continue
        if entry is not None:
            path: Loc = (*at, "with", param.name)
            node = mapped(entry.node, outer.computed, path)
            if (
                isinstance(param.default, ScalarNode)
                and param.default.written is None
                and not names_used(param.default)
            ):
                _check_default(param, param.default, reports, bodies)
        elif param.default is not None:
            path = ("params", param.name, "default")
            node = mapped(param.default, outer.inner(values, lost=lost, isolated=True).computed, path)
        if node.place in outer.refused:
            lost.add(param.name)
            continue
        try:
            check(param, node, bodies)
            values[param.name] = node
        except Wrong as error:
            reports.at(error.number, path, error.node, error.message, error.hint)
            lost.add(param.name)
    return outer.inner(values, lost=lost, isolated=True)


def _check_default(param: Param, default: Node, reports: Reports, bodies: Collection[str]) -> None:
    """A faulty default is an error where a value is given, too: the next use may need it."""
    try:
        check(param, default, bodies)
    except Wrong as error:
        reports.at(error.number, ("params", param.name, "default"), error.node, error.message, error.hint)
