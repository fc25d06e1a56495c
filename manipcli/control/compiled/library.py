"""Loads the compiled kernels, if they are installed, up to date and not switched off."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from manipcli.control.compiled.compiler import crc_of

SWITCH: Final = "MANIPCLI_KERNELS"
"""Environment variable; `off` selects the laws in Python."""
SOURCE: Final = Path(__file__).with_name("kernels.c")

Run = Callable[..., Any]
"""A law on the arrays it was bound to; its arguments are numbers."""


class _Kernel(Protocol):
    run: Run


class Kernels(Protocol):
    """The extension module."""

    SOURCE_CRC: int
    """Checksum of the source that it was compiled from."""

    def bind(self, law: str, n: int, /, *arrays: npt.NDArray[Any]) -> _Kernel: ...


def _load() -> Kernels | None:
    if os.environ.get(SWITCH, "").lower() == "off":
        return None
    try:
        from manipcli.control.compiled import _kernels
    except ImportError:
        return None
    # An editable installation keeps its kernels when the source changes; wheels have no source.
    if SOURCE.exists() and crc_of(SOURCE.read_bytes()) != _kernels.SOURCE_CRC:
        return None
    return _kernels


_in_use: Kernels | None = _load()


def use(kernels: Kernels | None) -> Kernels | None:
    """From the next `bind` on, use these kernels, None: the laws in Python; returns those before."""
    global _in_use
    before, _in_use = _in_use, kernels
    return before


def kernels_in_use() -> bool:
    """Whether `bind` gives compiled kernels."""
    return _in_use is not None


def bind(law: str, n: int, *arrays: npt.NDArray[Any]) -> Run | None:
    """A compiled law of n joints on these arrays, which it keeps; `kernels.c` lists the laws.

    None, so that the caller uses its law in Python, if there are no kernels, or if an array is not contiguous or not of
    the type that the kernel expects.

    Raises:
        ValueError: an array of another length, an index out of range.
    """
    if _in_use is None:
        return None
    try:
        return _in_use.bind(law, n, *arrays).run
    except (BufferError, TypeError):
        return None


def integers(index: slice | npt.NDArray[np.intp], n: int) -> npt.NDArray[np.int64]:
    """An index into an array (n) as numbers."""
    return np.arange(n, dtype=np.int64)[index]
