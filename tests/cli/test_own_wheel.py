"""The wheel of the running manipcli: the same files, with a valid record; and the addresses that replace it."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import json
import subprocess
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

from manipcli.cli import own_wheel


class _Installed:
    """A distribution with these texts."""

    def __init__(self, **texts: str) -> None:
        self._texts = {"METADATA": "Metadata-Version: 2.1\nName: manipcli\nVersion: 0.1.0\n", **texts}

    def read_text(self, filename: str) -> str | None:
        return self._texts.get(filename.removesuffix(".json"))


def installed(monkeypatch: pytest.MonkeyPatch, **texts: str) -> own_wheel.Installation:
    monkeypatch.setattr(metadata, "distribution", lambda _: _Installed(**texts))
    found = own_wheel.installation()
    assert found is not None
    return found


def test_the_wheel_has_all_files_and_their_digests(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")  # without git, which would leave out what is not committed yet
    first = installed(monkeypatch, direct_url=json.dumps({"url": "file:///home/me/manipcli"}))
    assert first == installed(monkeypatch)  # the same bytes
    assert first.wheel is not None
    assert first.requirement == f"./{first.wheel[0]}"
    with zipfile.ZipFile(io.BytesIO(first.wheel[1])) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    own = {f"manipcli/{path.relative_to(own_wheel.PACKAGE)}" for path in own_wheel.PACKAGE.rglob("*.py")}
    assert own <= files.keys()
    assert "manipcli/docs/reference/task.md" in files and "manipcli/docs/reference/codes/TASK203.md" not in files
    (record,) = [name for name in files if name.endswith("/RECORD")]
    rows = {name: (digest, size) for name, digest, size in csv.reader(io.StringIO(files[record].decode()))}
    assert rows.keys() == files.keys()
    for name, data in files.items():
        if name != record:
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            assert rows[name] == (f"sha256={digest}", str(len(data)))


@pytest.mark.parametrize(
    ("stated", "requirement"),
    [
        (
            {"url": "https://h.example/m.git", "vcs_info": {"vcs": "git", "commit_id": "abc"}},
            "manipcli @ git+https://h.example/m.git@abc",
        ),
        ({"url": "https://h.example/m.whl", "archive_info": {}}, "manipcli @ https://h.example/m.whl"),
        (
            {
                "url": "ssh://git@h.example/all.git",
                "vcs_info": {"vcs": "git", "commit_id": "abc"},
                "subdirectory": "tools/m",
            },
            "manipcli @ git+ssh://git@h.example/all.git@abc#subdirectory=tools/m",
        ),
    ],
)
def test_an_address_on_the_network_needs_no_wheel(
    monkeypatch: pytest.MonkeyPatch, stated: dict[str, object], requirement: str
) -> None:
    assert installed(monkeypatch, direct_url=json.dumps(stated)) == own_wheel.Installation(requirement)


@pytest.mark.parametrize(
    "url",
    [
        "https://SECRET@h.example/m.git",
        "https://me:SECRET@h.example/m.git",
        "https://h.example/m.git?private_token=SECRET",
        "https://h.example/m.git#SECRET",
        "ssh://git:SECRET@h.example/m.git",
        "https://[SECRET",
    ],
)
@pytest.mark.parametrize("version", [{"vcs_info": {"vcs": "git", "commit_id": "abc"}}, {"archive_info": {}}])
def test_a_secret_of_an_address_gets_nowhere(
    monkeypatch: pytest.MonkeyPatch, url: str, version: dict[str, object]
) -> None:
    found = installed(monkeypatch, direct_url=json.dumps({"url": url, **version}))
    assert found.wheel is not None
    assert "SECRET" not in found.requirement
    assert b"SECRET" not in found.wheel[1]


def test_the_wheel_has_its_licence_and_the_version_of_its_files(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(own_wheel, "__version__", "7.8.9")
    found = installed(monkeypatch, **{"licenses/LICENSE": "free"})
    assert found.wheel is not None
    assert "7.8.9" in found.requirement
    with zipfile.ZipFile(io.BytesIO(found.wheel[1])) as archive:
        assert b"\nVersion: 7.8.9\n" in archive.read("manipcli-7.8.9.dist-info/METADATA")
        assert archive.read("manipcli-7.8.9.dist-info/licenses/LICENSE") == b"free"


def test_an_untracked_file_of_a_checkout_stays_out(tmp_path: Path) -> None:
    for name in ("tracked.py", "own_notes.txt"):
        (tmp_path / name).write_text("x")
    assert {path.name for path in own_wheel._files(tmp_path)} == {"tracked.py", "own_notes.txt"}  # an installed package
    for words in (["init", "-q"], ["add", "tracked.py"]):
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    assert {path.name for path in own_wheel._files(tmp_path)} == {"tracked.py"}
