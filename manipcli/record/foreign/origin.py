"""Which program wrote a log."""

from __future__ import annotations

from pathlib import Path

from manipcli.record.contents import RECORD
from manipcli.record.read.salvage import Salvage


def is_own(path: Path) -> bool:
    """Whether manipcli wrote a log: such a one says what it holds before its first message.

    Raises:
        BadRecording: it is no MCAP file, or damaged.
    """
    from mcap.records import Metadata

    return any(isinstance(piece, Metadata) and piece.name == RECORD for piece in Salvage(path))
