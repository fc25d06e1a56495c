"""Mesh files embedded in a log: attachment names, and the material files that meshes need."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

_MATERIALS = re.compile(rb"^[ \t]*mtllib[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")


@dataclass(frozen=True, slots=True)
class EmbeddedFile:
    """A file, its URI in the description, and the name of its attachment."""

    uri: str
    path: Path
    attachment: str


def embeddable(meshes: Mapping[str, Path]) -> tuple[EmbeddedFile, ...]:
    """The meshes (URI -> file) and the material libraries of OBJ files in the same folders, with unique names.

    A name is a number and the last part of the URI without special characters: two packages can have a `base.stl`.
    """
    files = dict(meshes)
    for uri, path in meshes.items():
        if path.suffix.lower() == ".obj":
            for library in _MATERIALS.findall(path.read_bytes()):
                name = PurePosixPath(library.decode(errors="replace")).name
                beside = path.parent / name
                if name and beside.is_file():
                    files.setdefault(f"{uri.rpartition('/')[0]}/{name}" if "/" in uri else name, beside)
    return tuple(
        EmbeddedFile(uri, files[uri], f"mesh_{number:03d}_{_UNSAFE.sub('_', PurePosixPath(uri).name)[-80:]}")
        for number, uri in enumerate(sorted(files))
    )
