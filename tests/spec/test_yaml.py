"""YAML 1.2 to a tree of places: the core schema, the limits, and the place of every mistake."""

from __future__ import annotations

import string

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.spec.source import yaml as ours
from manipcli.spec.source.tree import MappingNode, key_place_at, node_at, plain
from manipcli.spec.source.yaml import parse


def read(text: str | bytes) -> object:
    root = parse(text, "f")
    return None if root is None else plain(root)


def refused(text: str | bytes) -> tuple[Diagnostic, ...]:
    with pytest.raises(InvalidInput) as caught:
        parse(text, "f")
    return caught.value.findings


def spot(finding: Diagnostic) -> tuple[str, int, int]:
    assert finding.place is not None
    return finding.code, finding.place.line, finding.place.column


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3), ("1e5", 1e5), ("+.5", 0.5), ("5.", 5.0), ("010", 10), ("0o17", 15), ("0x1F", 31), ("-0", 0),
        ("on", "on"), ("yes", "yes"), ("off", "off"), ("y", "y"), ("12:30", "12:30"), ("2026-11-01", "2026-11-01"),
        ("1_000", "1_000"), ("true", True), ("FALSE", False), ("~", None), ("null", None), ("Null", None), ("", None),
        ("'1e-3'", "1e-3"), ('"true"', "true"), ("0b1", "0b1"), ("=", "="),
    ],
)  # fmt: skip
def test_scalars_follow_the_core_schema_of_yaml_1_2(text: str, value: object) -> None:
    result = read(f"k: {text}\n")
    assert isinstance(result, dict)
    assert result["k"] == value
    assert type(result["k"]) is type(value)


def test_keys_are_texts_as_written() -> None:
    assert read("on: 1\n010: 2\nnull: 3\n1.0: 4") == {"on": 1, "010": 2, "null": 3, "1.0": 4}


def test_every_key_and_value_knows_its_place() -> None:
    root = parse("a:\n  - {b: 1, c: x}\n  - é: 'q'\n", "f")
    assert root is not None
    assert node_at(root, ("a", 0, "c")).place == Place("f", 2, 15)
    assert key_place_at(root, ("a", 0, "c")) == Place("f", 2, 12)
    assert node_at(root, ("a", 1, "é")).place == Place("f", 3, 8)
    assert node_at(root, ("a", 1, "nothing", 3)).place == Place("f", 3, 5)


@pytest.mark.parametrize("text", ["", "# only words\n", "---\n", "null\n", "\ufeff"])
def test_a_file_without_content_is_nothing(text: str) -> None:
    assert parse(text, "f") is None


def test_bom_and_crlf_are_accepted() -> None:
    assert read(b"\xef\xbb\xbfa: 1\r\nb:\r\n  - 2\r\n") == {"a": 1, "b": [2]}
    assert spot(refused("\ufeffa: 1\r\na: 2\r\n")[0]) == ("YAML106", 2, 1)


