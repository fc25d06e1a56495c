"""Line breaks in XML: only white space between tags is added, and long elements are broken."""

from __future__ import annotations

import re

import pytest

from manipcli.description.lint.check import Check
from manipcli.description.lint.checks import CHECKS
from manipcli.report.codes.xml_lines import broken


def joined(xml: str) -> str:
    return re.sub(r">\s+<", "><", xml)


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.code)
def test_only_white_space_is_added(check: Check) -> None:
    assert joined(broken(check.bad, width=0)) == joined(check.bad)


def test_children_are_on_lines_of_their_own_where_an_element_is_long() -> None:
    short, long = '<a x="1"><b/></a>', f'<a x="{"1" * 90}"><b/><c>text</c></a>'
    assert broken(f"<r>{short}{long}</r>").splitlines() == [
        "<r>",
        f"  {short}",
        f'  <a x="{"1" * 90}">',
        "    <b/>",
        "    <c>text</c>",
        "  </a>",
        "</r>",
    ]
