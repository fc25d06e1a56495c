"""The examples of SRDFs: the faulty one gets its code, the sound one none."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.description.srdf import read_srdf
from manipcli.onboard.from_srdf import stated_parts
from manipcli.pipeline import load_sight
from manipcli.report.codes.code_page import CodePage, code_pages
from tests.report.codes.test_code_pages import ARM

PAGES = [page for page in code_pages().values() if page.kind == "srdf"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.code)
def test_the_faulty_srdf_gets_the_code_and_the_sound_one_none(page: CodePage, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    file = tmp_path / "arm.srdf"
    robot = load_sight(tmp_path / "arm.urdf").robot
    found: list[set[str]] = []
    for text in (page.bad, page.good):
        file.write_text(text)
        try:
            stated_parts(robot, read_srdf(file))
            found.append(set())
        except InvalidInput as error:
            found.append({finding.code for finding in error.findings})
    assert found == [{page.code}, set()]
