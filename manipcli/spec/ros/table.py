"""Tables of ROS parameters for one type of controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, get_args, get_origin

from pydantic import BaseModel

from manipcli.spec.source.tree import MappingNode, Plain, Scalar

Words = Mapping[str, str]
"""Values that a ROS type implies: our key -> value; several values are separated by blanks."""


Data = dict[str, Plain]
"""The parameters of a controller as plain data."""


@dataclass(frozen=True, slots=True)
class Block:
    """The ROS parameters of one block. Names that our spec has need not be listed.

    Attributes:
        known: names; those without a field in the spec are left out with a warning.
        quiet: names that are left out with a note only, since they concern publishing or reading.
        renamed: ROS's name -> ours.
        inner: blocks below, by key.
        joint: the block of every other mapping: one per joint.
        neutral: values with the same effect as a missing key, as in parameter dumps.
        unserved: values of a key that ROS supports and manipcli does not.
        most: largest tolerance; a larger one is left out with a warning.
        refused: key -> why a controller that has it cannot be served: it would command something else.
        filled: lists that must not be empty, though ours may be.
        unwritten: names of older versions, which are read but not written.
    """

    known: frozenset[str] = frozenset()
    quiet: frozenset[str] = frozenset()
    renamed: Words = field(default_factory=dict)
    inner: Mapping[str, Block] = field(default_factory=dict)
    joint: Block | None = None
    neutral: Mapping[str, tuple[Plain, ...]] = field(default_factory=dict)
    unserved: Mapping[str, tuple[Plain, ...]] = field(default_factory=dict)
    most: Mapping[str, float] = field(default_factory=dict)
    refused: Words = field(default_factory=dict)
    filled: frozenset[str] = frozenset()
    unwritten: frozenset[str] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        """All ROS parameters of the block."""
        return (*self.known, *self.quiet, *self.renamed, *self.inner, *self.refused)


def _same(node: MappingNode) -> MappingNode:
    return node


def _unchanged(data: Data) -> Data:
    return data


@dataclass(frozen=True, slots=True)
class Table:
    """One of our types, and the ROS types that are rewritten to it.

    Attributes:
        own: our type.
        types: ROS type -> values that it implies.
        parameters: ROS parameters of all these types.
        ros2: the type in ROS 2 that is written, by the interface that it commands, or under "" for any.
        reshape: restructures a controller after renaming.
        unshape: the inverse, before renaming, of the parameters to write.
        idle: command interface -> our keys that have no effect on it.
        interface: ROS key that names a hardware interface; a controller with an interface that manipcli does not have
            is left out with a warning.
        needs: required keys, of which one suffices; a controller without them is left out with a warning.
    """

    own: str
    types: Mapping[str, Words]
    parameters: Block
    ros2: Words
    reshape: Callable[[MappingNode], MappingNode] = _same
    unshape: Callable[[Data], Data] = _unchanged
    idle: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    interface: str = ""
    needs: tuple[str, ...] = ()


def model_below(model: type[BaseModel] | None, key: str) -> type[BaseModel] | None:
    """The model under `key`, or of each value of a mapping there; None for anything else."""
    found = None if model is None else model.model_fields.get(key)
    return None if found is None else _model_in(found.annotation)


def _model_in(annotation: object) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    inside = get_args(annotation)[:1] if get_origin(annotation) is Annotated else get_args(annotation)
    return next((model for part in inside if (model := _model_in(part)) is not None), None)


def value(word: str) -> Scalar:
    """The value of a word of `Words`."""
    return {"true": True, "false": False}.get(word, word)
