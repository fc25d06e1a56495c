"""Resolution of the URIs in a description: `package://`, `model://`, `file://` and relative paths.

A description is untrusted data: a URI must resolve to a regular file inside the folder tree of the description or
inside the root of the named package, after symbolic links are resolved.
"""

from __future__ import annotations

import difflib
import importlib.util
import os
import pkgutil
import re
import stat
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from urllib.parse import unquote

from manipcli.core.text import any_of, nearest, nearest_file
from manipcli.description.located_xml import shown_path

LEVELS_ABOVE = 5
"""Number of folders above a description that are searched for a package."""
ALIKE = 0.85
"""Least similarity of a suggested package name; with less, any name matches some installed package."""
SUBFOLDERS = frozenset({"urdf", "xacro", "robots", "robot", "description", "cfg"})
"""A description in such a folder belongs to the parent folder."""
MOST_BYTES = 65_536
LEVELS_BELOW = 4
MOST_FOLDERS = 5_000
_NAME = re.compile(rb"<name>\s*([^<>\s]{1,200})\s*</name>")
_IGNORED = ("CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE", "rospack_nosubdirs")


class NotFound(Exception):
    """A file or package that cannot be used; the caller, which knows the place, turns it into a finding."""

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        self.message = message
        self.hint = hint
        super().__init__(message)


class Absent(NotFound):
    """A missing file in a permitted folder."""


class Outside(NotFound):
    """An existing file that must not be read: it is outside the folders of the description."""


class RemoteFile(NotFound):
    """A URI that needs the network."""


def own_root(description: Path) -> Path | None:
    """Root of the folder tree of a description: its ROS package, else the folder above `urdf/`, else its own folder.

    None for a shared folder, see `is_shared`.
    """
    folder = Path(os.path.realpath(description)).parent
    for ancestor in (folder, *list(folder.parents)[:LEVELS_ABOVE]):
        if (ancestor / "package.xml").is_file() and not is_shared(ancestor):
            return ancestor
    above = [folder.parent] if folder.name in SUBFOLDERS else []
    return next((candidate for candidate in (*above, folder) if not is_shared(candidate)), None)


def is_shared(folder: Path) -> bool:
    """Whether a folder holds unrelated files: the home folder or one above it, `/`, or one like /tmp."""
    home = _home()
    if folder == folder.parent or (home is not None and home.is_relative_to(folder)):
        return True
    try:
        # Both bits: on file systems without modes, such as a mounted Windows disk, all folders are world-writable.
        both = stat.S_ISVTX | stat.S_IWOTH
        return folder.stat().st_mode & both == both
    except OSError:
        return False


def _home() -> Path | None:
    """The user's home folder; None if there is none, as in some containers."""
    try:
        return Path(os.path.realpath(Path.home()))
    except RuntimeError:
        return None


