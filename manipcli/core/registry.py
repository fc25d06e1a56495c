"""Registry of the members of a seam, by name; without global state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar


class Member(Protocol):
    """A member of a seam, with the name that files use for it."""

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
        raise KeyError(f"unknown {self.kind} '{name}'; known: {', '.join(self.names)}")
