"""Xacro expands as in ROS, keeps the places, and runs nothing."""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from xml.dom import minidom

import pytest
import yaml

from manipcli.core.errors import InvalidInput
from manipcli.description.expanded import Description, read_description
from manipcli.description.lint.examine import examine
from manipcli.description.packages import Packages
from manipcli.description.xacro import expand as xacro

HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'


def expand(folder: Path, body: str, **arguments: str | int | float | bool) -> Description:
    path = folder / "r.urdf.xacro"
    path.write_text(HEAD + body + "\n</robot>\n", encoding="utf-8")
    return read_description(path, packages=Packages(path), arguments=arguments)


def refused(folder: Path, body: str) -> InvalidInput:
    with pytest.raises(InvalidInput) as caught:
        expand(folder, body)
    assert caught.value.findings[0].place is not None
    return caught.value


def names(description: Description) -> list[str]:
    return [link.attributes["name"] for link in description.root.all("link")]


def test_macros_properties_conditions_and_blocks_expand(tmp_path: Path) -> None:
    description = expand(
        tmp_path,
        """<xacro:arg name="side" default="left"/>
<xacro:property name="n" value="${2 * 3}"/>
<xacro:macro name="part" params="name mass:=1.5 *shape">
  <link name="$(arg side)_${name}_${n}"><mass value="${mass}"/><xacro:insert_block name="shape"/></link>
</xacro:macro>
<xacro:part name="a"><box/></xacro:part>
<xacro:if value="${n > 5}"><xacro:part name="b" mass="2"><sphere/></xacro:part></xacro:if>
<xacro:unless value="true"><link name="never"/></xacro:unless>""",
        side="right",
    )
    assert names(description) == ["right_a_6", "right_b_6"]
    a, b = description.root.all("link")
    assert (a.children[0].attributes["value"], a.children[1].tag) == ("1.5", "box")
    assert (b.children[0].attributes["value"], b.children[1].tag) == ("2", "sphere")


def test_an_element_from_a_macro_in_an_included_file_knows_where_it_was_written(tmp_path: Path) -> None:
    (tmp_path / "part.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
        '<xacro:macro name="part" params="name">\n    <link name="${name}"/></xacro:macro>\n</robot>'
    )
    description = expand(
        tmp_path, '<xacro:include filename="part.xacro"/>\n<xacro:part name="a"/><xacro:part name="b"/><link name="c"/>'
    )
    places = {link.attributes["name"]: link.place for link in description.root.all("link")}
    for name in ("a", "b"):
        place = places[name]
        assert place is not None
        assert (Path(place.file).name, place.line, place.column) == ("part.xacro", 3, 5)
    own = places["c"]
    assert own is not None
    assert (Path(own.file).name, own.line, own.column) == ("r.urdf.xacro", 3, 45)


def test_a_misspelt_tag_of_xacro_names_the_right_one(tmp_path: Path) -> None:
    finding = refused(tmp_path, '<xacro:proprety name="n" value="1"/>').findings[0]
    assert "did you mean <xacro:property>?" in (finding.hint or "")


def test_an_error_in_a_macro_names_its_place_and_the_call(tmp_path: Path) -> None:
    macro = '<xacro:macro name="part" params="x">\n<link name="${x + missing}"/>\n</xacro:macro>\n'
    error = refused(tmp_path, macro + '<xacro:part x="1"/>')
    finding = error.findings[0]
    assert finding.place is not None
    assert finding.place.line == 3
    assert "missing" in finding.message
    assert "xacro:part" in (finding.hint or "")
    assert ":5:1" in (finding.hint or "")


def test_a_finding_in_a_macro_names_the_outermost_and_the_innermost_call(tmp_path: Path) -> None:
    path = tmp_path / "r.xacro"
    path.write_text(
        HEAD
        + """<link name="a"/>
<xacro:macro name="inner" params="name *b"><link name="${name}"><xacro:insert_block name="b"/></link></xacro:macro>
<xacro:macro name="middle" params="name"><xacro:inner name="${name}"><visual/></xacro:inner></xacro:macro>
<xacro:macro name="outer" params="name"><xacro:middle name="${name}"/></xacro:macro>
<xacro:inner name="base"><visual/></xacro:inner>
<xacro:outer name="base"/>
</robot>""",
        encoding="utf-8",
    )
    (finding,) = [
        each for each in examine(path, packages=Packages(path)).findings if each.message.startswith("duplicate")
    ]
    assert (finding.hint or "").endswith(f"expanded from {path}:7:1, then from {path}:4:42")
    assert finding.place is not None
    assert (finding.place.line, finding.place.column) == (3, 44)


