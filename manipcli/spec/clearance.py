"""Spec of `clearance:` of a task file: the distance between parts that planning keeps."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.names import PartName
from manipcli.spec.quantity import Length

PartPair = tuple[PartName, PartName]
"""Two parts: a body, `robot/LINK`, or `robot` for each of its links."""


class PairClearanceSpec(Model):
    """The clearance of single pairs of parts."""

    between: PartPair = Field(description="Two parts: a body, `robot/LINK`, or `robot` for each of its links.")
    distance: Annotated[Length, Field(ge=0, le=1.0)] = Field(description="The clearance [m], 0 to 1 m.")


class ClearanceSpec(Model):
    """The distance that planned motions keep between parts that must not touch."""

    default: Annotated[Length, Field(ge=0, le=1.0)] = Field(
        0.004, description="Between parts not named in `pairs` [m], 0 to 1 m. Default 4 mm."
    )
    pairs: tuple[PairClearanceSpec, ...] = Field(
        (),
        description="For single pairs: `{between: [robot, shelf], distance: 2 cm}`; the last one that applies counts.",
    )
