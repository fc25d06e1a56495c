"""Search for the mesh files of a log on this machine."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

from manipcli.description.packages import NotFound, Packages, may_name
from manipcli.model.robot import RobotModel
from manipcli.run.run_log import RUNS
from manipcli.scene.scene import Scene
from manipcli.shapes.primitives import Geometry, Mesh


class MeshSearch:
    """Sets the file paths of the meshes of a robot or a scene, which a log holds as URIs.

    Known files and files embedded in the log come first. Packages are searched next to the log, in the folders of a
    project that holds the log in `runs/`, and in the working directory and its folders. A mesh that is not found keeps
    its URI as its path, and is drawn as a placeholder.

    Args:
        log: path of the log.
        hashes: SHA-256 of the files in the run, by URI, if known.
        embedded: files embedded in the log, by URI.
        known: files of the run by URI, if it was just run.
        package_path, allow_outside: see `Packages`.
        robot: path of the robot file as the task names it, and its `packages:`, whose folders start there.

    Attributes:
        folder: temporary folder of the embedded files, removed together with this object.
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
        robot: tuple[str, Mapping[str, str]] = ("", {}),
    ) -> None:
        here = Path.cwd()
        beside = log.resolve().parent
        # The parent of any other folder can be / or /home, which is too large to search.
        project = _folders(beside.parent) if beside.name == RUNS.name else []
        places = [*package_path, *project, *_folders(beside), here, *_folders(here)]
        tasks = [*([beside.parent] if project else []), beside, *places]
        root = None if allow_outside else beside.parent if project else beside
        self._packages = Packages(
            log, package_path=places, allow_outside=allow_outside, named=_named_packages(tasks, *robot, root=root)
        )
        self._hashes = hashes
        self._known = known
        self.folder = TemporaryDirectory(prefix="manipcli-") if embedded else None
        self._found = _unpacked(embedded, Path(self.folder.name)) if self.folder is not None else {}
        self._notes: dict[str, None] = {}

    @property
    def notes(self) -> tuple[str, ...]:
        """Meshes that are not found or differ from the run; one sentence each."""
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
            replace(geometry, shape=replace(geometry.shape, path=self._path(geometry.shape.uri)))
            if isinstance(geometry.shape, Mesh)
            else geometry
            for geometry in geometries
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
                note = f"package '{name}' not found, or it lacks a mesh: set its location with --package-path DIR"
            else:
                note = error.message
            self._notes.setdefault(note)
            return Path(uri)
        digest = self._hashes.get(uri)
        if digest is not None and hashlib.sha256(path.read_bytes()).hexdigest() != digest:
            self._notes.setdefault(f"mesh '{uri}' differs from the file of the run")
        return path


def _named_packages(
    tasks: Sequence[Path], robot: str, packages: Mapping[str, str], *, root: Path | None
) -> dict[str, Path]:
    """The folders of `packages:` of a robot file, if it lies where a task in one of the folders `tasks` names it.

    By their names, and by the names of the folders, which the URIs of a log use for a package without `package.xml`.
    A log is of unknown origin: a folder outside `root` must be a ROS package of this name; None permits all folders.
    """
    found: dict[str, Path] = {}
    for file in dict.fromkeys(folder / robot for folder in tasks) if packages else ():
        if file.is_file():
            for name, folder in packages.items():
                place = (file.parent / folder).resolve()
                if place.is_dir() and (root is None or may_name(place, name, root)):
                    found.setdefault(name, place)
                    found.setdefault(place.name, place)
    return found


def _unpacked(embedded: Mapping[str, bytes], folder: Path) -> dict[str, Path]:
    """Files by URI, written below `folder`; files of one folder stay together, such as a mesh and its materials."""
    found = {}
    for uri, data in embedded.items():
        place, _, name = uri.rpartition("/")
        inside = folder / hashlib.sha256(place.encode()).hexdigest()[:16]
        inside.mkdir(exist_ok=True)
        found[uri] = inside / (PurePosixPath(name).name.strip(".\0") or "mesh")
        found[uri].write_bytes(data)
    return found


def _folders(folder: Path) -> list[Path]:
    """The visible subfolders of a folder, sorted by name."""
    try:
        return sorted(path for path in folder.iterdir() if path.is_dir() and not path.name.startswith("."))
    except OSError:
        return []
