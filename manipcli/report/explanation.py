"""A task in English as text, and as JSON."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Final

from manipcli.core.prose import sentence
from manipcli.report.json import dumps
from manipcli.report.outline import Item, outline
from manipcli.task.explanation import Explanation
from manipcli.task.origins import Origin

WIDTH: Final = 110


def render_text(task: Explanation, *, values: bool = False) -> str:
    """Numbered sentences; with `values`, each round is written out, and each value is listed with its origin."""
    blocks = [_wrapped(f"{task.task}: {sentence(task.description or f'a task for robot {task.robot}')}", "", "")]
    if values and task.values:
        blocks.append("\n".join(["Values around the steps:", *_values(task.values, "  ")]))
    blocks.append("\n".join(["Steps:", *_items(outline(task, whole=values), task, "", values)]))
    for title, parts in (
        ("What must hold:", task.expectations),
        ("What is watched during the run:", task.watches),
        ("What `--sample N` varies:", task.varied),
    ):
        if parts:
            lines = [title]
            for k, part in enumerate(parts, 1):
                name = "" if part in task.varied else f"{part.id}: "
                lines += [
                    _wrapped(f"{k}. {name}{part.text}", "  ", "   "),
                    *_values(part.values if values else (), "     "),
                ]
            blocks.append("\n".join(lines))
    return "\n\n".join(blocks)


def render_json(task: Explanation) -> str:
    """The explanation as one JSON object, with all steps, blocks and values."""
    return dumps(asdict(task))


def _items(items: Sequence[Item], task: Explanation, prefix: str, values: bool, before: int = 0) -> Iterator[str]:
    """The lines of items that are numbered `prefix` and `before` + 1, ..."""
    indent = "  " + "   " * prefix.count(".")
    for number, item in enumerate(items, before + 1):
        own = f"{prefix}{number}."
        yield _wrapped(f"{own} {item.id}: {item.text}", indent, " " * (len(own) + 1))
        if values and item.step >= 0:
            yield from _values(task.steps[item.step].values, f"{indent}     ")
        inner = 0
        for heading, parts in item.parts:
            yield from (f"{indent}   {line}" for line in heading.split("; ") if line)
            yield from _items(parts, task, own, values, inner)
            inner += len(parts)
        if item.then:
            yield _wrapped(item.then, f"{indent}   ", "")


def _values(values: Sequence[Origin], indent: str) -> Iterator[str]:
    return (f"{indent}{value}" for value in values)


def _wrapped(text: str, indent: str, hanging: str) -> str:
    return textwrap.fill(
        text,
        WIDTH,
        initial_indent=indent,
        subsequent_indent=indent + hanging,
        break_long_words=False,
        break_on_hyphens=False,
    )
