"""Steps and blocks of a verdict in the order of the file, each block before its parts, with their depth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from manipcli.judge.verdict import BlockOutcome, StepOutcome

MARKS: Final = {"done": "✓", "passed": "✓", "skipped": "–"}
"""The mark of an outcome; all others have ✗."""


def nested(
    steps: Sequence[StepOutcome], blocks: Sequence[BlockOutcome]
) -> Iterator[tuple[int, StepOutcome | BlockOutcome]]:
    """Every step and block with the number of blocks around it."""
    depths: list[int] = []
    for block in blocks:
        depths.append(0 if block.parent is None else depths[block.parent] + 1)
    left = [*zip(depths, blocks, strict=True)]
    for k, step in enumerate(steps):
        while left and left[0][1].first <= k:
            yield left.pop(0)
        inside = [depth for depth, block in zip(depths, blocks, strict=True) if block.first <= k < block.last]
        yield max(inside, default=-1) + 1, step


def block_line(block: BlockOutcome) -> str:
    """`if 'if_1' took then: it holds ...`, `repeat 'stack' timed out: ...`."""
    if block.taken:
        return f"{block.label} took {block.taken}: {block.text}"
    word = "timed out" if block.outcome == "timeout" else block.outcome.replace("_", " ")
    return f"{block.label} {word}{f': {block.text}' if block.text else ''}"
