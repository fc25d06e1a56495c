"""Bytecode for the processes of the tests, also where the environment forbids Python to write it.

The tests start hundreds of processes, and each would compile every module of manipcli. This file is read before
`tests/conftest.py`, which imports manipcli.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

if sys.dont_write_bytecode:
    sys.dont_write_bytecode = False
    sys.pycache_prefix = os.environ["PYTHONPYCACHEPREFIX"] = str(Path(__file__).parent / ".pytest_cache" / "bytecode")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
