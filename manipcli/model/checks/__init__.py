"""What can be wrong with a description: one file a check."""

from manipcli.core.registry import Seam
from manipcli.model.check import Check

CHECKS: Seam[Check] = Seam(kind="check", members=())
