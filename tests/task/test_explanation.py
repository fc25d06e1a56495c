"""A task in English: every place is that of its value in its file, and rounds are written once without loss."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from manipcli.core.units import UnitError, parse_quantity
from manipcli.report.explanation import render_text
from manipcli.report.outline import Item, outline
from manipcli.task.explanation import Explanation, explained
from manipcli.task.load_task import load_task
from manipcli.task.origins import Origin

ROOT = Path(__file__).parents[2]
HEAD = f"""task: t
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
params: {{h: 10 cm, half: $h / 2, side: top}}
scene:
  desk: {{box: {{size: [0.7, 1.2, 0.1]}}, pose: {{xyz: [0.55, 0, 0.05]}}, fixed: true}}
  tray: {{tray: {{size: [0.2, 0.24, 0.04]}}, rests_on: desk, at: [0.45, 0.45], fixed: true}}
  red: {{box: {{size: [4 cm, 4 cm, 4 cm]}}, mass: 80 g, rests_on: desk, at: [0.45, -0.22]}}
  blue: {{box: {{size: [4 cm, 4 cm, 4 cm]}}, mass: 80 g, rests_on: desk, at: [0.55, 0.2]}}
"""
TASK = f"""{HEAD}steps:
  - pick: {{object: red, approach: {{from: $side}}}}
  - lift: {{object: red, by: [$half, 2 * $h]}}
    timeout: 20 s
    keep: {{upright: 10 deg}}
  - place:
      object: red
      at: [0.5, -10 cm]
      onto: desk
      yaw: 1.5
    on_fail: {{retry: 2, then: continue}}
  - repeat:
      each: {{block: [red, blue], color: [red, blue]}}
      steps:
        - pick: {{object: $block}}
        - lift: {{object: $block}}
        - if: {{equal: [$color, red]}}
          then: [{{place: {{object: $block, into: tray}}}}]
          else: [{{place: {{object: $block, at: start}}}}]
  - repeat: {{times: 3, steps: [{{wait: 1 s}}]}}
  - do: take.yaml
    with: {{object: red}}
  - do: take.yaml
    with: {{object: blue, height: 2 * $h}}
  - if: {{inside: {{object: red, of: tray}}}}
    then: [{{wait: 1 s}}]
    else: [{{move: {{to: home}}}}]
  - parallel: [{{move: {{to: {{panda_joint1: 10 deg}}}}}}, {{release: {{}}}}]
expect:
  - near: {{object: red, to: start, within: $half}}
  - eventually: {{not: {{at_rest: {{object: red}}}}}}
    within: 3 s
watch:
  - never: {{collision: [robot, desk]}}
vary:
  scene.red.mass: {{uniform: [50 g, 100 g]}}
"""
TAKE = """params: {object: {type: body}, height: {type: length, default: 5 cm}}
steps:
  - pick: {object: $object}
  - lift: {object: $object, by: $height}
  - place: {object: $object, at: start}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "take.yaml").write_text(TAKE)
    (tmp_path / "task.yaml").write_text(TASK)
    return tmp_path / "task.yaml"


def at(place: str) -> str:
    """The text at a place."""
    file, line, column = place.rsplit(":", 2)
    return Path(file).read_text().splitlines()[int(line) - 1][int(column) - 1 :]


def same(text: str, value: str) -> bool:
    """Whether a file's text begins with this value, apart from the unit."""
    written = re.match(r"[^\s,\]})][^,\]})]*", text)
    assert written is not None, text
    try:
        quantity = parse_quantity(value)
        found = parse_quantity(written.group().strip())
    except UnitError:
        return text.startswith(value.strip("'"))
    return found.value == pytest.approx(quantity.value, rel=1e-3)


def all_values(task: Explanation) -> Iterator[Origin]:
    for part in (*task.steps, *task.expectations, *task.watches):
        yield from part.values
    yield from task.values


def test_the_place_of_each_value_is_true(path: Path) -> None:
    values = list(all_values(explained(load_task(path))))
    assert {value.kind for value in values} == {"file", "default"}
    for value in values:
        if value.kind == "default":
            assert value.place == ""
        elif value.expression is not None:
            for parameter in value.parameters:
                text = at(parameter.place)
                assert text.startswith(parameter.expression) if parameter.expression else same(text, parameter.value)
            written = at(value.place).lstrip("\"'")
            assert written.startswith(value.expression)
        elif value.value.startswith("["):
            assert at(value.place).startswith("[")
        else:
            assert same(at(value.place), value.value), value


def test_expressions_and_defaults(path: Path) -> None:
    steps = {step.id: step for step in explained(load_task(path)).steps}
    lines = [str(value).replace(f"{path.parent}/", "") for value in steps["lift_1"].values]
    column = TASK.splitlines()[11].index("$half") + 1
    assert lines == [
        f"object 'red' (task.yaml:12:{TASK.splitlines()[11].index('red') + 1})",
        f"by[0] 5 cm (= $half, task.yaml:12:{column}; $half = 5 cm = $h / 2, task.yaml:4:26; "
        "$h = 10 cm, task.yaml:4:13)",
        f"by[1] 20 cm (= 2 * $h, task.yaml:12:{column + 7}; $h = 10 cm, task.yaml:4:13)",
        "velocity_scaling 0.5 (default)",
        "timeout 20 s (task.yaml:13:14)",
        "keep[0].upright 10 deg (task.yaml:14:21)",
    ]
    assert str(steps["pick_1"].values[1]).endswith("(= $side, " + f"{path}:4:40)")


