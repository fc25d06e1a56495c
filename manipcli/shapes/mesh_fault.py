"""What every reader of meshes shares: the bounds, and the way to say that a file cannot be used."""

from __future__ import annotations

import numpy as np

from manipcli.shapes.primitives import Rgba

MAX_BYTES = 256_000_000
MAX_TRIANGLES = 2_000_000

Faces = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
"""(m, 3): each row the vertices of a triangle."""
Colours = tuple[tuple[int, Rgba | None], ...]
"""Index of the first face of each run of one colour, with the colour (0 to 1), or None where the file says none."""


class UnusableMesh(Exception):
    """A file holds no mesh that can be used; the caller, who knows where it is named, makes a finding of it.

    `reason` is the rest of a sentence that begins with the name of the file.
    """

    def __init__(self, reason: str, *, hint: str | None = None) -> None:
        self.reason = reason
        self.hint = hint
        super().__init__(reason)
