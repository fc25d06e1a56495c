"""What a table of ROS's parameters is, and which types of controllers there are to rewrite them to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, get_args, get_origin

from pydantic import BaseModel

from manipcli.spec.source.tree import MappingNode, Plain, Scalar

Words = Mapping[str, str]
"""What a type of ROS implies: our key -> its value; several values are separated by blanks."""


@dataclass(frozen=True, slots=True)
class Block:
    """The parameters of one block, as ROS knows them. Names that the spec has, too, need not stand here.

    Attributes:
        known: names. Without a field in the spec they are left out with a warning.
        quiet: those of which only a note is made, for they are about publishing or reading.
        renamed: ROS's name -> ours.
        inner: blocks below, by key.
        joint: the block of every other mapping: one a joint.
        neutral: values that say no more than if the key were absent, as dumps of parameters have them.
        unserved: values that ROS knows for a key and manipcli does not.
        most: what a tolerance may be; one that is larger is never missed, and left out with a warning.
        filled: lists that are not to be empty, though ours may be.
    """

    known: frozenset[str] = frozenset()
    quiet: frozenset[str] = frozenset()
    renamed: Words = field(default_factory=dict)
    inner: Mapping[str, Block] = field(default_factory=dict)
    joint: Block | None = None
    neutral: Mapping[str, tuple[Plain, ...]] = field(default_factory=dict)
    unserved: Mapping[str, tuple[Plain, ...]] = field(default_factory=dict)
    most: Mapping[str, float] = field(default_factory=dict)
    filled: frozenset[str] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        """Everything that ROS knows here."""
        return (*self.known, *self.quiet, *self.renamed, *self.inner)


def _same(node: MappingNode) -> MappingNode:
    return node


@dataclass(frozen=True, slots=True)
class Table:
    """One type of ours, and ROS's that are rewritten to it.

    Attributes:
        own: the word under `type`.
        types: ROS's name -> what it implies.
        parameters: of all of them.
        reshape: controller after renaming -> what no table can say.
        idle: command interface -> keys of ours that do nothing on it.
        interface: ROS's key whose value may be an interface of any hardware; with one that manipcli does not have, the
            controller is left out with a warning.
        needs: a key without which ROS's block does not say enough; then it is left out with a warning.
    """

    own: str
    types: Mapping[str, Words]
    parameters: Block
    reshape: Callable[[MappingNode], MappingNode] = _same
    idle: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    interface: str = ""
    needs: str = ""


def model_below(model: type[BaseModel] | None, key: str) -> type[BaseModel] | None:
    """The model of what stands under `key`, or of each value of a mapping there; None for anything else."""
    found = None if model is None else model.model_fields.get(key)
    return None if found is None else _model_in(found.annotation)


def _model_in(annotation: object) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    inside = get_args(annotation)[:1] if get_origin(annotation) is Annotated else get_args(annotation)
    return next((model for part in inside if (model := _model_in(part)) is not None), None)


def value(word: str) -> Scalar:
    """What a word of `Words` says."""
    return {"true": True, "false": False}.get(word, word)
