"""The registry of transmissions, `TRANSMISSIONS`; one file per member."""

from __future__ import annotations

from manipcli.core.registry import Seam
from manipcli.description.transmission import TransmissionMember
from manipcli.description.transmissions.differential import DIFFERENTIAL
from manipcli.description.transmissions.four_bar import FOUR_BAR
from manipcli.description.transmissions.simple import SIMPLE

TRANSMISSIONS: Seam[TransmissionMember] = Seam(kind="transmission", members=(SIMPLE, DIFFERENTIAL, FOUR_BAR))
BY_TYPE = {member.type: member for member in TRANSMISSIONS}
"""The members by their type in descriptions."""
