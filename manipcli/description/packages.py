"""Where the files that a description names are found: `package://`, `model://`, `file://` and relative paths.

A description is untrusted data: what it names must be a regular file inside the folder tree of the description or
inside the root of a package that was asked for by name. Links are followed before that is judged.
"""

from __future__ import annotations

import difflib
import importlib.util
import os
import pkgutil
import re
import stat
from collections import deque
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from urllib.parse import unquote

from manipcli.core.text import any_of, nearest, nearest_file
from manipcli.description.located_xml import shown_path

LEVELS_ABOVE = 5
"""How many folders above a description are looked at for a folder of a package's name."""
ALIKE = 0.85
"""Likeness from which on a package was meant: among all that is installed, less finds any name."""
SUBFOLDERS = frozenset({"urdf", "xacro", "robots", "robot", "description", "cfg"})
"""A description in such a folder belongs to the folder above it."""
MOST_BYTES = 65_536
LEVELS_BELOW = 4
MOST_FOLDERS = 5_000
_NAME = re.compile(rb"<name>\s*([^<>\s]{1,200})\s*</name>")
_IGNORED = ("CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE", "rospack_nosubdirs")


class NotFound(Exception):
    """A file or package that cannot be used; the caller, who knows the place, makes a finding of it."""

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        self.message = message
        self.hint = hint
        super().__init__(message)


class Absent(NotFound):
    """A file that is not there, where it could be read."""


class Outside(NotFound):
    """A file that is there and must not be read: it lies outside of the folders that belong to the description."""


class RemoteFile(NotFound):
    """An address that only a network could answer."""


def own_root(description: Path) -> Path | None:
    """The folder tree a description belongs to: its ROS package, else the folder above `urdf/`, else its own folder.

    None where that is a folder of everything: see `_of_everything`.
    """
    folder = Path(os.path.realpath(description)).parent
    for ancestor in (folder, *list(folder.parents)[:LEVELS_ABOVE]):
        if (ancestor / "package.xml").is_file() and not _of_everything(ancestor):
            return ancestor
    above = [folder.parent] if folder.name in SUBFOLDERS else []
    return next((each for each in (*above, folder) if not _of_everything(each)), None)


def _of_everything(folder: Path) -> bool:
    """A folder that holds more than one robot: the home folder or one above it, `/`, or one like /tmp."""
    home = _home()
    if folder == folder.parent or (home is not None and home.is_relative_to(folder)):
        return True
    try:
        # Both: file systems without modes, as a mounted Windows disk, let everybody write everywhere.
        both = stat.S_ISVTX | stat.S_IWOTH
        return folder.stat().st_mode & both == both
    except OSError:
        return False


def _home() -> Path | None:
    """The user's folder; None where the system knows of none, as in some containers."""
    try:
        return Path(os.path.realpath(Path.home()))
    except RuntimeError:
        return None


