"""Faulty structure of steps: one error, with its code, its place, and what to do instead."""

from __future__ import annotations

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.spec.load import load_task_text
from manipcli.task.vocabulary import task_spec

HEAD = """task: t
robot: r.yaml
controllers: c.yaml
params: {color: red, n: 2}
scene: {a: {box: {size: [1 cm, 1 cm, 1 cm]}, mass: 1, pose: {}}}
"""

FAULTY = (
    (270, "6:14", "not nothing", "[{if: null, then: [{wait: 1 s}]}]"),
    (205, "6:39", "expected a string", "[{sequence: [{wait: 1 s}], id: 5}, {wait: 0}]"),
    (263, "6:30", "a value is missing", "[{repeat: {each: {x: [null]}, steps: [{wait: $x}]}}]"),
    (270, "6:8", "no step is left", "[{if: {equal: [1, 2]}, then: [{wait: 1 s}]}]"),
    (262, "6:10", "`then` is missing", "[{if: {equal: [$color, red]}, else: [{wait: 1 s}]}]"),
    (261, "6:21", "`then` belongs to `if`", "[{wait: 1 s, then: [{wait: 1 s}]}]"),
    (261, "6:10", "`then` without `if`", "[{then: [{wait: 1 s}]}]"),
    (261, "6:10", "`else` without `if`", "[{else: [{wait: 1 s}]}]"),
    (261, "6:10", "`with` belongs to `do`", "[{with: {object: a}, pick: {object: a}}]"),
    (261, "6:10", "`with` without `do`", "[{with: {object: a}}]"),
    (262, "6:65", "the list has no steps", "[{if: {equal: [$color, red]}, then: [{wait: 1 s}], else: []}]"),
    (
        263,
        "6:25",
        "`block` has 2, `slot` has 1",
        "[{repeat: {each: {block: [a, b], slot: [a]}, steps: [{pick: {object: $block}}, {pick: {object: $slot}}]}}]",
    ),
    (
        263,
        "6:49",
        "`times` and `each` exclude each other",
        "[{repeat: {each: {block: [a, b]}, times: 2, steps: [{pick: {object: $block}}]}}]",
    ),
    (263, "6:18", "`times` or `each` is missing", "[{repeat: {steps: [{pick: {object: a}}]}}]"),
    (262, "6:18", "the key `steps` is missing", "[{repeat: {times: 2}}]"),
    (
        260,
        "6:60",
        "not both 'repeat' and 'pick'",
        "[{repeat: {times: 2, steps: [{pick: {object: a}}]}, pick: {object: a}}]",
    ),
    (
        260,
        "6:35",
        "not both 'sequence' and 'repeat'",
        "[{sequence: [{wait: 1 s}], repeat: {times: 2, steps: [{wait: 1 s}]}}]",
    ),
    (261, "6:30", "`steps` belongs inside `repeat`", "[{repeat: {times: 2}, steps: [{pick: {object: a}}]}]"),
    (262, "6:36", "expected a list of steps, not a mapping", "[{repeat: {times: 2, steps: {pick: {object: a}}}}]"),
    (262, "6:20", "expected a list of steps, not a mapping", "[{sequence: {wait: 1 s}}]"),
    (262, "6:44", "expected a list of steps, not a mapping", "[{if: {at_rest: {object: a}}, then: {wait: 1 s}}]"),
    (262, "6:8", "expected a list of steps, not a mapping", "{repeat: {times: 2, steps: [{wait: 1 s}]}}"),
    (263, "6:26", "a whole number from 1 to 2000, not 2.5", "[{repeat: {times: 2.5, steps: [{pick: {object: a}}]}}]"),
    (
        263,
        "6:26",
        "a whole number from 1 to 2000, not 1000000000",
        "[{repeat: {times: 1000000000, steps: [{pick: {object: a}}]}}]",
    ),
    (263, "6:26", "a whole number from 1 to 2000, not 0", "[{repeat: {times: 0, steps: [{pick: {object: a}}]}}]"),
    (262, "6:18", "expected a mapping with `steps`", "[{repeat: 5}]"),
    (
        261,
        "6:29",
        "`until` belongs next to `repeat`",
        "[{repeat: {times: 2, until: {at_rest: {object: a}}, steps: [{wait: 1 s}]}}]",
    ),
    (261, "6:29", "`pick` is a step", "[{repeat: {times: 2, pick: {object: a}}}]"),
    (203, "6:16", "known only inside its `steps`", "[{wait: $index}, {repeat: {times: 2, steps: [{wait: 1 s}]}}]"),
    (263, "6:29", "expected a list of values", "[{repeat: {each: {x: a}, steps: [{wait: $x}]}}]"),
    (263, "6:25", "expected names with lists", "[{repeat: {each: [a, b], steps: [{wait: $x}]}}]"),
    (263, "6:26", "is not a valid parameter name", "[{repeat: {each: {index: [a, b]}, steps: [{wait: $index}]}}]"),
    (210, "6:73", "duplicate id 'w'", "[{repeat: {times: 2, steps: [{wait: 1 s, id: w}, {wait: 1 s, id: w}]}}]"),
    (210, "6:76", "t.yaml:6:9", "[{repeat: {times: 2, steps: [{wait: 1 s}]}, id: w}, {wait: 1 s, id: w}]"),
    (203, "6:22", "did you mean 'wait'", "[{sequence: [{wiat: 1 s}]}]"),
    (203, "6:10", "did you mean 'sequence'", "[{sequnce: [{wait: 1 s}]}]"),
    (203, "6:10", "did you mean 'repeat'", "[{repeats: {times: 2, steps: [{wait: 1 s}]}}]"),
    (261, "6:35", "`keep` cannot be next to `sequence`", "[{sequence: [{wait: 1 s}], keep: {upright: 10 deg}}]"),
    (261, "6:35", "unknown key 'untill'", "[{sequence: [{wait: 1 s}], untill: {at_rest: {object: a}}}]"),
    (203, "6:43", "did you mean 'at_rest'", "[{sequence: [{wait: 1 s}], until: {at_rset: {object: a}}}]"),
    (204, "6:44", "must be more than 0", "[{sequence: [{wait: 1 s}], timeout: -3 s}]"),
    (261, "6:61", "have no other values", "[{sequence: [{wait: 1 s}], on_fail: {retry: 2, with: {n: 3}}}]"),
    (274, "6:20", "expected 2 steps", "[{parallel: [{wait: 1 s}]}]"),
    (274, "6:34", "is one step, not `sequence`", "[{parallel: [{wait: 1 s}, {sequence: [{wait: 1 s}]}]}]"),
    (270, "6:22", "compares two values", "[{if: {equal: [$color]}, then: [{wait: 1 s}]}]"),
    (270, "6:29", "cannot compare a length with a mass", "[{if: {equal: [5 cm, 3 kg]}, then: [{wait: 1 s}]}]"),
    (203, "6:23", "did you mean 'color'", "[{if: {equal: [$colour, red]}, then: [{wait: 1 s}]}]"),
    (203, "6:15", "did you mean 'inside'", "[{if: {insde: {object: a, of: b}}, then: [{wait: 1 s}]}]"),
    (270, "6:14", "compare it: `if: {equal: [$color, ...]}`", "[{if: $color, then: [{wait: 1 s}]}]"),
    (261, "6:37", "`then` belongs next to `if`", "[{if: {at_rest: {object: a}, then: [{wait: 1 s}]}}]"),
    (
        201,
        "6:54",
        "did you mean 'object'",
        "[{if: {equal: [$color, blue]}, then: [{pick: {objct: a}}], else: [{wait: 1 s}]}]",
    ),
    (
        208,
        "6:61",
        "it names the branch",
        "[{if: {at_rest: {object: a}}, then: [{wait: 1 s, id: else}], else: [{wait: 1 s}]}]",
    ),
    (208, "6:37", "is not a valid id", "[{sequence: [{wait: 1 s, id: a/b}]}]"),
    (208, "6:25", "is not a valid id", "[{wait: 1 s, id: a/b}]"),
    (207, "6:58", "it is given at t.yaml:6:35", "[{repeat: {each: {x: [1 s, 2 kg]}, steps: [{wait: $x}]}}]"),
    (264, "6:14", "cannot be read", "[{do: sub.yaml}]"),
    (261, "6:29", "cannot be next to `include`", "[{include: own.yaml, id: x}]"),
    (203, "6:10", "write `repeat: {times: 3", "[{loop: {times: 2, steps: [{wait: 1 s}]}}]"),
    (260, "6:10", "write `repeat: {times: 3", "[{while: {at_rest: {object: a}}, steps: [{wait: 1 s}]}]"),
    (260, "6:10", "write `do: FILE.yaml", "[{call: put.yaml, with: {object: a}}]"),
    (203, "6:10", "write `if: {CONDITION}", "[{when: {at_rest: {object: a}}}]"),
    (261, "6:21", "write `repeat: {times: 3", "[{repeat: 3, steps: [{wait: 1 s}]}]"),
    (261, "6:10", "write `sequence: [STEP", "[{steps: [{wait: 1 s}], id: g}]"),
    (260, "6:10", "`repeat: {times: 3, steps", "[{wait: 1 s, repeat: 3}]"),
    (261, "6:19", "`each: {block: [...]}`", "[{repeat: {block: [a], steps: [{pick: {object: $block}}]}}]"),
    (
        261,
        "6:59",
        "write `else: [{if:",
        "[{if: {at_rest: {object: a}}, then: [{wait: 1 s}], elif: [{wait: 1 s}]}]",
    ),
    (262, "6:20", "write `sequence: [STEP", "[{sequence: {steps: [{wait: 1 s}]}}]"),
    (262, "6:20", "write `parallel: [STEP, STEP]`", "[{parallel: {arm: {move: {to: home}}, hand: {release: {}}}}]"),
    (261, "6:24", "`with: {object: ...}`", "[{do: put.yaml, object: a}]"),
    (264, "6:14", "write `do: FILE.yaml", "[{do: {file: put.yaml}}]"),
    (270, "6:23", "write `$color`", "[{if: {equal: [color, red]}, then: [{wait: 1 s}]}, {wait: 1 s}]"),
    (211, "6:14", "`{equal: [A, B]}`", "[{if: $color == red, then: [{wait: 1 s}]}]"),
    (
        203,
        "6:80",
        "known only inside its `repeat`",
        "[{repeat: {each: {t: [1 s]}, steps: [{wait: $t}]}}, {wait: 2 s}, {wait: $t}]",
    ),
    (203, "6:63", "did you mean 'block'", "[{repeat: {each: {block: [a]}, steps: [{pick: {object: $blok}}]}}]"),
    (
        211,
        "6:71",
        "`.` does not select a key",
        "[{repeat: {each: {block: [{name: a}]}, steps: [{pick: {object: $block.name}}]}}]",
    ),
    (202, "6:37", "write `on_fail: continue`", "[{wait: 1 s, id: w, on_fail: {then: continue}}]"),
)


