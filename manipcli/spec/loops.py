"""Spec of a closed loop of links: the pin that closes it."""

from __future__ import annotations

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.quantity import Length


class LoopSpec(Model):
    """A pin that closes a loop of links: a point of one link stays on a point of the other, which may rotate there."""

    between: tuple[str, str] = Field(description="The two links, of different branches.")
    at: tuple[Length, Length, Length] = Field(description="The pin in the frame of the first link [m].")
    at_other: tuple[Length, Length, Length] | None = Field(
        None,
        description="The pin in the frame of the second link [m]. Default: where `at` is with all joints at zero.",
    )
    driven_by: str = Field(
        description="The joint of the loop that is commanded; the others have no motor and follow it."
    )
