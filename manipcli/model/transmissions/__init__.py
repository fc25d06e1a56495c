"""The transmissions: one file a member. `TRANSMISSIONS` is their registry."""

from __future__ import annotations

from manipcli.core.registry import Seam
from manipcli.model.transmission import TransmissionMember
from manipcli.model.transmissions.differential import DIFFERENTIAL
from manipcli.model.transmissions.four_bar import FOUR_BAR
from manipcli.model.transmissions.simple import SIMPLE

TRANSMISSIONS: Seam[TransmissionMember] = Seam(kind="transmission", members=(SIMPLE, DIFFERENTIAL, FOUR_BAR))
BY_TYPE = {member.type: member for member in TRANSMISSIONS}
"""The members by their names in descriptions."""