@pytest.mark.parametrize(
    ("text", "code", "line", "column", "words"),
    [
        ("a: 1\n\tb: 2", "YAML100", 2, 1, "tab"),
        ("a: 1\nb: 'x\n", "YAML100", 2, 4, "a quote is not closed"),
        ("a: [1, 2\nb: 3", "YAML100", 2, 2, "a '[' is not closed, or a ',' is missing (it opens at line 1, column 4)"),
        ("a: {b: 1\n", "YAML100", 1, 4, "a '{' is not closed"),
        ("a: b: c", "YAML100", 1, 5, "unexpected ':'"),
        ("- do: f\n    with: {a: 1}", "YAML100", 2, 9, "unexpected ':'"),
        ("a:\n  - 1\n b: 2", "YAML100", 3, 2, "does not fit the indentation"),
        ("a: @x", "YAML100", 1, 4, "'@' cannot begin a value"),
        (b"\xff\xfea\0:\0 \x001\0", "YAML101", 1, 1, "UTF-16"),
        ("a: 1\nb: 2".encode("utf-16-be"), "YAML101", 1, 1, "UTF-16"),
        (b"a: 1\ncaf\xe9: 2", "YAML101", 2, 4, "0xe9"),
        ("a: 1\nb: \0", "YAML102", 2, 4, "U+0000"),
        ("a: 1\nb: \x1b[31m", "YAML102", 2, 4, "U+001B"),
        ("a: !!python/object/apply:os.system ['id']", "YAML104", 1, 4, "!!python/object/apply:os.system"),
        ("a: !degrees 90", "YAML104", 1, 4, "!degrees"),
        ("a: !!str 1", "YAML104", 1, 4, "!!str"),
        ("a: 1\n---\nb: 2", "YAML105", 2, 1, "second document"),
        ("a: 1\nb: 2\na: 3", "YAML106", 3, 1, "lines 1 and 3"),
        ("x:\n  - {a: 1, a: 2}", "YAML106", 2, 12, "lines 2 and 2"),
        ("a: *nobody", "YAML109", 1, 4, "no anchor"),
        ("a: &a [*a]", "YAML109", 1, 8, "inside its own anchor"),
        ("a: &a {b: {c: *a}}", "YAML109", 1, 15, "inside its own anchor"),
        ("? [1]\n: 2", "YAML110", 1, 3, "a key must be a string"),
        ("a: 1\n?\n: 2", "YAML110", 2, 2, "a key is missing"),
        ("a: .nan", "YAML111", 1, 4, "not a finite number"),
        ("a: [1, -.INF]", "YAML111", 1, 8, "not a finite number"),
        ("a: 1e400", "YAML111", 1, 4, "exceeds the largest number"),
        ("a: " + "9" * 5000, "YAML111", 1, 4, "exceeds the largest number"),
        ("<<: 3", "YAML112", 1, 5, "needs a mapping"),
    ],
)  # fmt: skip
def test_a_mistake_is_refused_at_its_place(text: str | bytes, code: str, line: int, column: int, words: str) -> None:
    finding = refused(text)[0]
    assert spot(finding) == (code, line, column)
    assert words in finding.message


def test_all_mistakes_before_a_syntax_error_are_told() -> None:
    codes = [finding.code for finding in refused("a: .nan\nb: 1\nb: 2\nc: !x 1\nd: [")]
    assert codes == ["YAML111", "YAML106", "YAML104", "YAML100"]


def test_aliases_share_and_merge_keys_yield_to_what_is_written() -> None:
    text = "base: &b {p: 1, d: 2}\nmore: &m {d: 3, i: 4}\nx: {<<: [*b, *m], p: 9}\ny: *b"
    assert read(text) == {
        "base": {"p": 1, "d": 2},
        "more": {"d": 3, "i": 4},
        "x": {"p": 9, "d": 2, "i": 4},
        "y": {"p": 1, "d": 2},
    }


def test_an_alias_bomb_is_counted_not_expanded() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    assert refused("\n".join(lines))[0].code == "YAML107"
    merged = ["a0: &a0 {k: 1}"] + [f"a{k}: &a{k} {{<<: [{', '.join([f'*a{k - 1}'] * 9)}]}}" for k in range(1, 12)]
    assert refused("\n".join(merged))[0].code == "YAML107"


def test_depth_is_bounded_also_through_aliases() -> None:
    assert read("[" * 64 + "]" * 64) is not None
    assert spot(refused("[" * 65 + "]" * 65)[0]) == ("YAML108", 1, 65)
    assert refused("[" * 100_000)[0].code == "YAML108"
    half = "a: &a " + "[" * 40 + "]" * 40 + "\nb: " + "[" * 40 + "*a" + "]" * 40
    assert refused(half)[0].code == "YAML108"


def test_a_huge_file_is_refused_before_it_is_parsed() -> None:
    assert refused(b"#" * (ours.MAX_BYTES + 1))[0].code == "YAML103"