class Packages:
    """Finds packages and files for one description.

    Args:
        description: the file that names things; None looks only at `package_path` and what is installed.
        package_path: folders that hold packages (or are one), looked at first.
        allow_outside: lets a file lie anywhere.

    Attributes:
        reads: whether the files that are named are there to be read.
    """

    reads = True

    def __init__(
        self, description: Path | None, *, package_path: Sequence[Path] = (), allow_outside: bool = False
    ) -> None:
        self._package_path = tuple(Path(os.path.realpath(folder)) for folder in package_path)
        self._allow_outside = allow_outside
        self._folder = Path(os.path.realpath(description)).parent if description is not None else None
        self._own = own_root(description) if description is not None else None
        self._found: dict[str, Path] = {}
        self._below: dict[str, Path] | None = None
        self._meant: dict[Path, str | None] = {}

    def root(self, name: str) -> Path:
        """The folder of package `name`.

        Raises:
            NotFound: with the places that were searched.
        """
        if name in self._found:
            return self._found[name]
        if not name or name.startswith(".") or any(character in name for character in "/\\\0"):
            raise NotFound(
                f"'{name}' cannot be the name of a package", hint="write package://NAME/path or $(find NAME)"
            )
        searched = self._candidates(name)
        found = next((folder for folder in searched if folder.is_dir()), None)
        found = found or self._crawled(name) or _installed_package(name)
        if found is not None:
            self._found[name] = found.resolve()
            return self._found[name]
        places = ", ".join(shown_path(place) for place in searched)
        near = difflib.get_close_matches(name, [*(self._below or ()), *_installed_names()], n=1, cutoff=ALIKE)
        meant = f"did you mean {any_of(near)}? else " if near else ""
        raise NotFound(
            f"package '{name}' is not found; searched {places or 'nowhere'}, and the installed Python packages",
            hint=f"{meant}add the folder that holds '{name}' with --package-path DIR",
        )

    def _candidates(self, name: str) -> list[Path]:
        places: list[Path] = []
        for folder in self._package_path:
            places += [folder] if folder.name == name else []
            places.append(folder / name)
        if self._folder is not None:
            home = _home()
            for ancestor in (self._folder, *list(self._folder.parents)[:LEVELS_ABOVE]):
                if ancestor in (ancestor.parent, home):
                    break
                places += [ancestor] if name in (ancestor.name, package_name(ancestor)) else []
                places.append(ancestor / name)
        for variable, below in (("ROS_PACKAGE_PATH", ""), ("AMENT_PREFIX_PATH", "share")):
            places += [Path(part) / below / name for part in os.environ.get(variable, "").split(os.pathsep) if part]
        return list(dict.fromkeys(places))

    def _crawled(self, name: str) -> Path | None:
        """The package whose `package.xml` has this name, in a folder that is called otherwise."""
        if self._below is None:
            given = [Path(part) for part in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if part]
            self._below = {}
            for folder in (*self._package_path, *given):
                self._below = packages_below(folder) | self._below
        return self._below.get(name)

    def below(self, description: Path) -> Packages:
        """For what a file that was found here names in its turn: the same places and rules, seen from it."""
        return Packages(description, package_path=self._package_path, allow_outside=self._allow_outside)

    def resolve(self, uri: str, *, relative_to: Path | None = None, anywhere: bool = False) -> Path:
        """The regular file that `uri` names, links followed; relative paths start at the folder `relative_to`.

        Args:
            anywhere: the user himself wrote this name, so that the file may lie where he says.

        Raises:
            NotFound: unknown scheme or package, no such file, not a regular file, or outside of the allowed folders.
        """
        scheme, separator, rest = uri.partition("://")
        roots = [root for root in (self._own, *self._package_path, *self._found.values()) if root is not None]
        if separator and scheme in {"package", "model"}:
            name, _, inside = unquote(rest).partition("/")
            root = self.root(name)
            path, roots = root / inside.lstrip("/"), [root]
        elif separator and scheme == "file":
            path = Path("/" + unquote(rest.removeprefix("localhost")).lstrip("/"))
        elif separator:
            hint = "copy the file into the package; use package://NAME/path or a relative path"
            raise RemoteFile(f"'{uri[:100]}': nothing is fetched, and scheme '{scheme[:20]}' is not read", hint=hint)
        elif uri[:5].lower() == "data:":
            raise RemoteFile(f"'{uri[:20]}...': data in an address is not read", hint="write it into a file")
        else:
            path = Path(uri)
        if "\0" in str(path):
            raise NotFound("a file name holds a NUL character")
        if not path.is_absolute():
            path = (relative_to or self._folder or Path.cwd()) / path
        return self._checked(path, uri, roots, self._allow_outside or anywhere)

    def _checked(self, path: Path, uri: str, roots: Sequence[Path], anywhere: bool) -> Path:
        def inside(real: Path) -> bool:
            within = any(real.is_relative_to(root) for root in roots) or self._beside(real)
            return anywhere or within or _of_the_same_package(real, roots)

        try:
            real = path.resolve(strict=True)
        except (OSError, RuntimeError) as error:
            if os.path.islink(path):  # noqa: PTH114  (Path.is_symlink raises where a name is too long)
                message, near = f"'{uri}' is a link that leads to no file", False
            else:
                message, near = f"'{uri}' is not found; searched {shown_path(path)}", True
            if inside(Path(os.path.realpath(path))):
                raise Absent(message, hint=self._near(path) if near else None) from error
            raise NotFound(message) from error
        if not inside(real):
            hint = "move it into the package, add its folder with --package-path DIR, or pass --allow-outside"
            raise Outside(f"'{uri}' lies outside of the description's folder and packages", hint=hint)
        if not real.is_file():
            raise NotFound(f"'{uri}' is not a regular file")
        return real

    def _near(self, path: Path) -> str | None:
        """`_meant`, once a path: many checks ask for the same absent file."""
        if path not in self._meant:
            self._meant[path] = _meant(path)
        return self._meant[path]

    def _beside(self, real: Path) -> bool:
        """In a folder of everything: whether a file lies below it without being hidden, as `~/meshes/arm.stl` does."""
        if self._own is not None or self._folder is None or not real.is_relative_to(self._folder):
            return False
        return not any(part.startswith(".") for part in real.relative_to(self._folder).parts)

    def portable(self, path: Path) -> str:
        """A `package://NAME/...` URI of a resolved file that says nothing about this machine.

        NAME is the outermost Python package or nearest ROS package that holds the file, else a package found by name,
        else the description's own folder, else the folder beside it that holds the file, else the file's folder.
        """
        for ancestor in path.parents:
            if (ancestor / "package.xml").is_file():
                return _uri(ancestor, path)
            if (ancestor / "__init__.py").is_file() and not (ancestor.parent / "__init__.py").is_file():
                return _uri(ancestor, path)
        for root in (self._own, *self._found.values(), *self._package_path):
            if root is not None and path.is_relative_to(root):
                return _uri(root, path)
        for above in self._own.parents if self._own is not None else ():
            if _of_everything(above):
                break
            if path.is_relative_to(above):
                return _uri(above / path.relative_to(above).parts[0], path)
        return _uri(path.parent, path)


