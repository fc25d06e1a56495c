"""The files of a task as one value that another machine can load: contents by hash, and where each belongs.

A bundle recreates the folders of the files below a folder of the worker, so that relative names and packages lead to
the same files. It has what Python opened while the task was loaded, the meshes, and the marks by which packages and
projects are found.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.opened_files import opened_by
from manipcli.core.text import escape
from manipcli.run.run_log import mesh_files
from manipcli.sweep.sampling import Sampling
from manipcli.task.load_task import WrittenTask
from manipcli.task.task_files import MARKS

PACKAGE: Final = "package.xml"
PYTHON: Final = "__init__.py"
"""Mark of a Python package, by which meshes of an installed one are named."""
_LEVELS: Final = 6
_PACKAGE_URI: Final = "package://"
_PROGRAM: Final = (".py", ".pyc", ".so", ".pth")


@dataclass(frozen=True, slots=True)
class Bundle:
    """A task with its files.

    Attributes:
        contents: of the files, by SHA-256.
        files: hash of each file by its absolute path on the first machine.
        links: symbolic links among the folders, by path: where each leads.
        marks: empty files by which a project is found.
        task: path of the task file.
        package_path: folders of packages.
    """

    contents: Mapping[str, bytes]
    files: Mapping[str, str]
    links: Mapping[str, str]
    marks: tuple[str, ...]
    task: str
    package_path: tuple[str, ...]

    def unpack(self, folder: Path) -> tuple[Path, tuple[Path, ...]]:
        """Writes the files below a folder; returns the task file and the folders of packages there."""
        for path, key in self.files.items():
            there = below(folder, path)
            there.parent.mkdir(parents=True, exist_ok=True)
            there.write_bytes(self.contents[key])
        for path in self.marks:
            below(folder, path).touch()
        for path, target in self.links.items():
            there = below(folder, path)
            there.parent.mkdir(parents=True, exist_ok=True)
            there.symlink_to(below(folder, target))
        return below(folder, self.task), tuple(below(folder, path) for path in self.package_path)


def below(folder: Path, path: str) -> Path:
    """An absolute path, below a folder instead of the root."""
    return folder / Path(path).relative_to(Path(path).anchor)


def bundled(load: Sampling, path: Path) -> Bundle:
    """The bundle of a task that has been loaded; it is loaded once more to see which files are read."""
    written, opened = opened_by(lambda: load.again())
    return bundle_of(written, [found for found, _ in opened.stamps], path)


def bundle_of(written: WrittenTask, opened: list[Path], path: Path) -> Bundle:
    """The bundle of a task.

    Args:
        written: the task.
        opened: the files that were opened when it was loaded.
        path: the task file.

    Raises:
        InvalidInput: a file is named by an absolute path, which another machine does not have.
    """
    spec, robot = written.task.spec, written.task.robot_file.spec
    for key, file in (("robot", spec.robot), ("controllers", spec.controllers), ("description", robot.description)):
        if Path(file).is_absolute():
            message = f"'{key}' is an absolute path, which workers do not have: '{escape(file)}'"
            raise InvalidInput([Diagnostic("USE193", message, hint="write it relative to the file that names it")])
    meshes = mesh_files(written.task)
    task = _plain(path)
    named = [task, *(p for p in opened if p.suffix not in _PROGRAM and not _of_program(p)), *meshes.values()]
    links: dict[str, str] = {}
    files = {}
    contents = {}
    for name in dict.fromkeys(map(_plain, named)):
        real = _followed(name, links)
        if real.is_file():
            data = real.read_bytes()
            key = hashlib.sha256(data).hexdigest()
            contents[key], files[str(real)] = data, key
    marks = []
    for folder in {folder for file in files for folder in Path(file).parents[:_LEVELS]}:
        for mark in (*MARKS, PYTHON):
            if (folder / mark).exists() and str(folder / mark) not in files:
                if mark == PACKAGE:
                    data = (folder / mark).read_bytes()
                    contents[hashlib.sha256(data).hexdigest()] = data
                    files[str(folder / mark)] = hashlib.sha256(data).hexdigest()
                else:
                    marks.append(str(folder / mark))
    packages = [str(Path(os.path.realpath(folder))) for folder in written.options.get("package_path", ())]
    packages += sorted(set(_package_folders(meshes)))
    return Bundle(contents, files, links, tuple(sorted(marks)), str(task), tuple(packages))


def _package_folders(meshes: Mapping[str, Path]) -> Iterator[str]:
    """The folders that hold the packages of `package://NAME/a/b.stl`."""
    for uri, path in meshes.items():
        name, _, rest = uri.removeprefix(_PACKAGE_URI).partition("/")
        root = Path(str(path).removesuffix(f"/{rest}"))
        if uri.startswith(_PACKAGE_URI) and root.name == name:
            yield str(root.parent)


def _of_program(path: Path) -> bool:
    """Whether a file is part of manipcli or of the system, which the worker has."""
    own = Path(__file__).parents[1]
    return path.is_relative_to(own) or path.is_relative_to("/proc") or path.is_relative_to(Path(sys.prefix) / "bin")


def _plain(path: Path) -> Path:
    """The absolute path without `..`, as tasks are loaded."""
    return Path(os.path.normpath(path.absolute()))


def _followed(path: Path, links: dict[str, str]) -> Path:
    """The file with links followed; each folder or file that is a link is noted."""
    place = Path(path.anchor)
    for part in path.parts[1:]:
        place /= part
        if place.is_symlink():
            real = Path(os.path.realpath(place))
            links[str(place)] = str(real)
            place = real
    return place
