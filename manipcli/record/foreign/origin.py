"""Detection of the program that wrote a log."""

from __future__ import annotations

from pathlib import Path

from manipcli.record.contents import RECORD
from manipcli.record.read.salvage import Salvage


def is_own(path: Path) -> bool:
    """Whether manipcli wrote a log: its contents record comes before the first message.

    Raises:
        BadRecording: the file is not an MCAP file, or is damaged.
    """
    from mcap.records import Metadata

    return any(isinstance(piece, Metadata) and piece.name == RECORD for piece in Salvage(path))
