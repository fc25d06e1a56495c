"""Why a task has no plan: its refused candidates by stage, and the one change that would free most of them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final

from manipcli.core.errors import NotPlannable
from manipcli.core.refused_candidates import RefusedCandidates
from manipcli.core.text import number_of
from manipcli.core.work import WorkSpent
from manipcli.plan.candidates import NUMBER, Dropped

UNNAMED: Final = "-"
"""The stage of a refusal that names no motion: before any, or of a step that is a single one."""
NAMED: Final = 5
"""Names of candidates that a group lists."""
DEEPER_REMEDY: Final = "`manipcli plan TASK --why` searches how far the base would have to move"
"""The hint in place of a remedy that is not found within the budget."""
_LABEL: Final = re.compile(r"([a-z_]+(?: back)?): ")
_DURING: Final = re.compile(r" s of '([a-z_ ]+)'")

Refused = Sequence[tuple[str, Dropped]]
"""Id of the step and candidate, in the order of their refusal."""


def stage_of(cause: str) -> str:
    """The motion that a cause names: `approach: ...`, or `... at t = 0.3 s of 'approach'`."""
    label = _LABEL.match(cause)
    during = label or _DURING.search(cause)
    return during[1] if during is not None else UNNAMED


def by_stage(refused: Refused) -> tuple[RefusedCandidates, ...]:
    """The refused candidates by step, stage and reason, the commonest first."""
    groups: dict[tuple[str, str, str], list[Dropped]] = {}
    for step, one in refused:
        cause = one.refusal.cause
        groups.setdefault((step, stage_of(cause), NUMBER.sub("#", cause)), []).append(one)
    found = [
        RefusedCandidates(step, stage, len(of), of[0].refusal.cause, tuple(one.name for one in of if one.name)[:NAMED])
        for (step, stage, _), of in groups.items()
    ]
    return tuple(sorted(found, key=lambda group: -group.count))


def explained(refusal: NotPlannable, refused: Refused, handled: Mapping[str, str] = {}) -> NotPlannable:
    """The refusal of a task with its refused candidates, and with the change that would free most of them.

    A pose out of reach gets how far the base would have to move; that is searched here, once, and left out where the
    budget of the diagnosis does not suffice. `handled`: see `change_for_most`.
    """
    hints = [] if refusal.hint is None else [refusal.hint]
    if len(refused) > 1 and (change := change_for_most(refused, handled)):
        hints.append(change)
    try:
        if refusal.remedy is not None:
            hints.append(refusal.remedy())
    except WorkSpent:
        hints.append(DEEPER_REMEDY)
    found = refusal.but(hint="; ".join(hints) or None, candidates=by_stage(refused), motions=())
    found.remedy = None  # done, and it holds the solver
    return found


def change_for_most(refused: Refused, handled: Mapping[str, str] = {}) -> str:
    """The body to move that is in the way of most candidates; "" if none is in the way of at least half of them.

    `handled`: by the id of a step, the object that it picks, carries or sets down, which is not in its own way.
    """
    bodies = Counter(
        part
        for step, one in refused
        for part in sorted(one.refusal.parts)
        if part != handled.get(step) and not part.startswith("robot/")
    )
    if not bodies:
        return ""
    body, count = bodies.most_common(1)[0]
    if 2 * count < len(refused):
        return ""
    tried = number_of(len(refused), "candidate")
    return f"move '{body}', or the goal away from it: it is in the way of {count} of {tried}"
