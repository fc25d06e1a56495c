"""Writes docs/conditions.md: an introduction, and a table row and a section for each condition.

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

A condition measures a run and gives a signed margin with a unit: 0 or more where it holds, negative where it fails.
Steps wait for conditions (`until`), `watch` stops the run at a broken one, and `expect` judges the recording. All three
use the same functions on the same ticks, so they cannot disagree.

```yaml
steps:
  - pour: {object: cup, into: tray}
    until: {inside: {object: ball, of: tray}}
expect:
  - near: {object: cup, to: start, within: 2 cm}                # at the end
  - upright: {object: cup, within: 30 deg}
    during: [lift_1, place_1]
  - above: {object: cup, of: desk, by: 5 cm}
    at: lift_1                                                  # at the end of the step
  - always: {tool_speed: {below: 1.5 m/s}}
  - never: {collision: [robot, tray]}
    id: hands_off                                               # its name in reports
  - eventually: {all: [{inside: {object: ball, of: tray}}, {at_rest: {object: ball}}]}
    within: 10 s
```

## When

| written | evaluated ticks | passes if the condition holds |
|---|---|---|
| nothing | the default of the condition, see the table below: at the end, or always | at every evaluated tick |
| `at: end` | the last 0.5 s of the run, so that passing through does not count | at every one of these ticks |
| `at: STEP` | the last tick of a step | at that tick |
| `during: STEP`, `during: [STEP, STEP]` | every tick of these steps | at every tick |
| `always: {...}` | every tick of the run, or of the steps of `during` | at every tick |
| `never: {...}` | the same ticks | at no tick |
| `eventually: {...}` | the same ticks; with `within: TIME` up to this time after the start | at least at one tick |

Conditions that measure from a start (`moved`, `unmoved`, `slip`, `energy`, `duration`) start at the first evaluated
tick: at the start of the step with `at: STEP` and `during`, else at the start of the run.

## Margins

`all: [...]`, `any: [...]` and `not: {...}` combine conditions, to any depth. Margins combine as in the robust semantics
of signal temporal logic: the least for `all` and over time, the greatest for `any` and with `eventually`, the negated
margin for `not` and with `never`. A margin of exactly 0 holds and its opposite fails: at each tick exactly one of a
condition and its `not` holds. Over several ticks both can fail, if the condition holds at some of them and fails at
others; to require that it fails at least once, write `eventually: {not: {...}}`. A failed condition has a margin of at
most -1e-9 (N, m, rad, ...), also where the measured margin is 0, as for `not: {no_collision: ...}` without contact.
Reports show the margin of the deciding condition at the deciding tick, in its own unit, with its measurement.

Margins in one unit are compared directly. In a combination of different units each margin is first divided by its own
tolerance (`within`, `below`, ...; the section of a condition without a tolerance names the divisor). 1 means that the
whole tolerance is left, and signs are kept: 5 mm of 20 mm left (0.25) is less than 2 deg of 5 deg left (0.4).

An expectation that cannot be evaluated is `not_evaluated`, which does not pass, and reports the reason: a step that
never ran, an engine without physics (no motion of objects, no efforts, ideal tracking), a topic missing in the log, an
object that was never held, a state that is not finite. A combination with one such member is `not_evaluated`, whatever
the other members are. Ticks at which a member does not apply (no hand holds the object of `slip`) are ignored.

## Names in reports

The name of an expectation is its `id`; else the name of its condition (`near`, `all`, `any`, `not`), with `never_` in
front for `never`. Duplicates get a number (`near_2`). `at`, `during`, `always` and `eventually` do not change the name.

## The conditions

"""


def page() -> str:
    """The text of docs/conditions.md."""
    rows = [
        f"| [`{c.name}`](#{c.name}) | {about(c.spec)} | {_units(c)} | {_SCOPES[c.scope]} | `{c.example}` |"
        for c in CONDITIONS
    ]
    table = ["| word | holds when | unit of the margin | expected | example |", "|---|---|---|---|---|", *rows]
    return INTRODUCTION + "\n".join([*table, "", *(line for condition in CONDITIONS for line in _section(condition))])


_SCOPES = {"end": "at the end", "always": "always"}


# Any: the members of a seam have different specs.
def _units(condition: Condition[Any]) -> str:
    return ", ".join(unit or "-" for unit in condition.units)


def _section(condition: Condition[Any]) -> list[str]:
    monitor = condition.open.func if isinstance(condition.open, partial) else condition.open
    fields = []
    for name, field in condition.spec.model_fields.items():
        complete = field.is_required() or "efault" in str(field.description)
        fields.append(f"- `{name}`: {field.description}{'' if complete else ' Optional.'}")
    margin = f"Margin: {cleandoc(monitor.__doc__ or '')}"
    return ["", f"### {condition.name}", "", about(condition.spec), "", *fields, "", margin]


if __name__ == "__main__":
    PAGE.write_text(page() + "\n", encoding="utf-8")
