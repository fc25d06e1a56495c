"""Axes that are no direction."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import LIMIT, one_joint

CHECK = Check(
    code="URDF009",
    name="axis",
    tier="physics",
    severity="error",
    summary="The axis of a joint is zero, or too long to be a direction",
    reason=(
        "A joint about the axis 0 0 0 turns all states of PyBullet into NaN from the first step on, without a word."
    ),
    bad=one_joint('<axis xyz="0 0 0"/>' + LIMIT),
    find=found_while_reading("URDF009"),
)
