"""The shapes of one frame as a glTF file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from manipcli.render.drawing import Drawable
from manipcli.replay.gltf.container import Document

FORWARD: Final = (-0.5, -0.5, -0.5, 0.5)
"""Rotation of a frame with x forward and z up (REP 103) to the axes of glTF: z forward, y up."""


def model_glb(name: str, drawables: Sequence[Drawable]) -> bytes:
    """The file of the shapes of a frame; its front and top are those of the frame, as glTF defines them."""
    file = Document()
    file.nodes.append({"name": name, "rotation": list(FORWARD), "mesh": file.mesh(name, drawables)})
    return file.glb(0)
