"""The task of a log as files again, ready to run.

Robot, controllers, scene and steps are those of the log as resolved; the description is the expanded URDF with all that
the robot file mended, so that the robot file no longer names further descriptions. Meshes are in folders of their
packages beside it, so that their URIs stay those of the log.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final
from urllib.parse import unquote
from xml.sax.saxutils import escape

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import shorten
from manipcli.judge.drawn import SAMPLE
from manipcli.judge.part import PART
from manipcli.logs.mesh_search import MeshSearch
from manipcli.logs.recorded_files import (
    attached,
    recorded_packages,
    recorded_robot,
    recorded_robot_file,
    recorded_scene,
    recorded_task_file,
)
from manipcli.record.attachments import CONTROLLERS, ROBOT, TASK, URDF
from manipcli.record.recording import Recording
from manipcli.run.embedding import embeddable
from manipcli.scene.scene import Scene
from manipcli.shapes.primitives import Mesh, mesh_files
from manipcli.spec.resolved import resolved
from manipcli.spec.retry import expressions
from manipcli.spec.task import TaskSpec

README: Final = "README.md"
OWN: Final = frozenset({TASK, ROBOT, CONTROLLERS, URDF, README})
"""Names that no package can have."""
_PACKAGE_XML = (
    '<?xml version="1.0"?>\n<package format="3">\n  <name>{name}</name>\n  <version>0.0.0</version>\n'
    "  <description>Meshes of a log.</description>\n</package>\n"
)
_README = """\
The task of {log}, as it was resolved for the run: `{command}` runs it.
Beside places in files (file:line:column in events, plan and texts) and the names of files, its log is that of the run,
with the same versions of manipcli and the engine.{notes}
"""


@dataclass(frozen=True, slots=True)
class TaskFiles:
    """Contents by path in their folder, the options of `run` that repeat the run, and what is not repeated."""

    files: Mapping[str, bytes]
    options: tuple[str, ...]
    notes: tuple[str, ...]

    def command(self, folder: Path) -> str:
        """The command that repeats the run."""
        return shlex.join(["manipcli", "run", str(folder / TASK), *self.options])


def task_files(recording: Recording, path: Path, *, package_path: Sequence[Path], allow_outside: bool) -> TaskFiles:
    """The files of a log.

    Args:
        recording: the log.
        path: path of the log.
        package_path, allow_outside: where meshes are searched that the log does not embed, see `MeshSearch`.

    Raises:
        InvalidInput: an attachment is missing or invalid, a mesh is not found, or a body is from a description, which
            a log does not hold.
    """
    task, robot = recorded_task_file(recording, path), recorded_robot_file(recording, path)
    described = [name for name, body in task.spec.scene.items() if body.urdf is not None]
    if described:
        message = f"body '{described[0]}' is from a description, which a log does not hold: the task cannot be written"
        raise InvalidInput([Diagnostic("LOG403", message, Place(str(path), 0, 0), hint="use the files of the task")])
    meshes = MeshSearch(
        path,
        hashes=recording.metadata.get("meshes", {}),
        embedded=recording.embedded_meshes(),
        package_path=package_path,
        allow_outside=allow_outside,
        robot=recorded_packages(recording, path),
    )
    model, scene = meshes.robot(recorded_robot(recording, path)), meshes.scene(recorded_scene(recording, path))
    geometries = [each for link in model.links for each in (*link.visuals, *link.collisions)]
    geometries += [each for body in scene.bodies for each in body.geometries]
    local = robot.spec.model_copy(
        update={
            "description": URDF, "args": {}, "attach": (), "packages": None, "inertials": None, "collision": None
        }
    )  # fmt: skip
    options, notes = _of_run(recording)
    return TaskFiles(
        {
            TASK: resolved(_local(task.spec, scene), expressions(task)).encode(),
            ROBOT: resolved(local).encode(),
            CONTROLLERS: attached(recording, path, CONTROLLERS),
            URDF: attached(recording, path, URDF),
            **_packages(mesh_files(geometries), path, meshes),
        },
        options,
        (*meshes.notes, *notes),
    )


def readme(made: TaskFiles, log: Path) -> bytes:
    """A text for the folder of the files."""
    notes = "".join(f"\n{note[:1].upper()}{note[1:]}." for note in made.notes)
    return _README.format(log=log.name, command=made.command(Path()), notes=notes).encode()


def _local(spec: TaskSpec, scene: Scene) -> TaskSpec:
    """The task with the names of the files beside it; its meshes are named by their URIs."""
    bodies = dict(spec.scene)
    for name, body in bodies.items():
        if body.mesh is not None:
            shapes = [each.shape for one in scene.bodies if one.name == name for each in one.geometries]
            uri = next((shape.uri for shape in shapes if isinstance(shape, Mesh)), body.mesh.file)
            bodies[name] = body.model_copy(update={"mesh": body.mesh.model_copy(update={"file": uri})})
    return spec.model_copy(update={"scene": bodies, "robot": ROBOT, "controllers": CONTROLLERS})


def _packages(meshes: Mapping[str, Path], log: Path, search: MeshSearch) -> dict[str, bytes]:
    """The mesh files, with the materials of OBJ files, in a folder for each package.

    Raises:
        InvalidInput: a mesh is not found, or its URI does not name a file of a package.
    """
    absent = [uri for uri, file in meshes.items() if not file.is_file()]
    if absent:
        message = f"mesh '{shorten(absent[0])}' not found: the task would not run"
        hint = "; ".join(search.notes) or "set the location of its package with --package-path DIR"
        raise InvalidInput([Diagnostic("LOG400", message, Place(str(log), 0, 0), hint=hint)])
    found: dict[str, bytes] = {}
    for file in embeddable(meshes):
        scheme, _, rest = file.uri.partition("://")
        name = unquote(rest)
        parts = PurePosixPath(name).parts
        bad = {"..", "/", "package.xml"} & {*parts} or any(mark in name for mark in "\0\\")
        if scheme != "package" or len(parts) < 2 or bad or parts[0] in OWN:
            message = f"mesh '{shorten(file.uri)}' is not a file of a package"
            raise InvalidInput([Diagnostic("LOG103", message, Place(str(log), 0, 0))])
        found[f"{parts[0]}/package.xml"] = _PACKAGE_XML.format(name=escape(parts[0])).encode()
        found["/".join(parts)] = file.path.read_bytes()
    return found


def _of_run(recording: Recording) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The options that the run had besides its files, and what of it cannot be repeated."""
    sample, part = recording.metadata.get(SAMPLE, {}), recording.metadata.get(PART, {})
    options = ["--sample", sample["number"]] if "number" in sample else []
    options += ["--design", sample["design"]] if "design" in sample else []
    options += ["--from", part["from"], "--state", part.get("origin", "LOG")] if "from" in part else []
    options += ["--until", part["until"]] if "until" in part else []
    notes = ["the log is of a live session: its commands are not repeated"] if "live" in part else []
    if "from" in part:
        notes.append(f"the run began in a state of {part.get('origin', 'another log')}, which is needed, too")
    return tuple(options), tuple(notes)
