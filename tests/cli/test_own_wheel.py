"""The wheel of the running manipcli: the same files, with a valid record; and the addresses that replace it."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import json
import zipfile
from importlib import metadata

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
    first = installed(monkeypatch, direct_url=json.dumps({"url": "file:///home/me/manipcli"}))
    assert first == installed(monkeypatch)  # the same bytes
    assert first.wheel is not None
    assert first.requirement == f"./{first.wheel[0]}"
    with zipfile.ZipFile(io.BytesIO(first.wheel[1])) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    own = {f"manipcli/{path.relative_to(own_wheel.PACKAGE)}" for path in own_wheel.PACKAGE.rglob("*.py")}
    assert own <= files.keys()
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
    ],
)
def test_an_address_on_the_network_needs_no_wheel(
    monkeypatch: pytest.MonkeyPatch, stated: dict[str, object], requirement: str
) -> None:
    assert installed(monkeypatch, direct_url=json.dumps(stated)) == own_wheel.Installation(requirement)
