"""Flat steps and their blocks as nested lists, as a log stores them: no files, all ids given.

Loading the result gives the same flat steps, ids and blocks. Rounds are written out (`repeat: {rounds: [...]}`), so are
sub-tasks (`do: {steps: [...]}`), and a decided `if` has `true` or `false` as its condition.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from manipcli.spec.block import BlockSpec
from manipcli.spec.source.tree import Plain
from manipcli.spec.structure.words import COMMON, ELSE

Params = Mapping[int, Plain]


class Nesting:
    """Writes the items of a task.

    Args:
        steps: the flat steps as plain data, each with its id.
        blocks: the blocks over them, and as plain data.
        params: the values of a round or sub-task, by index of its block, where a retry needs them.
    """

    def __init__(
        self, steps: Sequence[Plain], blocks: Sequence[BlockSpec], data: Sequence[Plain], params: Params
    ) -> None:
        self._steps = [step for step in steps if isinstance(step, dict)]
        self._blocks = blocks
        self._data = [block for block in data if isinstance(block, dict)]
        self._params = params

    def items(self) -> list[Plain]:
        """The items of `steps:`."""
        return self._between(0, len(self._steps), None, "")

    def _between(self, first: int, last: int, parent: int | None, prefix: str) -> list[Plain]:
        """The items of the steps from `first` to `last` inside the block `parent`."""
        items: list[Plain] = []
        inner = {
            block.first: k
            for k, block in enumerate(self._blocks)
            if block.parent == parent and first <= block.first < last
        }
        k = first
        while k < last:
            if k in inner:
                items.append(self._block(inner[k], prefix))
                k = self._blocks[inner[k]].last
            else:
                items.append({**self._steps[k], "id": str(self._steps[k]["id"]).removeprefix(prefix)})
                k += 1
        return items

    def _block(self, index: int, prefix: str) -> dict[str, Plain]:
        block, data = self._blocks[index], self._data[index]
        keys: dict[str, Plain] = {key: data[key] for key in COMMON[1:] if key in data and data[key] != "stop"}
        return {**self._word(index), "id": block.id.removeprefix(prefix), **keys}

    def _word(self, index: int) -> dict[str, Plain]:
        """The word of a block with its steps."""
        block = self._blocks[index]
        first, last, inside, other = block.first, block.last, f"{block.id}/", f"{block.id}/{ELSE}/"
        if block.kind == "if":
            split = {"if": self._data[index]["condition"], "then": self._between(first, block.split, index, inside)}
            return split | ({ELSE: self._between(block.split, last, index, other)} if block.split < last else {})
        if block.word == "if":
            taken = str(self._steps[first]["id"]).startswith(other)
            return {
                "if": not taken,
                ELSE if taken else "then": self._between(first, last, index, other if taken else inside),
            }
        if block.word == "repeat":
            return {"repeat": {"rounds": self._rounds(index)}}
        items = self._between(first, last, index, inside)
        return {"do": self._with_params(index, items)} if block.word == "do" else {block.word: items}

    def _rounds(self, index: int) -> list[Plain]:
        """All rounds of a `repeat`; one without steps is written, too, since the others are counted."""
        own = self._blocks[index].id
        rounds: list[Plain] = []
        for k, block in enumerate(self._blocks):
            if block.parent == index:
                number = int(block.id.removeprefix(f"{own}[").removesuffix("]"))
                rounds += [{"steps": []} for _ in range(number - len(rounds))]
                rounds.append(self._with_params(k, self._between(block.first, block.last, k, f"{block.id}/")))
        return rounds

    def _with_params(self, index: int, items: list[Plain]) -> dict[str, Plain]:
        return {"params": self._params[index], "steps": items} if index in self._params else {"steps": items}
