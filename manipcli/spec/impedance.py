"""Specs of stiffness and damping along and about the axes of a tool, and of its joints."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.spec.base import Model

NotNegative = Annotated[float, Field(ge=0)]
Axes3 = tuple[NotNegative, NotNegative, NotNegative]


class TaskSpaceSpec(Model):
    """Values along and about three axes: one number for all three, or a list of x, y, z."""

    translation: NotNegative | Axes3 = Field(description="Stiffness [N/m] or damping [N s/m], 0 or more.")
    rotation: NotNegative | Axes3 = Field(description="Stiffness [N m/rad] or damping [N m s/rad], 0 or more.")


class PostureSpec(Model):
    """Stiffness of the joints towards the reference configuration, in the null space of the tool."""

    stiffness: NotNegative = Field(10.0, description="Of each joint [N m/rad or N/m], 0 or more. Default 10.")
    damping_ratio: NotNegative = Field(
        1.0, description="Damping 2 ratio sqrt(stiffness x inertia) of each joint, 0 or more. Default 1."
    )


def six(spec: TaskSpaceSpec) -> tuple[float, ...]:
    """(6,) Values along x, y, z, then about them."""
    parts = (spec.translation, spec.rotation)
    return tuple(float(value) for part in parts for value in (part if isinstance(part, tuple) else (part,) * 3))
