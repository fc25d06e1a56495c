"""Expressions compute what Python computes, and reach nothing else."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.description.xacro.expression import Evaluator
from manipcli.description.xacro.values import Beyond, Refused, math_symbols, python_symbols

OWN = {"x": 3, "text": "a b", "data": {"joint": {"lower": -1.5}}, "_y": 2.0}
NAMES = {**math_symbols(), **python_symbols(), **OWN}


@pytest.mark.parametrize(
    "text",
    [
        "1 + 2 * x - 4 / 8",
        "-x // 2 % 5",
        "2 ** 10",
        "pi / 2 + sin(0.3) * cos(x)",
        "x if x > 2 else 0",
        "x == 3 and not x < 1 or False",
        "1 < x <= 3",
        "'left' + '_' + text",
        "text.split()[0]",
        "data['joint']['lower'] * _y",
        "[i * x for i in range(4) if i != 2]",
        "{'a': 1}['a']",
        "min(3, x, 2) + max([1, 2]) + abs(-2)",
        "str(x) + 'b'",
        "'a' in text",
        "[1, 2, 3][1:]",
        "len(sorted([3, 1, 2]))",
        "round(2.567, 1)",
        "sum([a * b for a, b in zip([1, 2], [3, 4])])",
        "radians(90)",
        "'%d_%s %.2f%%' % (3, text, pi)",
        "sorted([3, 1, 2], reverse=True)",
        "sorted(['ccc', 'a'], key=len)",
        "max(*[1, 2], 0)",
        "5 & 1 | 2 ^ 8 << 3 >> 1",
        "len({i % 2 for i in range(4)})",
        "dict([['a', 1]], b=2)",
        "len(set([1, 1]))",
        "len(set()) + len(dict())",
        "dict(a=1)['a']",
        "sum([1, 2], 3) + 'abc'.find('c')",
    ],
)
def test_the_value_is_python_s(text: str) -> None:
    assert Evaluator()(text, NAMES) == eval(text, {**vars(math), **OWN})


def test_keys_of_data_can_be_written_as_attributes() -> None:
    assert Evaluator()("data.joint.lower", NAMES) == -1.5


@pytest.mark.parametrize(
    "text",
    [
        "(lambda: load_yaml.__globals__['os'].system('id'))()",
        "().__class__.__bases__[0].__subclasses__()",
        "str.__mro__",
        "sin.__self__",
        "'{0.__class__}'.format(x)",
        "text.format(1)",
        "f'{x}'",
        "[c for c in ().__class__.__mro__]",
        "(y := 3)",
        "print(*[1])",
        "dict(**data)",
        "9 ** 9 ** 9",
        "2 ** 10000",
        "2 ** -10000",
        "10 ** 60 * 10 ** 60 * 10 ** 60 * 10 ** 60 * 10 ** 60 * 10 ** 60",
        "'a' * 10 ** 9",
        "[0] * 10 ** 9",
        "10 ** 9 * 'a'",
        "range(10 ** 9)",
        "'%0999999999d' % 1",
        "'%*d' % (999999999, 1)",
        "'%(a)s' * 3000 % {'a': 'b' * 60000}",
        "1 << 10 ** 9",
        "[range(60000) for i in range(100)]",
        "{i: range(60000) for i in range(100)}",
        "map(range, [60000, 60000])",
        "sorted(range(60000), key=range)",
        "max(range(60000), range(60000))",
        "sum([[]] * 60000, range(60000))",
        "[i for i in range(60000) for j in range(60000)]",
        "str([[['a' * 60000] * 60000] * 60000])",
        "('b' * 60000).replace('b', 'a' * 60000)",
        "('a' * 60000).join([text] * 60000)",
        "...",
        "b'a'",
    ],
)
def test_what_could_run_code_or_never_end_is_refused(text: str) -> None:
    with pytest.raises((Refused, NameError)):
        Evaluator()(text, NAMES)


@pytest.mark.parametrize("name", ["__import__", "open", "eval", "exec", "getattr", "vars", "type", "globals", "os"])
def test_other_built_in_names_do_not_exist(name: str) -> None:
    with pytest.raises((Refused, NameError)):
        Evaluator()(f"{name}('x')", NAMES)


def test_many_small_operations_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MANIPCLI_BOUNDS", "operations=1000")
    evaluate = Evaluator()
    with pytest.raises(Refused, match="too many operations"):
        for _ in range(100):
            evaluate("sum([i for i in range(50)])", NAMES)


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        "[sum(x) for i in range(60000)]",
        "len([x.count(-1) for i in range(60000)])",
        "[1 for i in range(60000) if x + [1] == x + [2]]",
        "set([i * (2 ** 61 - 1) for i in range(30000)])",
        "dict([[i * (2 ** 61 - 1), 0] for i in range(15000)])",
    ],
)
def test_few_costly_operations_end(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MANIPCLI_BOUNDS", "seconds=1")
    with pytest.raises(Beyond, match="more than 1 s"):
        Evaluator()(text, {**NAMES, "x": list(range(60000))})


@given(st.text(alphabet="x+-*/().[]{}'_,: 0123456789abdefilmnorst", max_size=40))
def test_any_text_ends_in_a_value_or_an_ordinary_error(text: str) -> None:
    try:
        value = Evaluator()(text, NAMES)
    except (Refused, NameError, SyntaxError, TypeError, ArithmeticError, LookupError, ValueError, RecursionError):
        return
    assert type(value).__name__ != "module"
