"""The structure of the steps of a loaded task: where the flat list comes from."""

from __future__ import annotations

from dataclasses import dataclass

from manipcli.core.errors import Loc
from manipcli.spec.expression import Scope
from manipcli.spec.source.tree import SequenceNode
from manipcli.spec.structure.draft import BlockDraft, FlatStep


@dataclass(frozen=True, slots=True)
class Structure:
    """Where each step and block of the flat tree is written.

    Attributes:
        steps, blocks: in the order of the tree; () for a task without structure.
        scope: the parameters of the task; None for other files.
        dropped, left: the steps of branches that are never taken, and their computed nodes.
        complete: whether no item was left out because of an error.
    """

    steps: tuple[FlatStep, ...] = ()
    blocks: tuple[BlockDraft, ...] = ()
    scope: Scope | None = None
    dropped: tuple[FlatStep, ...] = ()
    left: SequenceNode | None = None
    complete: bool = True

    def written(self, path: Loc) -> Loc:
        """A path in the flat tree as it is in the file: `steps[0].repeat.steps[1].pick.object`."""
        match path:
            case ("steps", int() as k, *rest) if k < len(self.steps):
                return (*self.steps[k].at, *rest)
            case ("blocks", int() as k, "condition", *rest) if k < len(self.blocks):
                return (*self.blocks[k].at, "if", *rest)
            case ("blocks", int() as k, *rest) if k < len(self.blocks):
                return (*self.blocks[k].at, *rest)
        return path
