"""Blocks of steps: groups, branches and steps side by side, over the flat list of all steps.

The loader expands `repeat`, `do` and nested lists, so that `TaskSpec.steps` is flat, in the order of the file. A block
is a range of these steps. `repeat` gives one `sequence` for each round, `do` gives one `sequence`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.condition import ConditionSpec
from manipcli.spec.quantity import Pause
from manipcli.spec.reactions import OnFail

BlockKind = Literal["sequence", "if", "parallel"]


class BlockSpec(Model):
    """A range of steps, `steps[first:last]`.

    Of an `if`, `steps[first:split]` is done where `condition` holds when it is reached, else `steps[split:last]`.
    """

    id: str = Field(description="Names it in logs and reports; begins the ids of its steps: `stack[2]/pick_1`.")
    kind: BlockKind = Field(description="`sequence`: one after the other; `parallel`: together; `if`: a choice.")
    word: str = Field(description="The key that made it in the file: `sequence`, `repeat`, `do`, `if`, `parallel`.")
    first: int = Field(description="Index of its first step.")
    last: int = Field(description="Index behind its last step.")
    split: int = Field(-1, description="Of `if`: index of the first step of `else`.")
    parent: int | None = Field(None, description="Index of the enclosing block; blocks stand before their parts.")
    condition: ConditionSpec | None = Field(None, description="Of `if`.")
    until: ConditionSpec | None = Field(
        None, description="Condition that is waited for after the last step, for 30 s or until the `timeout`."
    )
    timeout: Annotated[Pause, Field(gt=0)] | None = Field(
        None, description="Time from the start of its first step after which it fails [s], above 0 to 1 h."
    )
    on_fail: OnFail = Field(
        "stop",
        description="After a failure of a step that does not go on by its own `on_fail`: `stop` ends the run, "
        "`continue` goes on behind the block, `{retry: n}` does all its steps again, re-planned. Default `stop`.",
    )