@pytest.mark.parametrize(("number", "place", "words", "steps"), FAULTY)
def test_a_fault_is_told_once_at_its_place(number: int, place: str, words: str, steps: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        load_task_text(f"{HEAD}steps: {steps}\n", "t.yaml", model=task_spec())
    (found,) = refused.value.findings
    assert (found.code, f"{found.place}") == (f"TASK{number}", f"t.yaml:{place}")
    assert words in f"{found.message} {found.hint}"
    assert "lift" not in (found.hint or "")


@pytest.mark.parametrize(
    ("number", "words", "steps"),
    [
        (271, "`color` hides the parameter", "[{repeat: {each: {color: [a]}, steps: [{pick: {object: $color}}]}}]"),
        (
            275,
            "holds in no round",
            "[{repeat: {each: {x: [Red, Blue]}, steps: [{if: {equal: [$x, red]}, then: [{wait: 1 s}]}]}}, {wait: 1 s}]",
        ),
        (272, "`$x` is not used", "[{repeat: {each: {x: [1, 2]}, steps: [{wait: $index}]}}]"),
    ],
)
def test_what_may_be_meant_is_a_warning(number: int, words: str, steps: str) -> None:
    (found,) = load_task_text(f"{HEAD}steps: {steps}\n", "t.yaml", model=task_spec()).findings
    assert (found.code, found.severity) == (f"TASK{number}", "warning") and words in found.message


def test_blocks_are_no_key() -> None:
    with pytest.raises(InvalidInput) as refused:
        load_task_text(f"{HEAD}blocks: []\nsteps: [{{wait: 0}}]\n", "t.yaml", model=task_spec())
    assert [finding.code for finding in refused.value.findings] == ["TASK201"]


@pytest.mark.parametrize("values", ["[red, Blue]", "[red, red]"])
def test_a_condition_that_holds_in_a_round_is_no_warning(values: str) -> None:
    steps = f"[{{repeat: {{each: {{x: {values}}}, steps: [{{if: {{equal: [$x, red]}}, then: [{{wait: 1 s}}]}}]}}}}]"
    assert load_task_text(f"{HEAD}steps: {steps}\n", "t.yaml", model=task_spec()).findings == ()


def test_a_switch_of_the_task_is_no_warning() -> None:
    steps = "[{repeat: {times: 2, steps: [{if: {equal: [$color, blue]}, then: [{wait: 1 s}]}, {wait: 1 s}]}}]"
    assert load_task_text(f"{HEAD}steps: {steps}\n", "t.yaml", model=task_spec()).findings == ()