@pytest.mark.parametrize("pattern", ["parts/*.xacro", "parts/**", "{parts}/*.xacro"])
def test_a_pattern_includes_the_files_of_one_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pattern: str
) -> None:
    parts = tmp_path / "robot" / "parts"
    (parts / "deeper").mkdir(parents=True)
    for folder, name in ((parts, "b"), (parts, "a"), (parts / "deeper", "c")):
        (folder / f"{name}.xacro").write_text(f'<robot><link name="{name}"/></robot>')
    if pattern.endswith("**"):
        (parts / "deeper" / "c.xacro").unlink()
        (parts / "deeper").rmdir()
    monkeypatch.chdir(tmp_path)
    include = f'<xacro:include filename="{pattern.format(parts=parts)}"/>'
    assert names(expand(Path("robot"), include)) == ["a", "b"]


@pytest.mark.parametrize("written", ["$(dirname)/part.xacro", "${abs_filename('part.xacro')}", "part.xacro"])
def test_the_folder_of_a_description_is_that_folder_from_wherever_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, written: str
) -> None:
    (tmp_path / "robot" / "deep").mkdir(parents=True)
    deeper = HEAD + '<xacro:include filename="$(dirname)/deep/b.xacro"/></robot>'
    (tmp_path / "robot" / "part.xacro").write_text(deeper)
    (tmp_path / "robot" / "deep" / "b.xacro").write_text('<robot><link name="b"/></robot>')
    monkeypatch.chdir(tmp_path)
    include = f'<xacro:include filename="{written}"/><link name="$(dirname)"/>'
    assert names(expand(Path("robot"), include)) == ["b", str(tmp_path / "robot")]


@pytest.mark.parametrize(
    ("name", "hint"),
    [("nmae", "did you mean 'name'?"), ("ip", "pass it: `args: {ip: VALUE}` in a robot file, ip:=VALUE")],
)
def test_an_argument_that_is_missing_is_to_be_given(tmp_path: Path, name: str, hint: str) -> None:
    finding = refused(tmp_path, f'<xacro:arg name="name" default="x"/><link name="$(arg {name})"/>').findings[0]
    assert (finding.hint or "").startswith(hint)


def test_packages_are_found_through_our_search(tmp_path: Path) -> None:
    (tmp_path / "stack" / "hand").mkdir(parents=True)
    (tmp_path / "stack" / "arm").mkdir()
    (tmp_path / "stack" / "hand" / "h.xacro").write_text('<robot><link name="h"/></robot>')
    assert names(expand(tmp_path / "stack" / "arm", '<xacro:include filename="$(find hand)/h.xacro"/>')) == ["h"]


def test_yaml_data_is_read_with_units_and_attributes(tmp_path: Path) -> None:
    (tmp_path / "d.yaml").write_text("joint: {upper: !degrees 2 * 45, names: [a, b]}")
    description = expand(
        tmp_path,
        """<xacro:property name="d" value="${xacro.load_yaml('d.yaml')}"/>
<link name="${d.joint.names[1]}" upper="${d['joint']['upper']}"/>""",
    )
    link = description.root.all("link")[0]
    assert link.attributes["name"] == "b"
    assert float(link.attributes["upper"]) == pytest.approx(1.5707963267948966, abs=1e-15)
    with pytest.raises(yaml.YAMLError):  # the constructors stayed with our own loader
        yaml.safe_load("q: !degrees 1")


