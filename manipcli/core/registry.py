"""Members of a seam, by name. The pipeline gathers them and passes them down; nothing here is global state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar


class Member(Protocol):
    """What every member of a seam has: the name by which files call it."""

    @property
    def name(self) -> str: ...


M = TypeVar("M", bound=Member)


@dataclass(frozen=True, slots=True)
class Seam(Generic[M]):
    """All members of one kind (`step`, `condition`, `engine`, ...), in the order of their registration."""

    kind: str
    members: tuple[M, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(member.name for member in self.members)

    def __iter__(self) -> Iterator[M]:
        return iter(self.members)

    def __getitem__(self, name: str) -> M:
        for member in self.members:
            if member.name == name:
                return member
        raise KeyError(f"no {self.kind} '{name}'; known: {', '.join(self.names)}")
