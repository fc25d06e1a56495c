"""`-k` chooses as pytest does, and `--last-failed` remembers."""

from __future__ import annotations

from pathlib import Path

import pytest
from _pytest.mark.expression import Expression

from manipcli.batch.last_failed import last_failed, remember
from manipcli.batch.selection import chosen_by
from manipcli.core.errors import InvalidInput
from manipcli.report.suite import Case, CaseReport, CaseWord

POUR = Case("tasks/pour.yaml", "pour", sample=3, tags=("slow", "engine_pybullet"))
HOME = Case("examples/home.yaml", "Home", tags=("engine_kinematic",))


@pytest.mark.parametrize(
    "expression",
    [
        "pour", "POUR", "home", "not pour", "slow", "tasks/", "pour and slow", "pour and not slow", "pour or home",
        "not pour and not home", "not (pour or home)", "pour or home and nothing", "(pour or home) and nothing",
        "not not pour", "engine_kinematic or (slow and not pour)",
    ],
)  # fmt: skip
def test_an_expression_says_what_pytest_says(expression: str) -> None:
    theirs = Expression.compile(expression)
    ours = chosen_by(expression)
    for case in (POUR, HOME):
        names = [name.lower() for name in (case.id, *case.tags)]

        def matches(word: str, /, names: list[str] = names, **_: object) -> bool:
            return any(word.lower() in name for name in names)

        assert ours(case) == theirs.evaluate(matches)


def test_a_sample_is_chosen_by_its_number() -> None:
    assert chosen_by("pour[3]")(POUR)
    assert not chosen_by("pour[4]")(POUR)


@pytest.mark.parametrize("expression", ["", "and", "pour and", "(pour", "pour)", "pour home", "not", "or pour", "()"])
def test_what_is_no_expression_is_refused(expression: str) -> None:
    with pytest.raises(InvalidInput, match="was expected, not"):
        chosen_by(expression)


def _report(case: Case, outcome: CaseWord) -> CaseReport:
    return CaseReport(case, outcome, duration=1.0, command="")


def test_what_failed_is_remembered_until_it_passes(tmp_path: Path) -> None:
    folder = tmp_path / "runs" / "test"
    assert last_failed(folder) == frozenset()
    remember(folder, [_report(POUR, "failed"), _report(HOME, "crashed")])
    assert last_failed(folder) == {POUR.id, HOME.id}
    remember(folder, [_report(HOME, "passed")])  # only this one was run
    assert last_failed(folder) == {POUR.id}
    remember(folder, [_report(POUR, "passed")])
    assert last_failed(folder) == frozenset()


@pytest.mark.parametrize("text", ["", "{", "null", "3", '{"a": 1}'])
def test_a_spoilt_memory_is_none(tmp_path: Path, text: str) -> None:
    (tmp_path / "last_failed.json").write_text(text)
    assert last_failed(tmp_path) == frozenset()