class Packages:
    """Finds packages and files for one description.

    Args:
        description: the file with the URIs; None searches only `package_path` and installed packages.
        package_path: folders that contain packages (or are one), searched first.
        allow_outside: permits files anywhere.
        named: folders of packages by name, before all others.

    Attributes:
        reads: whether the named files can be read.
    """

    reads = True

    def __init__(
        self,
        description: Path | None,
        *,
        package_path: Sequence[Path] = (),
        allow_outside: bool = False,
        named: Mapping[str, Path] = {},
    ) -> None:
        self._package_path = tuple(Path(os.path.realpath(folder)) for folder in package_path)
        self._allow_outside = allow_outside
        self._folder = Path(os.path.realpath(description)).parent if description is not None else None
        self._own = own_root(description) if description is not None else None
        self._named = {name: Path(os.path.realpath(folder)) for name, folder in named.items()}
        self._found = dict(self._named)
        self._below: dict[str, Path] | None = None
        self._meant: dict[Path, str | None] = {}

    @property
    def found(self) -> Mapping[str, Path]:
        """The packages that were asked for so far, by name."""
        return dict(self._found)

    def root(self, name: str) -> Path:
        """The folder of package `name`.

        Raises:
            NotFound: with the places that were searched.
        """
        if name in self._found:
            return self._found[name]
        if not name or name.startswith(".") or any(character in name for character in "/\\\0"):
            raise NotFound(f"'{name}' is not a valid package name", hint="write package://NAME/path or $(find NAME)")
        searched = self._candidates(name)
        found = next((folder for folder in searched if folder.is_dir()), None)
        found = found or self._crawled(name) or _installed_package(name)
        if found is not None:
            self._found[name] = found.resolve()
            return self._found[name]
        places = ", ".join(shown_path(place) for place in searched)
        near = difflib.get_close_matches(name, [*(self._below or ()), *_installed_names()], n=1, cutoff=ALIKE)
        meant = f"did you mean {any_of(near)}? Otherwise " if near else ""
        raise NotFound(
            f"package '{name}' is not found; searched {places or 'nowhere'}, and the installed Python packages",
            hint=f"{meant}add the folder that contains '{name}' with --package-path DIR, "
            f"or to the robot file: packages: {{{name}: FOLDER}}",
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
        """The package whose `package.xml` has this name, in a folder with another name."""
        if self._below is None:
            given = [Path(part) for part in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if part]
            self._below = {}
            for folder in (*self._package_path, *given):
                self._below = packages_below(folder) | self._below
        return self._below.get(name)

    def found_by_name(self, uri: str) -> bool:
        """Whether a `file://` URI is in a package that was found by its name, as `file://$(find NAME)/...` gives it."""
        path = Path("/" + unquote(uri.removeprefix("file://").removeprefix("localhost")).lstrip("/"))
        return any(path.is_relative_to(root) for root in self._found.values())

    def below(self, description: Path) -> Packages:
        """For the URIs in a file that was found here: the same search path and rules, relative to that file."""
        return Packages(
            description, package_path=self._package_path, allow_outside=self._allow_outside, named=self._named
        )

    def resolve(self, uri: str, *, relative_to: Path | None = None, anywhere: bool = False) -> Path:
        """The regular file that `uri` names, symbolic links resolved; relative paths start at the folder `relative_to`.

        Args:
            anywhere: permits any folder, for a URI that the user wrote.

        Raises:
            NotFound: unknown scheme or package, missing file, not a regular file, or outside the permitted folders.
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
            raise RemoteFile(f"'{uri[:100]}': scheme '{scheme[:20]}' is not supported", hint=hint)
        elif uri[:5].lower() == "data:":
            raise RemoteFile(f"'{uri[:20]}...': data URIs are not supported", hint="write the data into a file")
        else:
            path = Path(uri)
        if "\0" in str(path):
            raise NotFound("a file name contains a NUL character")
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
                message, near = f"'{uri}' is a broken symbolic link", False
            else:
                where = shown_path(path)
                message, near = f"'{uri}' is not found{f'; searched {where}' if where != uri else ''}", True
            if inside(Path(os.path.realpath(path))):
                raise Absent(message, hint=self._near(path) if near else None) from error
            raise NotFound(message) from error
        if not inside(real):
            hint = "move it into the package, add its folder with --package-path DIR, or pass --allow-outside"
            raise Outside(f"'{uri}' is outside the description's folder and packages", hint=hint)
        if not real.is_file():
            raise NotFound(f"'{uri}' is not a regular file")
        return real

    def _near(self, path: Path) -> str | None:
        """`_meant`, cached: several checks resolve the same missing file."""
        if path not in self._meant:
            self._meant[path] = _meant(path)
        return self._meant[path]

    def _beside(self, real: Path) -> bool:
        """For a description in a shared folder: whether a file is below it and not hidden, like `~/meshes/arm.stl`."""
        if self._own is not None or self._folder is None or not real.is_relative_to(self._folder):
            return False
        return not any(part.startswith(".") for part in real.relative_to(self._folder).parts)

    def portable(self, path: Path) -> str:
        """A `package://NAME/...` URI of a resolved file, independent of this machine.

        NAME is the outermost Python package or nearest ROS package that contains the file, else a package found by
        name, else the description's root, else the folder beside it that contains the file, else the file's folder.
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
            if is_shared(above):
                break
            if path.is_relative_to(above):
                return _uri(above / path.relative_to(above).parts[0], path)
        return _uri(path.parent, path)


class Unread(Packages):
    """For a description whose files are never read, as in a log: URIs are kept as they are."""

    reads = False

    def __init__(self) -> None:
        super().__init__(None)
        self._written: dict[Path, str] = {}

    def resolve(self, uri: str, *, relative_to: Path | None = None, anywhere: bool = False) -> Path:
        # A Path drops one slash of `package://`, so the URI is stored, too.
        path = Path(uri)
        self._written[path] = uri
        return path

    def portable(self, path: Path) -> str:
        return self._written[path]


def _uri(root: Path, path: Path) -> str:
    return f"package://{root.name}/{path.relative_to(root).as_posix()}"


def _of_the_same_package(real: Path, roots: Sequence[Path]) -> bool:
    """Whether a file is in the source of a package installed by symbolic links (`colcon build --symlink-install`)."""
    names = {package_name(root) for root in roots} - {None}
    return bool(names) and any(package_name(folder) in names for folder in list(real.parents)[:LEVELS_ABOVE])


def _meant(path: Path) -> str | None:
    """The hint with a file in the same folder and with a similar name."""
    try:
        known = sorted(entry.name for entry in path.parent.iterdir() if not _of_another_part(path.name, entry.name))
    except OSError:
        return None
    near = nearest_file(path.name, known)
    return f"did you mean {any_of(near)}?" if near else None


def _of_another_part(name: str, other: str) -> bool:
    """Whether two file names refer to different parts: `link6` and `link7`, or `laser_link` and `wheel_link`."""
    mine, others = (re.split(r"[_-]", Path(each).stem) for each in (name, other))
    while len(mine) > 1 and len(others) > 1 and mine[-1] == others[-1]:
        mine.pop()
        others.pop()
    numbered = (re.sub(r"\D", "", each) for each in (name, other))
    return len(set(numbered)) > 1 or not nearest("_".join(mine), ["_".join(others)])


@cache
def _installed_names() -> tuple[str, ...]:
    """Names of all installed Python packages, without importing them."""
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
    """The `<name>` in the folder's `package.xml`, if there is one."""
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
    """The packages at or below a folder by name, the nearest of each name, as rospack searches.

    Packages are not nested; hidden folders and those marked to be ignored by build tools are skipped.
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
