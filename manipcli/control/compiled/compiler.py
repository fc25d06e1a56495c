"""Compilation of the kernels into an extension module that serves every version of Python from 3.11 on.

Imports the standard library only: the build hook of the repository runs this file alone.
"""

from __future__ import annotations

import os
import zlib
from pathlib import Path

# No fused multiply-add and no reordering: the kernels give the bits of numpy's single operations.
FLAGS = ("-O2", "-ffp-contract=off", "-fno-fast-math", "-fPIC", "-shared")


def crc_of(source: bytes) -> int:
    """The checksum by which a module is compared with its source."""
    return zlib.crc32(source) & 0x7FFFFFFF


def compile_kernels(source: Path, library: Path) -> str:
    """Compile `source` to `library` with $CC, the compiler of this Python, or `cc`.

    Returns:
        Why this is impossible (no compiler, no headers of Python); empty if it is done.
    """
    import shlex
    import subprocess
    import sysconfig

    known = f"-DSOURCE_CRC={crc_of(source.read_bytes())}", f"-I{sysconfig.get_path('include')}"
    # A new file in its place: processes that have loaded the old one keep it.
    made = library.with_suffix(f".{os.getpid()}.tmp")
    faults = []
    for compiler in dict.fromkeys((os.environ.get("CC"), sysconfig.get_config_var("CC"), "cc")):
        if not compiler:
            continue
        command = [*shlex.split(compiler), *FLAGS, *known, str(source), "-o", str(made)]
        try:
            ran = subprocess.run(command, capture_output=True, text=True)
        except OSError as error:
            faults.append(f"{command[0]}: {error.strerror}")
            continue
        if ran.returncode == 0:
            made.replace(library)
            return ""
        made.unlink(missing_ok=True)
        faults.append(f"{command[0]}: {ran.stderr.strip().partition(os.linesep)[0]}")
    return "; ".join(faults)
