"""Constants of the MCAP format (https://mcap.dev/spec) for writer and readers."""

from __future__ import annotations

import struct
from pathlib import Path

LIBRARY = "manipcli"
"""Name of the writer in the header."""
MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, ATTACHMENT, METADATA, DATA_END = (
    0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x09, 0x0C, 0x0F,
)  # fmt: skip
RECORD_HEAD = struct.Struct("<BQ")
"""Opcode and length of the body."""
MESSAGE_HEAD = struct.Struct("<BQHIQQ")
"""Opcode, length of the body, channel, sequence number, log time, publish time."""
PAYLOAD = MESSAGE_HEAD.size
"""Bytes of a message record before its CDR bytes."""
CHUNK_HEAD = struct.Struct("<QQQI")
FOOTER_RECORD = struct.Struct("<BQQQI")
MAX_RECORD = 1 << 28
"""Largest record [byte]."""


def begins_as_log(path: Path) -> bool:
    """Whether a regular file begins with the MCAP magic bytes; False if it cannot be read."""
    try:
        if not path.is_file():
            return False
        with path.open("rb") as stream:
            return stream.read(len(MAGIC)) == MAGIC
    except OSError:
        return False