ATTACKS = {
    "lambda": "<link name=\"${(lambda: load_yaml.__globals__['os'].system('touch CANARY'))()}\"/>",
    "builtins": "<link name=\"${load_yaml.__globals__['__builtins__']['open']('CANARY', 'w')}\"/>",
    "subclasses": "<link name=\"${python.vars(python.type)['__subclasses__'](python.type)}\"/>",
    "eval": '<xacro:property name="p" value="open(\'CANARY\', \'w\')"/><link name="$(eval ${p})"/>',
    "eval import": "<link name=\"$(eval __import__('os').system('touch CANARY')\"/>",
    "format": "<link name=\"${'{0.__globals__[os].environ[HOME]}'.format(xacro.load_yaml)}\"/>",
    "env": '<link name="$(env HOME)"/>',
    "command": "<link name=\"$(command 'touch CANARY')\"/>",
    "yaml outside": "<link name=\"${xacro.load_yaml('/etc/os-release')}\"/>",
    "yaml above": "<link name=\"${xacro.load_yaml('../../../../../../etc/os-release')}\"/>",
    "include outside": '<xacro:include filename="/etc/fonts/fonts.conf"/>',
    "power": '<link name="${9**9**9}"/>',
    "text": "<link name=\"${'a' * 4000000000}\"/>",
    "itself": '<xacro:include filename="r.urdf.xacro"/>',
    "recursion": '<xacro:macro name="m" params=""><xacro:m/></xacro:macro><xacro:m/>',
    "doubling": "".join(
        f'<xacro:macro name="m{k}" params=""><xacro:m{k + 1}/><xacro:m{k + 1}/></xacro:macro>' for k in range(30)
    )
    + '<xacro:macro name="m30" params=""><link name="x"/></xacro:macro><xacro:m0/>',
    "growing text": "".join(f'<xacro:property name="p{k}" value="${{p{k + 1}}}${{p{k + 1}}}"/>' for k in range(30))
    + '<xacro:property name="p30" value="abc"/><link name="${p0}"/>',
    "unclosed quote": '<xacro:macro name="m" params="x:=LONG\'"/><xacro:m/>'.replace("LONG", "y" * 100),
    "many quotes": '<xacro:macro name="m" params="x:=LONG\'"/><xacro:m/>'.replace("LONG", "'a'" * 300),
    "circle": '<xacro:property name="a" value="${b}"/><xacro:property name="b" value="${a}"/><link name="${a}"/>',
}


