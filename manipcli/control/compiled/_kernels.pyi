"""The extension module that `kernels.c` defines."""

from collections.abc import Callable
from typing import Any, final

import numpy.typing as npt

SOURCE_CRC: int

@final
class Kernel:
    run: Callable[..., Any]

def bind(law: str, n: int, /, *arrays: npt.NDArray[Any]) -> Kernel: ...
