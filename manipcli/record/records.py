"""Constants of the MCAP format (https://mcap.dev/spec) that writer and readers share."""

from __future__ import annotations

import struct
from pathlib import Path

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, ATTACHMENT, METADATA, DATA_END = (
    0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x09, 0x0C, 0x0F,
)  # fmt: skip
RECORD_HEAD = struct.Struct("<BQ")
"""Opcode and length of what follows."""
MESSAGE_HEAD = struct.Struct("<BQHIQQ")
"""Opcode, length of what follows, channel, sequence number, log time, publish time."""
PAYLOAD = MESSAGE_HEAD.size
"""From the beginning of a message record to its CDR bytes."""
CHUNK_HEAD = struct.Struct("<QQQI")
FOOTER_RECORD = struct.Struct("<BQQQI")
MAX_RECORD = 1 << 28
"""[byte] that are read of one record."""


def begins_as_log(path: Path) -> bool:
    """Whether a regular file begins with the eight bytes of every MCAP file; False where it cannot be read."""
    try:
        if not path.is_file():
            return False
        with path.open("rb") as stream:
            return stream.read(len(MAGIC)) == MAGIC
    except OSError:
        return False
