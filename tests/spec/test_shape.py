"""What the types that may stand somewhere say about what is written there."""

from __future__ import annotations

import pytest

from manipcli.spec.source.shape import is_of_fixed_length


@pytest.mark.parametrize(
    ("kinds", "fixed"),
    [
        ([tuple[int, int], str], True),
        ([tuple[int, int], tuple[str, str]], True),
        ([tuple[int, int], tuple[int, int, int]], False),
        ([tuple[int, ...]], False),
        ([tuple[int, int], tuple[int, ...]], False),
        ([list[int]], False),
        ([str], False),
    ],
)
def test_a_length_is_fixed_where_no_list_may_have_another(kinds: list[object], fixed: bool) -> None:
    assert is_of_fixed_length(kinds) == fixed
