"""Mesh files that clients may fetch, by the URIs of the robot description."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

MAX_ASSET: Final = 64 << 20
"""Largest file that is sent [byte]."""


class AssetRefused(Exception):
    """A URI that is not served; the text says why, without a path of this machine."""


class Assets:
    """The files that the meshes of a robot and its scene name, and nothing else.

    Args:
        files: by URI, as in the URDF of `/robot_description` and the markers of `/markers`; read when they are fetched.
    """

    def __init__(self, files: Mapping[str, Path]) -> None:
        self._files = dict(files)

    def read(self, uri: str) -> bytes:
        """The content of a file.

        Raises:
            AssetRefused: no mesh has this URI, or the file is missing or larger than `MAX_ASSET`.
        """
        path = self._files.get(uri)
        if path is None:
            raise AssetRefused("no mesh of the robot or the scene has this URI")
        try:
            with path.open("rb") as file:
                found = file.read(MAX_ASSET + 1)
        except OSError as error:
            raise AssetRefused(f"the file cannot be read: {error.strerror}") from None
        if len(found) > MAX_ASSET:
            raise AssetRefused(f"the file is larger than {MAX_ASSET >> 20} MiB")
        return found
