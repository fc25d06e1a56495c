"""The door for descriptions never breaks: every finding once, in order, bounded; the summary counts what is written."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.description.bounds import Bounds, bounds
from manipcli.description.lint.check import Check
from manipcli.description.lint.checks import CHECKS
from manipcli.description.lint.examine import MOST_OF_A_CODE, Examination, examine
from manipcli.description.lint.guess_groups import guess_groups
from manipcli.description.lint.summary import summarise, tree_lines
from manipcli.description.packages import Packages
from manipcli.model.build_robot import build_robot
from manipcli.spec.robot import RobotSpec

XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
LIMIT = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'


def look(folder: Path, text: str | bytes, name: str = "r.urdf", **arguments: str) -> Examination:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return examine(path, packages=Packages(path), arguments=arguments)


def joint(name: str, parent: str, child: str, kind: str = "revolute", more: str = "") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 1"/><axis xyz="1 0 0"/>'
    limit = LIMIT if kind != "fixed" else ""
    return f'<joint name="{name}" type="{kind}">{ends}{limit}{more}</joint>'


def robot(links: str, *joints: str) -> str:
    return "".join(['<robot name="r">', *(f'<link name="{name}"/>' for name in links.split()), *joints, "</robot>"])


def codes(examination: Examination) -> list[str]:
    return [finding.code for finding in examination.findings]


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"", "URDF001"),
        (b"\x00\xff", "URDF001"),
        ("<robot name='r'/>".encode("utf-16"), "URDF001"),
        ("<robot name='\xe9'/>".encode("latin-1"), "URDF001"),
        (b"<sdf/>", "URDF002"),
        (b"<mujoco/>", "URDF002"),
        (b"<robot name='r'>" + b"<a>" * 5000, "URDF052"),
        (b"<!DOCTYPE robot><robot/>", "URDF051"),
    ],
)
def test_what_cannot_be_read_is_one_finding_with_a_place(tmp_path: Path, data: bytes, code: str) -> None:
    for name in ("r.urdf", "r.xacro"):
        found = look(tmp_path, data, name)
        assert codes(found) == [code]
        assert found.findings[0].place is not None
        assert found.parts is None


@pytest.mark.parametrize("begin", [b"", b"\xef\xbb\xbf", b"\n  "])
def test_a_file_of_another_kind_is_sent_to_its_own_command(tmp_path: Path, begin: bytes) -> None:
    (finding,) = look(tmp_path, begin + b"robot: arm\nurdf: arm.urdf\n", "robot.yaml").findings
    assert finding.hint == "not XML; for robot, controller and task files use `manipcli check`"
    (broken,) = look(tmp_path, begin + b"<robot name='r'><link>", "r.urdf").findings
    assert (broken.hint or "").startswith("close <link> of line ")


def test_a_folder_is_no_description(tmp_path: Path) -> None:
    found = examine(tmp_path, packages=Packages(tmp_path))
    assert codes(found) == ["URDF001"]
    assert "is a folder" in found.findings[0].message


@pytest.mark.parametrize(
    ("text", "name", "hint"),
    [
        ('<robot name="r"><group name="arm"/></robot>', "r.srdf", "SRDF"),
        (f'{XACRO}<xacro:macro name="m"><link name="a"/></xacro:macro></robot>', "m.xacro", "calls the macros"),
        ('<robot name="r"/>', "r.urdf", None),
    ],
)
def test_a_description_without_links_is_sent_to_the_one_with_them(
    tmp_path: Path, text: str, name: str, hint: str | None
) -> None:
    (finding,) = (one for one in look(tmp_path, text, name).findings if one.code == "URDF080")
    assert (hint in (finding.hint or "")) if hint else finding.hint is None


def test_an_element_that_is_never_closed_is_named(tmp_path: Path) -> None:
    found = look(tmp_path, '<robot name="r">\n<link name="a">\n</robot>')
    assert found.findings[0].place is not None
    assert (found.findings[0].place.line, found.findings[0].hint) == (3, "close <link> of line 2")


@pytest.mark.parametrize(
    ("broken", "message", "column", "hint"),
    [
        ("<!-- Größe -->".encode("latin-1"), "the byte 0xf6 is not UTF-8", 8, "save it as UTF-8"),
        (b"<<<<<<< HEAD\n=======\n>>>>>>> other", "unresolved merge conflict", 1, "keep one side"),
        (b'<link name="${1 < 2}"/>', "invalid token", 17, "&lt;"),
        (b'<link name="a &amp; b"/><link name="a & b"/>', "invalid token", 40, "&amp;"),
        (b"<!-- a -- b -->", "invalid token", 10, "remove '--'"),
        (b"<link name=a/>", "invalid token", 12, "in quotes"),
        (b"<xacro:arg/>", "unbound prefix 'xacro'", 1, 'xmlns:xacro="http://www.ros.org/wiki/xacro"'),
        (b"<sensor:ray/>", "unbound prefix 'sensor'", 1, 'xmlns:sensor="..."'),
        (b'<?xml version="1.0"?>', "not at start", 1, "before '<?xml'"),
    ],
)
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_a_common_slip_in_xml_is_told_with_its_remedy(
    tmp_path: Path, broken: bytes, message: str, column: int, hint: str, end: bytes
) -> None:
    text = b'<robot name="r">\n' + broken + b"\n</robot>\n"
    (finding,) = look(tmp_path, text.replace(b"\n", end), "r.xacro").findings
    assert finding.code == "URDF001"
    assert message in finding.message
    assert finding.place is not None
    assert finding.place.line == 2
    assert (finding.place.line, finding.place.column) == (2, column)
    assert hint in (finding.hint or "")


def test_a_declared_encoding_is_not_to_blame_for_another_slip(tmp_path: Path) -> None:
    text = '<?xml version="1.0" encoding="iso-8859-1"?>\n<robot name="é" x=3/>\n'.encode("latin-1")
    (finding,) = look(tmp_path, text).findings
    assert finding.hint == 'put the value in quotes: "..."'


def test_findings_stand_in_the_order_of_the_file_and_once(tmp_path: Path) -> None:
    text = '<robot name="r">\n<link name="a" x="1"/>\n<link name="b" y="1"/>\n<linc/>\n</robot>'
    found = look(tmp_path, text)
    lines = [finding.place.line for finding in found.findings if finding.place is not None]
    assert lines == sorted(lines)
    assert len(set(map(str, found.findings))) == len(found.findings)
    assert {"URDF053", "URDF055", "URDF007"} <= set(codes(found))


def test_of_thousands_of_findings_some_are_told_and_the_rest_counted(tmp_path: Path) -> None:
    found = look(tmp_path, '<robot name="r"><link name="a"/>' + '<linc/><link name="a"/>' * 500 + "</robot>")
    assert codes(found).count("URDF005") == MOST_OF_A_CODE
    assert dict(found.left_out)["URDF005"] == 500 - MOST_OF_A_CODE
    assert dict(found.left_out)["URDF053"] == 500 - MOST_OF_A_CODE


def test_a_check_that_breaks_lets_nothing_pass(tmp_path: Path) -> None:
    def broken(_: object) -> list[Diagnostic]:
        raise ZeroDivisionError("oh")

    path = tmp_path / "r.urdf"
    path.write_text(robot("a"))
    bad = Check("URDF999", "broken", "schema", "note", "x", "y.", "", broken)
    found = examine(path, packages=Packages(path), checks=[bad])
    assert [(finding.code, finding.severity) for finding in found.errors] == [("URDF999", "error")]


def test_a_robot_file_is_refused_for_what_any_check_finds(tmp_path: Path) -> None:
    """`build_robot` goes through the same door, not only through reading."""
    text = CHECKS["remote-mesh"].bad
    path = tmp_path / "r.urdf"
    path.write_text(text)
    with pytest.raises(InvalidInput, match="URDF201"):
        build_robot(RobotSpec(robot="r", description="r.urdf"), file=tmp_path / "robot.yaml")


def test_places_lead_through_macros_and_included_files(tmp_path: Path) -> None:
    (tmp_path / "part.xacro").write_text(
        f'{XACRO}\n<xacro:macro name="part" params="n">\n  <link name="${{n}}"/>\n'
        '  <joint name="${n}_j" type="fixed">\n    <parent link="a"/>\n    <child link="${n}"/>\n'
        '    <origin xyz="0 0"/>\n  </joint>\n</xacro:macro>\n</robot>'
    )
    found = look(
        tmp_path, f'{XACRO}\n<link name="a"/>\n<xacro:include filename="part.xacro"/>\n<xacro:part n="b"/>\n</robot>',
        "r.urdf.xacro",
    )  # fmt: skip
    (error,) = found.errors
    assert error.place is not None
    assert (error.code, Path(error.place.file).name, error.place.line) == ("URDF058", "part.xacro", 7)


@pytest.mark.parametrize(
    ("body", "code", "line", "hint"),
    [
        ('<xacro:property name="length" value="1"/>\n<link name="${lenght}"/>', "XACRO001", 3, "mean 'length'?"),
        ('<xacro:macro name="arm"><link name="a"/></xacro:macro>\n<xacro:amr/>', "XACRO001", 3, "<xacro:arm>"),
        ('<xacro:arg name="side" default=""/>\n<link name="$(arg sied)"/>', "XACRO003", 3, "did you mean 'side'?"),
        ('\n\n<xacro:include filename="$(find nowhere)/x"/>', "XACRO001", 4, "--package-path"),
        ('\n<link name="$(env HOME)"/>', "XACRO002", 3, "MANIPCLI_ALLOW_ENV=HOME"),
        ('<xacro:macro name="m"><xacro:m/></xacro:macro>\n<xacro:m/>', "XACRO004", 2, "MANIPCLI_BOUNDS=macro_depth="),
    ],
)
def test_what_does_not_expand_says_where_and_what_was_meant(
    tmp_path: Path, body: str, code: str, line: int, hint: str
) -> None:
    (finding,) = look(tmp_path, f"{XACRO}\n{body}\n</robot>", "r.xacro").findings
    assert finding.place is not None
    assert (finding.code, finding.place.line) == (code, line)
    assert hint in (finding.hint or "")


def test_a_bound_is_raised_as_its_error_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    deep = '<robot name="r"><link name="a"/>' + "<x>" * 120 + "</x>" * 120 + "</robot>"
    (error,) = look(tmp_path, deep).findings
    assert "depth=100" in (error.hint or "")
    variable, _, value = (error.hint or "").rpartition(": ")[2].partition("=")
    monkeypatch.setenv(variable, value)
    assert look(tmp_path, deep).errors == ()
    monkeypatch.setenv("MANIPCLI_BOUNDS", "depth=99999")
    assert codes(look(tmp_path, deep.replace("<x>", "<x>" * 30).replace("</x>", "</x>" * 30))) == ["URDF052"]
    monkeypatch.setenv("MANIPCLI_BOUNDS", "deep=3")
    with pytest.raises(InvalidInput, match="invalid bound 'deep=3'") as refused:
        bounds()
    assert "did you mean 'depth'" in (refused.value.findings[0].hint or "")


@pytest.mark.parametrize("number", ["0.5", "0", "-1", "1e3", ""])
def test_a_bound_that_is_no_whole_number_is_told_that(number: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MANIPCLI_BOUNDS", f"seconds={number}")
    with pytest.raises(InvalidInput, match=f"invalid bound 'seconds={number}'") as refused:
        bounds()
    assert refused.value.findings[0].hint == "use a whole number above 0"


def test_real_robots_are_far_from_the_bounds() -> None:
    assert Bounds() == bounds()
    assert Bounds().elements >= 10_000


ARM = robot(
    "base a b c tool left right",
    joint("1", "base", "a"),
    joint("2", "a", "b"),
    joint("3", "b", "c"),
    joint("tip", "c", "tool", "fixed"),
    joint("f1", "tool", "left", "prismatic"),
    joint("f2", "tool", "right", "prismatic", '<mimic joint="f1"/>'),
)


def test_the_summary_of_an_arm_with_a_hand(tmp_path: Path) -> None:
    found = look(tmp_path, ARM)
    assert found.description is not None
    assert found.parts is not None
    summary = summarise(found.description, found.parts)
    assert (summary.links, summary.joints, summary.moving, summary.dof, summary.mimics) == (7, 6, 5, 4, 1)
    assert dict(summary.types) == {"revolute": 3, "prismatic": 2, "fixed": 1}
    chain, hand = summary.groups
    assert (chain.kind, chain.joints, chain.base, chain.tip) == ("chain", ("1", "2", "3"), "base", "tool")
    assert (hand.kind, hand.joints, hand.mimics, hand.base) == ("hand", ("f1",), ("f2",), "tool")
    # Stretched out: two links of 1 m and the tool 1 m further on, all along one line.
    assert summary.reach == pytest.approx(3.0, abs=1e-2)
    assert tree_lines(found.parts)[-1].strip() == "└─ right  [f2: prismatic, mimics f1]"


def test_counts_are_those_of_the_text_where_there_are_errors(tmp_path: Path) -> None:
    found = look(tmp_path, ARM.replace('type="fixed"', 'type="glued"').replace("</robot>", '<link name="a"/></robot>'))
    assert found.errors
    assert found.description is not None
    assert found.parts is not None
    summary = summarise(found.description, found.parts)
    assert (summary.links, summary.joints) == (8, 6)


def test_two_arms_are_two_chains_and_a_linkage_is_none(tmp_path: Path) -> None:
    def arm(side: str) -> list[str]:
        names = ["base", *(f"{side}{k}" for k in range(6))]
        return [joint(f"{side}j{k}", names[k], names[k + 1]) for k in range(6)]

    links = " ".join(["base", *(f"{side}{k}" for side in "lr" for k in range(6)), "rod"])
    rod = joint("rod", "l0", "rod", "revolute", '<mimic joint="lj1"/>')
    found = look(tmp_path, robot(links, *arm("l"), *arm("r"), rod))
    assert found.parts is not None
    groups = guess_groups(found.parts.root, found.parts.joints)
    assert [(group.kind, len(group.joints), group.tip) for group in groups] == [("chain", 6, "l5"), ("chain", 6, "r5")]


def test_a_link_that_is_not_there_is_told_once_and_has_no_further_faults(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(
        '<robot name="r"><link name="a"/><joint name="j" type="continuous"><parent link="a"/><child link="b"/>'
        '<axis xyz="0 0 1"/></joint></robot>'
    )
    errors = [f for f in examine(file, packages=Packages(file)).findings if f.severity != "note"]
    assert [f.code for f in errors] == ["URDF006"]
