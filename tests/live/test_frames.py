"""Depth of JSON frames: counted without parsing, against the depth of what was written."""

from __future__ import annotations

import json
import random
from typing import Any

import pytest

from manipcli.live.frames import MAX_DEPTH, BadFrame, read_frame

TEXTS = ('"', "\\", '\\"[', "[[{", "]]}\\\\", 'é"[\\', "")


def nested(draw: random.Random, depth: int) -> Any:
    """A value of at least this depth, with brackets and escapes in its texts and keys."""
    if depth <= 0:
        return draw.choice(TEXTS)
    below = [nested(draw, depth - 1), *(nested(draw, draw.randrange(min(depth, 3))) for _ in range(draw.randrange(3)))]
    if draw.random() < 0.5:
        return below
    return {f"{k}{draw.choice(TEXTS)}": each for k, each in enumerate(below)}


def depth_of(value: Any) -> int:
    if isinstance(value, dict):
        value = [*value.values()]
    return 1 + max(map(depth_of, value), default=0) if isinstance(value, list) else 0


def test_a_frame_is_refused_exactly_when_it_is_deeper_than_the_limit() -> None:
    draw = random.Random(1)
    refused = 0
    for k in range(400):
        frame = {"op": nested(draw, MAX_DEPTH - 6 + k % 12)}
        text = json.dumps(frame, ensure_ascii=k % 2 == 0)
        if depth_of(frame) <= MAX_DEPTH:
            assert read_frame(text) == frame
        else:
            refused += 1
            with pytest.raises(BadFrame, match="deeper than 32"):
                read_frame(text)
    assert 100 < refused < 300


@pytest.mark.parametrize("text", ["[" * 100_000, '{"op":' * 100_000, "[" * 1000 + '"' + "]" * 1000])
def test_open_brackets_count_as_depth(text: str) -> None:
    with pytest.raises(BadFrame, match="deeper than 32"):
        read_frame(text)