def test_constructors_that_others_registered_are_never_asked() -> None:
    ran: list[str] = []

    class Other(yaml.SafeLoader):
        pass

    Other.add_constructor("!run", lambda loader, node: ran.append("run"))
    yaml.SafeLoader.add_constructor("!run", lambda loader, node: ran.append("run"))
    try:
        assert refused("a: !run x")[0].code == "YAML104"
    finally:
        del yaml.SafeLoader.yaml_constructors["!run"]
    assert ran == []


@given(st.text(st.sampled_from(string.ascii_letters + "0123456789 \n\t:-[]{}&*!|>'\"#%@,?.~<$"), max_size=60))
def test_any_text_is_a_tree_or_refused_with_places(text: str) -> None:
    try:
        parse(text, "f")
    except InvalidInput as error:
        for finding in error.findings:
            assert finding.place is not None
            assert finding.place.line >= 1
            assert finding.place.column >= 1
            assert "\n" not in finding.message


@given(st.binary(max_size=60))
def test_any_bytes_are_a_tree_or_refused(data: bytes) -> None:
    try:
        parse(data, "f")
    except InvalidInput as error:
        assert error.findings


@pytest.mark.slow
@given(st.text(st.sampled_from("ab:-[]{}&*!|>'\"#\n ,?.0"), max_size=40))
def test_the_parser_in_python_agrees_with_libyaml(text: str) -> None:
    def outcome() -> object:
        try:
            return read(text)
        except InvalidInput:
            return InvalidInput

    first = outcome()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ours.yaml, "__with_libyaml__", False)
        second = outcome()
    # The two PyYAML parsers differ on corner cases; what both accept they must read alike.
    if InvalidInput not in (first, second):
        assert first == second


def test_a_tree_can_be_copied_with_a_change() -> None:
    root = parse("a: 1\nb: 2", "f")
    assert isinstance(root, MappingNode)
    assert plain(root.without("a").with_entry("c", root.entries["a"])) == {"b": 2, "c": 1}
    assert plain(root) == {"a": 1, "b": 2}


def test_a_reader_that_goes_on_gets_the_first_of_two_keys_and_nothing_for_no_number() -> None:
    told: list[Diagnostic] = []
    root = parse("a: 1\na: 2\nb: .nan\nc: [-.inf, 1e999, !!str x]\n? [k]\n: 3\n", "f", reported=told)
    assert root is not None
    assert plain(root) == {"a": 1, "b": None, "c": [None, None, "x"]}
    assert [spot(one) for one in told] == [
        ("YAML106", 2, 1), ("YAML111", 3, 4), ("YAML111", 4, 5), ("YAML111", 4, 12), ("YAML104", 4, 19),
        ("YAML110", 5, 3),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("data", "hint"),
    [(b"a: caf\xe9", "iconv"), (b"\x89MCAP0\r\n\x01\0\0", "binary"), (b"\x7fELF\x02\x01\xff\0", "binary")],
)
def test_bytes_that_are_no_text_are_told_from_those_of_another_encoding(data: bytes, hint: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        parse(data, "f.yaml")
    assert hint in (refused.value.findings[0].hint or "")


@pytest.mark.parametrize("text", ["a: .nan\nb: [\n", "a: .nan\nb: *c\n", "a: .nan\n---\nb: 1\n"])
def test_a_reader_that_goes_on_stops_where_the_text_is_no_yaml(text: str) -> None:
    told: list[Diagnostic] = []
    with pytest.raises(InvalidInput) as caught:
        parse(text, "f", reported=told)
    first, second = caught.value.findings
    assert (first.code, second.code[:4]) == ("YAML111", "YAML")
    assert not told


@pytest.mark.parametrize(
    ("text", "deeper"), [("- do: f\n    with: 1", True), ("- do: f\n  with: a: 1", False), ("a: b: c", False)]
)
def test_a_key_deeper_than_a_value_is_hinted_at(text: str, deeper: bool) -> None:
    try:
        found = parse(text, "f.yaml")[1]
    except InvalidInput as invalid:
        found = list(invalid.findings)
    assert any("indent this line" in (each.hint or "") for each in found) == deeper
