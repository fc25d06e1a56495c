"""Controllers along the branches of a task."""

from __future__ import annotations

from manipcli.plan.claimed_joints import Claims
from manipcli.spec.block import BlockSpec
from manipcli.task.block_checks import BranchClaims


def choice(id_: str, first: int, split: int, last: int) -> BlockSpec:
    return BlockSpec(id=id_, kind="if", word="if", first=first, split=split, last=last)


def test_each_branch_begins_with_the_controllers_at_the_choice() -> None:
    """Step k activates a controller: the claims after it are named by the steps on its path, one letter each."""
    blocks = [choice("a", 1, 4, 6), choice("b", 2, 3, 4), choice("c", 7, 8, 8)]
    branches = BranchClaims(blocks)
    claims: Claims | None = Claims((), ())
    path = []
    for k in range(9):
        claims = branches.before(k, claims)
        assert claims is not None
        path.append("".join(claims.following))
        claims = Claims((), (*claims.following, str(k)))
    assert path == ["", "0", "01", "01", "0", "04", "012", "0126", "01267"]
