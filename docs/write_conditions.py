"""Writes docs/conditions.md: what conditions are, and from their members a table and a section each.

python docs/write_conditions.py
"""

from __future__ import annotations

from functools import partial
from inspect import cleandoc
from pathlib import Path
from typing import Any

from manipcli.conditions.condition import Condition
from manipcli.conditions.members import CONDITIONS
from manipcli.spec.base import about

PAGE = Path(__file__).with_name("conditions.md")
INTRODUCTION = """\
# Conditions

<!-- Written by docs/write_conditions.py: change that, or the docstrings of manipcli/conditions/members/. -->

A condition is a question about a run with a signed margin in a unit: positive where it holds, and by how much. The same
conditions are waited for by steps (`until`), watched (`watch`) and expected of the recording (`expect`); all ask the
same functions the same ticks, so that they cannot disagree.

```yaml
steps:
  - pour: {object: cup, into: tray}
    until: {inside: {object: ball, of: tray}}
expect:
  - near: {object: cup, to: start, within: 2 cm}                # at the end
  - upright: {object: cup, within: 30 deg}
    during: [lift_1, place_1]
  - above: {object: cup, of: desk, by: 5 cm}
    at: lift_1                                                  # at the moment at which the step ends
  - always: {tool_speed: {below: 1.5 m/s}}
  - never: {collision: [robot, tray]}
    id: hands_off                                               # its name in reports
  - eventually: {all: [{inside: {object: ball, of: tray}}, {at_rest: {object: ball}}]}
    within: 10 s
```

## When

| written | looked at | met when the margin is 0 or more |
|---|---|---|
| nothing | what the table below says of the condition: the end, or always | at every tick that is looked at |
| `at: end` | the last 0.5 s of the run: passing through is not being there | at every tick of them |
| `at: STEP` | the last tick of a step | there |
| `during: STEP`, `during: [STEP, STEP]` | every tick of these steps | at every tick |
| `always: {...}` | every tick of the run, or of the steps of `during` | at every tick |
| `never: {...}` | the same | at no tick |
| `eventually: {...}` | the same; with `within: TIME` up to that time from the start of run or step | at one at least |

What counts from a start (`moved`, `unmoved`, `slip`, `energy`, `duration`) counts from the first tick that is looked
at: from that of the step with `at: STEP` and `during`, else from that of the run.

## Margins

`all: [...]`, `any: [...]` and `not: {...}` combine conditions, however deep. Margins combine as in the robust semantics
of signal temporal logic: the least for `all` and over time, the greatest for `any` and with `eventually`, the opposite
for `not` and with `never`. A margin of exactly 0 is met and its opposite is not: at each moment exactly one of a
condition and its `not` holds. Over many ticks both can fail, where it held at some of them and not at others;
that it once did not hold is `eventually: {not: {...}}`. What fails has a margin of at most -1e-9 (N, m, rad, ...), also
where it is missed by nothing, as `not` of what never touched. What is reported is the margin of the deciding condition
at the deciding moment, in its own unit, and its text: which object, where, how far.

Margins in one unit compare as they are. In a combination whose units differ, each is compared after division by its own
tolerance (`within`, `below`, ...; where a condition has none, its section says by what), so that 1 is all of the
tolerance left and signs come first: 5 mm of 20 mm left (0.25) is less than 2 deg of 5 deg (0.4).

An expectation that could not be looked at is `not_evaluated`, which is no pass, and says why: a step that never ran, an
engine without physics (which moves no object, needs no efforts and makes references come true at once), a topic that is
not in the log, an object that was never held, a state that is not finite. One member that cannot be evaluated makes a
combination so, whatever the others are; a tick at which one has nothing to say (no hand holds the object of `slip`)
does not count.

## Names in reports

An expectation is called by its `id`; else by the word of its condition (`near`, `all`, `any`, `not`), after `never_`
with `never`; the second and later of a name get a number (`near_2`). When a condition is looked at does not change its
name.

## The conditions

"""


def page() -> str:
    """The whole text."""
    rows = [
        f"| [`{one.name}`](#{one.name}) | {about(one.spec)} | {_units(one)} | {_SCOPES[one.scope]} | `{one.example}` |"
        for one in CONDITIONS
    ]
    table = ["| word | holds when | unit of the margin | expected | example |", "|---|---|---|---|---|", *rows]
    return INTRODUCTION + "\n".join([*table, "", *(line for one in CONDITIONS for line in _section(one))])


_SCOPES = {"end": "at the end", "always": "always"}


# Any: a seam holds members of different specs; each is only asked for its texts.
def _units(one: Condition[Any]) -> str:
    return ", ".join(unit or "-" for unit in one.units)


def _section(one: Condition[Any]) -> list[str]:
    monitor = one.open.func if isinstance(one.open, partial) else one.open
    fields = []
    for name, field in one.spec.model_fields.items():
        told = field.is_required() or "efault" in str(field.description)
        fields.append(f"- `{name}`: {field.description}{'' if told else ' Optional.'}")
    return ["", f"### {one.name}", "", about(one.spec), "", *fields, "", f"Margin: {cleandoc(monitor.__doc__ or '')}"]


if __name__ == "__main__":
    PAGE.write_text(page() + "\n", encoding="utf-8")