def test_an_override_is_named(path: Path) -> None:
    task = explained(load_task(path, overrides=("scene.red.mass=90 g", "params.h=20 cm", "steps.lift_1.timeout=7 s")))
    assert "scene.red.mass 90 g (--set scene.red.mass=90 g)" in [str(value) for value in task.values]
    lift = next(step for step in task.steps if step.id == "lift_1")
    assert "It fails after 7 s." in lift.text
    assert "by 10 to 40 cm" in lift.text
    origins = {value.path: value for value in lift.values}
    assert origins["timeout"].kind == "override"
    assert "$h = 20 cm, --set params.h=20 cm" in str(origins["by[1]"])


def leaves(items: Sequence[Item]) -> Iterator[Item]:
    for item in items:
        yield item
        for _, inner in item.parts:
            yield from leaves(inner)


def test_the_whole_outline_has_every_step_once(path: Path) -> None:
    task = explained(load_task(path))
    items = list(leaves(outline(task, whole=True)))
    assert [item.step for item in items if item.step >= 0] == [*range(len(task.steps))]
    assert [item.text for item in items if item.step >= 0] == [step.text for step in task.steps]


def test_equal_rounds_and_sub_tasks_are_written_once(path: Path) -> None:
    task = explained(load_task(path))
    items = {item.id: item for item in leaves(outline(task))}
    assert items["repeat_1"].text == "For each of 2 rounds:"
    # The two rounds have different places, so each has its own steps.
    assert [heading for heading, _ in items["repeat_1"].parts] == [
        "k = 0, block = 'red', color = 'red':", "k = 1, block = 'blue', color = 'blue':"
    ]  # fmt: skip
    assert items["repeat_2"].text == "Do these steps 3 times:"
    assert [item.id for _, inner in items["repeat_2"].parts for item in inner] == ["repeat_2[k]/wait_1"]
    assert items["take_1"].text.endswith("with height = 5 cm and object = 'red':")
    assert items["take_2"].text.endswith("with height = 20 cm and object = 'blue', as in take_1.")
    assert items["take_2"].parts == ()


def test_rounds_that_differ_in_values_share_a_template(tmp_path: Path) -> None:
    steps = "[{pick: {object: $block}}, {place: {object: $block, at: {of: tray, xyz: [$x, 0, 0]}, into: tray}}]"
    names = "block: [red, blue, red], x: [1 cm, 2 cm, 3 cm]"
    path = tmp_path / "task.yaml"
    path.write_text(
        f"{HEAD}steps:\n  - repeat:\n      each: {{{names}}}\n      steps: {steps}\n  - move: {{to: home}}\n"
    )
    (round_, _) = outline(explained(load_task(path)))
    # A number in a point is not replaced, so each round is written out: nothing is lost.
    assert len(round_.parts) == 3
    path.write_text(path.read_text().replace("at: {of: tray, xyz: [$x, 0, 0]}, ", "clearance: $x, "))
    (round_, _) = outline(explained(load_task(path)))
    ((heading, items),) = round_.parts
    assert heading.count("x = ") == 3
    assert "from $x above" in items[1].text
    assert "$block" in items[0].text


def test_the_text(path: Path) -> None:
    text = render_text(explained(load_task(path)))
    for line in (
        "  1. near: At the end, the origin of 'red' is within 5 cm of where it was at the start.",
        "  2. not: At some time within 3 s, it is not true that 'red' is at rest, slower than 1 mm/s.",
        "  1. watch_never_collision: The robot stops and the run ends as soon as the robot touches 'desk' with",
        "`scene.red.mass` is a value between 50 g and 100 g, all equally likely.",
        "If 'red' is inside 'tray' when this is reached:",
        "Otherwise:",
        "At the same time:",
    ):
        assert line in text, line
    assert max(map(len, text.splitlines())) <= 120
    whole = render_text(explained(load_task(path)), values=True)
    assert all(str(value) in whole for value in all_values(explained(load_task(path))))


def test_nested_rounds_have_letters_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    inner = "{repeat: {each: {w: [1 s, 2 s]}, steps: [{wait: $w}]}}"
    path.write_text(f"{HEAD}steps:\n  - repeat: {{times: 2, steps: [{inner}, {{wait: 5 s}}]}}\n")
    items = {item.id: item for item in leaves(outline(explained(load_task(path))))}
    assert {*items} == {"repeat_1", "repeat_1[k]/repeat_1", "repeat_1[k]/repeat_1[m]/wait_1", "repeat_1[k]/wait_1"}
    assert items["repeat_1[k]/repeat_1[m]/wait_1"].text == "Hold still for $w."
    path.write_text(f"{HEAD}steps:\n  - repeat: {{times: 2, steps: [{{wait: 1 s + $index * 1 s}}]}}\n")
    items = {item.id: item for item in leaves(outline(explained(load_task(path))))}
    assert [items[f"repeat_1[{k}]/wait_1"].text for k in (0, 1)] == ["Hold still for 1 s.", "Hold still for 2 s."]
