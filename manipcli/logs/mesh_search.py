"""The mesh files of a log, found again on the machine that shows it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

from manipcli.description.packages import NotFound, Packages
from manipcli.model.robot import RobotModel
from manipcli.run.run_log import RUNS
from manipcli.scene.scene import Scene
from manipcli.shapes.primitives import Geometry, Mesh


class MeshSearch:
    """Puts the paths of files into the meshes of a robot or a scene that have only their URIs.

    What the log carries itself, and files that are known, are taken. Packages are looked for as for a description
    beside the log, in the folders of a project that holds the log in `runs/`, and in the working directory and its
    folders. What is not found keeps its URI as its path: whoever draws it draws something else.

    Args:
        log: where the log is.
        hashes: SHA-256 of the files in the run, by URI, where they are known.
        embedded: files that the log carries, by URI.
        known: files that the run had, by URI, where whoever asks has just run it.
        package_path, allow_outside: see `Packages`.

    Attributes:
        folder: of the files that the log carried; it is removed when nobody holds this any longer.
    """

    def __init__(
        self,
        log: Path,
        *,
        hashes: Mapping[str, str] = {},
        embedded: Mapping[str, bytes] = {},
        known: Mapping[str, Path] = {},
        package_path: Sequence[Path] = (),
        allow_outside: bool = False,
    ) -> None:
        here = Path.cwd()
        beside = log.resolve().parent
        # Of any other folder the one above may hold everything: /, or where all homes are.
        project = _folders(beside.parent) if beside.name == RUNS.name else []
        places = [*package_path, *project, *_folders(beside), here, *_folders(here)]
        self._packages = Packages(log, package_path=places, allow_outside=allow_outside)
        self._hashes = hashes
        self._known = known
        self.folder = TemporaryDirectory(prefix="manipcli-") if embedded else None
        self._found = _unpacked(embedded, Path(self.folder.name)) if self.folder is not None else {}
        self._notes: dict[str, None] = {}

    @property
    def notes(self) -> tuple[str, ...]:
        """What was not found, or is another file than in the run; a sentence each."""
        return tuple(self._notes)

    def robot(self, robot: RobotModel) -> RobotModel:
        """The robot with the files of its meshes."""
        links = tuple(
            replace(link, visuals=self._all(link.visuals), collisions=self._all(link.collisions))
            for link in robot.links
        )
        return replace(robot, links=links)

    def scene(self, scene: Scene) -> Scene:
        """The scene with the files of its meshes."""
        return replace(
            scene, bodies=tuple(replace(body, geometries=self._all(body.geometries)) for body in scene.bodies)
        )

    def _all(self, geometries: tuple[Geometry, ...]) -> tuple[Geometry, ...]:
        return tuple(
            replace(one, shape=replace(one.shape, path=self._path(one.shape.uri)))
            if isinstance(one.shape, Mesh)
            else one
            for one in geometries
        )

    def _path(self, uri: str) -> Path:
        if uri not in self._found:
            self._found[uri] = self._search(uri)
        return self._found[uri]

    def _search(self, uri: str) -> Path:
        try:
            path = self._known.get(uri) or self._packages.resolve(uri)
        except NotFound as error:
            scheme, _, rest = uri.partition("://")
            if scheme == "package":
                name = rest.partition("/")[0]
                note = f"package '{name}' is not found, or lacks a mesh: give its place with --package-path DIR"
            else:
                note = error.message
            self._notes.setdefault(note)
            return Path(uri)
        digest = self._hashes.get(uri)
        if digest is not None and hashlib.sha256(path.read_bytes()).hexdigest() != digest:
            self._notes.setdefault(f"mesh '{uri}' is not the file that it was in the run")
        return path


def _unpacked(embedded: Mapping[str, bytes], folder: Path) -> dict[str, Path]:
    """Files by their URIs; those of one folder stay together, as a mesh and its materials, and none leaves `folder`."""
    found = {}
    for uri, data in embedded.items():
        place, _, name = uri.rpartition("/")
        inside = folder / hashlib.sha256(place.encode()).hexdigest()[:16]
        inside.mkdir(exist_ok=True)
        found[uri] = inside / (PurePosixPath(name).name.strip(".\0") or "mesh")
        found[uri].write_bytes(data)
    return found


def _folders(folder: Path) -> list[Path]:
    """The folders in a folder that are not hidden, by name."""
    try:
        return sorted(one for one in folder.iterdir() if one.is_dir() and not one.name.startswith("."))
    except OSError:
        return []
