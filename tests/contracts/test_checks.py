"""Every check fires on its own bad example and on nothing else; none finds an error in the robots of this project."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from manipcli.description.lint.check import Check
from manipcli.description.lint.checks import CHECKS
from manipcli.description.lint.examine import Examination, examine
from manipcli.description.packages import Packages
from manipcli.spec.load import load_robot

ROOT = Path(__file__).parents[2]
DESCRIPTION = ROOT / "manipcli" / "description"
CODE = re.compile(r"\b(?:URDF|XACRO)\d{3}\b")
ROBOTS = sorted((ROOT / "robots").glob("*/robot.yaml"))
WRITTEN_LATER = {"URDF040", "URDF041"}
"""Told when a description is written for an engine, not when it is read."""


def examined(folder: Path, check: Check) -> Examination:
    kind = "xacro" if "xmlns:xacro" in check.bad else "urdf"
    path = folder / f"bad.{kind}"
    path.write_text(check.bad, encoding="utf-8")
    for name, data in check.files().items():
        (folder / name).write_bytes(data)
    return examine(path, packages=Packages(path))


@pytest.mark.slow
@pytest.mark.parametrize("check", CHECKS.members, ids=lambda check: check.code)
def test_a_check_fires_on_its_bad_example_and_nothing_else_is_an_error(tmp_path: Path, check: Check) -> None:
    found = examined(tmp_path, check)
    told = [str(finding) for finding in found.findings]
    own = [finding for finding in found.findings if finding.code == check.code]
    assert own, told
    assert check.severity in {finding.severity for finding in own}, told
    assert {finding.code for finding in found.errors} <= {check.code}, told
    assert all(finding.place is not None for finding in own), told
    assert not any("failed with an internal error" in finding.message for finding in found.findings), told


def test_codes_and_names_are_unique_and_every_member_explains_itself() -> None:
    assert len({check.code for check in CHECKS}) == len(CHECKS.members)
    assert len(set(CHECKS.names)) == len(CHECKS.members)
    for check in CHECKS:
        assert CODE.fullmatch(check.code)
        assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", check.name)
        assert check.summary and not check.summary.endswith(".")
        assert check.reason.endswith(".")


def test_every_code_that_can_be_told_is_a_check() -> None:
    used = {code for path in DESCRIPTION.rglob("*.py") for code in CODE.findall(path.read_text(encoding="utf-8"))}
    assert used - WRITTEN_LATER <= {check.code for check in CHECKS}


def test_every_check_of_every_file_is_registered() -> None:
    written = "".join(path.read_text(encoding="utf-8") for path in (DESCRIPTION / "lint" / "checks").glob("*.py"))
    codes = re.findall(r'check\(\s*"((?:URDF|XACRO)\d{3})"', written)
    assert sorted(codes) == sorted(check.code for check in CHECKS)


@pytest.mark.slow
@pytest.mark.parametrize("file", ROBOTS, ids=lambda path: path.parent.name)
def test_no_check_finds_an_error_in_the_robots_of_this_project(file: Path) -> None:
    spec = load_robot(file).spec
    uris = [(spec.description, spec.args), *((each.description, each.args) for each in spec.attach)]
    for uri, arguments in uris:
        path = Packages(file, allow_outside=True).resolve(uri, relative_to=file.parent)
        found = examine(path, packages=Packages(path), arguments=arguments)
        assert [str(finding) for finding in found.errors] == []
