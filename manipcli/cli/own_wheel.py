"""What `pip install` needs to install this manipcli elsewhere: an address if it came from one, else a wheel of itself.

manipcli is on no package index. Installers record where a distribution came from (PEP 610, `direct_url.json`). If that
is an address on the network, another machine can use it; if not, the installed files are packed into a wheel, which
goes into the user's repository. It has no compiled kernels: the laws in Python give the same bits.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
import subprocess
import zipfile
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from manipcli.core.version import __version__
from manipcli.report.doc_pages import doc_files

PACKAGE: Final = Path(__file__).parents[1]
FOLDER: Final = "vendor"
"""Folder of the wheel in a project."""
LEFT_OUT: Final = (".so", ".dylib", ".dll", ".pyc")
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)
"""Time of all files in the wheel: the same contents give the same bytes."""


@dataclass(frozen=True, slots=True)
class Installation:
    """`requirement` for pip in the folder of a project, and the wheel that it names: (path, contents), or None."""

    requirement: str
    wheel: tuple[str, bytes] | None = None


def installation() -> Installation | None:
    """How another machine installs this version; None where manipcli runs without being installed."""
    try:
        own = metadata.distribution("manipcli")
    except metadata.PackageNotFoundError:
        return None
    address = _address(own.read_text("direct_url.json"))
    if address is not None:
        return Installation(f"manipcli @ {address}")
    name = f"manipcli-{__version__}-py3-none-any.whl"
    return Installation(f"./{FOLDER}/{name}", (f"{FOLDER}/{name}", _wheel(own)))


def _address(text: str | None) -> str | None:
    """The address on the network in `direct_url.json`, as pip reads it; None for a folder of this machine.

    None, too, for an address with a name, a password or a query, which could be a secret: it must not get into a
    repository, and is of no use without.
    """
    try:
        stated = json.loads(text or "{}")
        url, version = str(stated.get("url", "")), stated.get("vcs_info") or {}
        parts = urlsplit(url)
        public = parts.scheme in ("http", "https") and parts.username is None
        public |= parts.scheme in ("ssh", "git") and parts.username in (None, "git") and parts.password is None
        if not public or parts.query or parts.fragment or (parts.scheme in ("ssh", "git") and not version):
            return None
        address = f"{version['vcs']}+{url}@{version['commit_id']}" if version else url
        folder = stated.get("subdirectory")
        return f"{address}#subdirectory={folder}" if folder else address
    except (ValueError, KeyError, AttributeError, TypeError):
        return None


def _files(folder: Path) -> list[Path]:
    """The files below a folder; where it is in a checkout, those that git tracks, so that no other file gets out."""
    try:
        command = ["git", "-c", "core.fsmonitor=", "ls-files", "-z"]
        listed = subprocess.run(command, cwd=folder, capture_output=True, check=False).stdout
        tracked = [folder / name for name in listed.decode("utf-8", "surrogateescape").split("\0") if name]
    except OSError:
        tracked = []
    return sorted(path for path in tracked or folder.rglob("*") if path.is_file())


def _wheel(own: metadata.Distribution) -> bytes:
    """The wheel of the installed package (PEP 427), with the version of its files whatever was installed before."""
    info = f"manipcli-{__version__}.dist-info"
    files = {
        f"manipcli/{path.relative_to(PACKAGE).as_posix()}": path.read_bytes()
        for path in _files(PACKAGE)
        if path.suffix not in LEFT_OUT and "__pycache__" not in path.parts
    }
    pages = set(_files(PACKAGE.parent / "docs"))
    files |= {f"manipcli/docs/{name}": path.read_bytes() for name, path in doc_files().items() if path in pages}
    for name in ("METADATA", "entry_points.txt", "licenses/LICENSE"):
        text = own.read_text(name)
        if text is not None:
            version = re.sub(r"(?m)^Version: .*$", f"Version: {__version__}", text, count=1)
            files[f"{info}/{name}"] = (version if name == "METADATA" else text).encode()
    files[f"{info}/WHEEL"] = b"Wheel-Version: 1.0\nGenerator: manipcli\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    record = "".join(f"{name},sha256={_digest(data)},{len(data)}\n" for name, data in files.items())
    files[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, data)
    return buffer.getvalue()


def _digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