@pytest.mark.parametrize("attack", ATTACKS)
def test_a_hostile_description_is_refused_with_its_place(
    tmp_path: Path, attack: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "one" / "two"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    monkeypatch.setenv("MANIPCLI_BOUNDS", "expansions=2000")
    error = refused(folder, ATTACKS[attack])
    assert os.environ["HOME"] not in error.findings[0].message
    assert not list(tmp_path.rglob("CANARY"))


def test_yaml_with_code_in_it_is_refused(tmp_path: Path) -> None:
    for text in ("!degrees \"(lambda: load_yaml.__globals__['os'].system('id'))()\"", "!!python/name:os.system"):
        (tmp_path / "d.yaml").write_text(f"q: {text}")
        refused(tmp_path, "<link name=\"${xacro.load_yaml('d.yaml')}\"/>")


def test_a_number_of_yaml_that_has_no_value_is_told_where_it_stands(tmp_path: Path) -> None:
    (tmp_path / "d.yaml").write_text('a: 1\nb: !degrees "sqrt(-1)"\n')
    (finding,) = refused(tmp_path, "<link name=\"${load_yaml('d.yaml')['b']}\"/>").findings
    assert finding.place is not None
    assert (Path(finding.place.file).name, finding.place.line, finding.place.column) == ("d.yaml", 2, 4)
    assert "sqrt(-1)" in finding.message


def test_yaml_that_grows_by_merging_is_refused_or_merged_at_once(tmp_path: Path) -> None:
    """PyYAML merges each key once from 6.0.4 on; before, each line here is ten times the one above."""
    (tmp_path / "d.yaml").write_text(
        "a0: &a0 {x: 1}\n" + "".join(f"a{k}: &a{k} {{<<: [{', '.join([f'*a{k - 1}'] * 10)}]}}\n" for k in range(1, 12))
    )
    body = "<link name=\"${load_yaml('d.yaml')['a11']['x']}\"/>"
    if tuple(map(int, yaml.__version__.split(".")[:3])) < (6, 0, 4):
        (finding,) = refused(tmp_path, body).findings
        assert finding.code == "XACRO004"
    else:
        assert names(expand(tmp_path, body)) == ["1"]
    (tmp_path / "d.yaml").write_text("a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}\n")
    body = '<xacro:property name="d" value="${load_yaml(\'d.yaml\')}"/><link name="${d.b.x}_${d.b.y}"/>'
    assert names(expand(tmp_path, body)) == ["1_3"]


@pytest.mark.parametrize(
    ("text", "place"), [("a: [1,\nb: }\n", (2, 4)), ("a: 1\n\tb: 2\n", (2, 1)), ("\xe4: \0", (1, 1))]
)
def test_a_typing_mistake_in_yaml_is_told_at_its_place(tmp_path: Path, text: str, place: tuple[int, int]) -> None:
    (tmp_path / "d.yaml").write_text(text, encoding="latin-1")
    (finding,) = refused(tmp_path, "<link name=\"${load_yaml('d.yaml')}\"/>").findings
    assert finding.code == "XACRO001"
    assert finding.place is not None
    assert (Path(finding.place.file).name, (finding.place.line, finding.place.column)) == ("d.yaml", place)
    assert "r.urdf.xacro:2:1" in (finding.hint or "")


@pytest.mark.parametrize(
    "body",
    [
        '<l a="${a}0" b="${a}1"/>' * 20,
        "<l>${a}${a}</l>" * 20,
        "".join(f'<xacro:property name="q{k}" value="${{a + \'{k}\'}}" lazy_eval="false"/>' for k in range(40)),
    ],
)
def test_the_expanded_document_has_a_bounded_size(tmp_path: Path, body: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MANIPCLI_BOUNDS", "characters=10000000")
    long = '<xacro:property name="a" value="${\'a\' * 30000}"/>'
    macro = f'<xacro:macro name="m" params="">{body}</xacro:macro>'
    (finding,) = refused(tmp_path, long + macro + "<xacro:m/>" * 400).findings
    assert finding.code == "XACRO004"
    assert "characters=20000000" in (finding.hint or "")


def test_an_optional_include_may_be_absent(tmp_path: Path) -> None:
    link = '<link name="a"/>'
    assert names(expand(tmp_path, '<xacro:include filename="none.xacro" optional="true"/>' + link)) == ["a"]
    for optional in ("", ' optional="false"'):
        assert "none.xacro" in str(refused(tmp_path, f'<xacro:include filename="none.xacro"{optional}/>' + link))
    refused(tmp_path, '<xacro:include filename="/etc/none.xacro" optional="true"/>' + link)
    (tmp_path / "part.xacro").write_text("<robot>")
    refused(tmp_path, '<xacro:include filename="part.xacro" optional="true"/>' + link)


def test_a_variable_is_read_when_the_user_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    body = '<link name="$(env SIDE)_$(optenv NONE x)"/>'
    monkeypatch.setenv("SIDE", "left")
    monkeypatch.delenv("NONE", raising=False)
    assert "MANIPCLI_ALLOW_ENV=SIDE" in (refused(tmp_path, body).findings[0].hint or "")
    monkeypatch.setenv("MANIPCLI_ALLOW_ENV", "SIDE,NONE")
    assert names(expand(tmp_path, body)) == ["left_x"]


def test_an_optional_variable_has_its_default_whatever_the_environment_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SIDE", "left")
    body = '<link name="$(optenv SIDE right)"/><link name="$(optenv SIDE right)_$(optenv BARE)"/>'
    path = tmp_path / "r.urdf.xacro"
    path.write_text(HEAD + body + "</robot>")
    found = read_description(path, packages=Packages(path))
    assert [link.attributes["name"] for link in found.root.all("link")] == ["right", "right_"]
    assert [(note.code, note.severity) for note in found.findings] == [("XACRO011", "note")] * 2
    assert "MANIPCLI_ALLOW_ENV=SIDE" in (found.findings[0].hint or "")


def test_the_working_folder_is_refused_with_what_to_write_instead(tmp_path: Path) -> None:
    assert "$(dirname)" in (refused(tmp_path, '<link name="$(cwd)"/>').findings[0].hint or "")


def test_files_that_include_each_other_are_named_and_no_bound_is_said_to_help(tmp_path: Path) -> None:
    (tmp_path / "hand.xacro").write_text(HEAD + '<xacro:include filename="r.urdf.xacro"/></robot>')
    (finding,) = refused(tmp_path, '<xacro:include filename="hand.xacro"/>').findings
    assert finding.message.endswith("r.urdf.xacro -> hand.xacro -> r.urdf.xacro"), finding.message
    assert "MANIPCLI_BOUNDS" not in (finding.hint or "")


def test_an_empty_expression_is_told_without_a_word_of_python(tmp_path: Path) -> None:
    (finding,) = refused(tmp_path, '<link name="${}"/>').findings
    assert "<unknown>" not in finding.message and "''" in finding.message


def test_a_pipe_cannot_be_included(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.xacro")
    refused(tmp_path, '<xacro:include filename="pipe.xacro"/>')


@pytest.mark.parametrize(
    "text",
    [
        '<!DOCTYPE r [<!ENTITY a "b">]><robot name="r">&a;</robot>',
        '<!DOCTYPE r SYSTEM "file:///etc/passwd"><robot name="r"/>',
        "<robot name='r'>",
        "",
        "\0",
        "<robot><link name='a' name='b'/></robot>",
        "<robot><xacro:x/></robot>",
        "<robot>" + "<a>" * 200 + "</a>" * 200 + "</robot>",
        f'<robot name="{"a" * 70_000}"/>',
        "<sdf/>",
    ],
)
def test_what_is_no_plain_xml_description_is_refused(tmp_path: Path, text: str) -> None:
    for name in ("r.urdf", "r.xacro"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InvalidInput) as caught:
            read_description(path, packages=Packages(path))
        assert caught.value.findings[0].place is not None


def test_an_argument_without_a_value_is_told_with_both_ways_to_give_one(tmp_path: Path) -> None:
    (finding,) = refused(tmp_path, '<link name="$(arg prefix)"/>').findings
    assert finding.code == "XACRO003"
    assert "`args: {prefix: VALUE}` in a robot file" in (finding.hint or "")
    assert "prefix:=VALUE" in (finding.hint or "")
    assert expand(tmp_path, '<link name="$(arg prefix)"/>', prefix="a") is not None


def test_an_argument_that_the_description_does_not_have_is_told(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"'sied'.*the description has: side"):
        expand(tmp_path, '<xacro:arg name="side" default="left"/><link name="$(arg side)"/>', sied="right")
    path = tmp_path / "r.urdf"
    path.write_text('<robot name="r"/>')
    with pytest.raises(InvalidInput, match="no arguments"):
        read_description(path, packages=Packages(path), arguments={"side": "left"})


def test_the_library_that_others_import_is_left_as_it_was(tmp_path: Path) -> None:
    library = importlib.import_module("xacro")
    before = {name: value for name, value in vars(library).items() if callable(value)}
    write = minidom.Element.writexml
    expand(tmp_path, '<link name="${1 + 1}"/>')
    refused(tmp_path, '<link name="${1 +}"/>')
    assert {name: value for name, value in vars(library).items() if callable(value)} == before
    assert minidom.Element.writexml is write
    assert yaml.SafeLoader.yaml_constructors.get("!degrees") is None


def test_the_same_file_expands_the_same_twice(tmp_path: Path) -> None:
    body = '<xacro:property name="n" value="3"/><link name="l${n}"/>'
    assert names(expand(tmp_path, body)) == names(expand(tmp_path, body)) == ["l3"]


def test_parameters_of_macros_are_read_as_the_library_reads_them() -> None:
    library = importlib.import_module("xacro")
    texts = (
        "a", "a b", "a:=1", "a=1 b", "a := 1", "a:=^", "a:=^|2 *b", "a:=${1 + 2} b:='x y' **c", 'a:="x y"z b', "a:=",
        "a:=$(arg x) b", "a:=x'y z'w v", "*a *b", "a:='' b:=\"\"", " a:=1   b ", "a:='x", "a:=^|'q r' b:=^",
    )  # fmt: skip
    for text in texts:
        theirs, ours = library.re_macro_arg.match(text), xacro._MACRO_ARGUMENT.match(text)
        assert (theirs and theirs.groups()) == (ours and ours.groups()), text