class Unread(Packages):
    """For a description whose files nobody will read, as that in a log: every name stands for itself."""

    reads = False

    def __init__(self) -> None:
        super().__init__(None)
        self._written: dict[Path, str] = {}

    def resolve(self, uri: str, *, relative_to: Path | None = None, anywhere: bool = False) -> Path:
        # A path has no place for the two slashes of `package://`: how it was written is kept beside it.
        path = Path(uri)
        self._written[path] = uri
        return path

    def portable(self, path: Path) -> str:
        return self._written[path]


def _uri(root: Path, path: Path) -> str:
    return f"package://{root.name}/{path.relative_to(root).as_posix()}"


def _of_the_same_package(real: Path, roots: Sequence[Path]) -> bool:
    """In the source of a package that is installed as links to it: `colcon build --symlink-install`."""
    names = {package_name(root) for root in roots} - {None}
    return bool(names) and any(package_name(folder) in names for folder in list(real.parents)[:LEVELS_ABOVE])


def _meant(path: Path) -> str | None:
    """The file beside it with nearly this name."""
    try:
        known = sorted(entry.name for entry in path.parent.iterdir() if not _of_another_part(path.name, entry.name))
    except OSError:
        return None
    near = nearest_file(path.name, known)
    return f"did you mean {any_of(near)}?" if near else None


def _of_another_part(name: str, other: str) -> bool:
    """Files are called after parts: `link6` is not `link7`, and `laser_link` is no `wheel_link` for its last word."""
    mine, others = (re.split(r"[_-]", Path(each).stem) for each in (name, other))
    while len(mine) > 1 and len(others) > 1 and mine[-1] == others[-1]:
        mine.pop()
        others.pop()
    numbered = (re.sub(r"\D", "", each) for each in (name, other))
    return len(set(numbered)) > 1 or not nearest("_".join(mine), ["_".join(others)])


@cache
def _installed_names() -> tuple[str, ...]:
    """Of all Python packages, without importing them."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules() if module.ispkg))


def _installed_package(name: str) -> Path | None:
    """The folder of an installed Python package, without importing it."""
    if not name.isidentifier():
        return None
    try:
        spec = importlib.util.find_spec(name)
    except (ImportError, ValueError):
        return None
    places = list(spec.submodule_search_locations or ()) if spec is not None else []
    return Path(places[0]).resolve() if places and Path(places[0]).is_dir() else None


def package_name(folder: Path) -> str | None:
    """The `<name>` of the package in this very folder, if there is one."""
    file = folder / "package.xml"
    try:
        if not file.is_file():
            return None
        with file.open("rb") as stream:
            found = _NAME.search(stream.read(MOST_BYTES))
    except OSError:
        return None
    return found[1].decode("utf-8", "replace") if found else None


def packages_below(folder: Path) -> dict[str, Path]:
    """The packages at or below a folder by name, the nearest of each, as rospack crawls.

    Packages hold no packages; hidden folders and those that a build tool is told to ignore are left out.
    """
    found: dict[str, Path] = {}
    for each in _packages_below(folder):
        found.setdefault(package_name(each) or each.name, each)
    return found


def _packages_below(folder: Path) -> Iterator[Path]:
    waiting = deque([(folder, 0)])
    seen = 0
    while waiting and seen < MOST_FOLDERS:
        current, depth = waiting.popleft()
        seen += 1
        if (current / "package.xml").is_file():
            yield current
            continue
        try:
            with os.scandir(current) as entries:
                inside = sorted(entries, key=lambda entry: entry.name)
            if depth < LEVELS_BELOW and not any(entry.name in _IGNORED for entry in inside):
                below = [entry for entry in inside if not entry.name.startswith(".") and entry.is_dir()]
                waiting.extend((Path(entry.path), depth + 1) for entry in below)
        except OSError:
            continue
