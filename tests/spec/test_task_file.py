"""Task files: every mistake is found at once, at its line and column, with what was expected and the nearest name."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, model_validator

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.registry import Seam
from manipcli.simulate.sensors import SENSORS
from manipcli.spec.base import Model
from manipcli.spec.load import load_task, load_task_text
from manipcli.spec.located import Located
from manipcli.spec.planner import PlannerSpec
from manipcli.spec.quantity import Angle, JointValue, Length, Time
from manipcli.spec.resolved import resolved
from manipcli.spec.retry import retried
from manipcli.spec.robot import PoseSpec
from manipcli.spec.schema import task_schema
from manipcli.spec.task import TaskSpec
from manipcli.spec.unions import task_model


class Move(Model):
    """Go somewhere."""

    to: str | dict[str, JointValue] | None = None
    pose: PoseSpec | None = None
    path: Literal["free", "linear"] = Field("free", description="`linear`: straight. Default `free`.")
    speed: Annotated[float, Field(gt=0, le=1)] = 1.0


class Pour(Model):
    """Tilt something."""

    object: str
    tilt: Angle
    count: int = 1


class Wait(Model):
    """Do nothing."""

    duration: Time = 0.0

    @model_validator(mode="before")
    @classmethod
    def _short(cls, value: object) -> object:
        return {"duration": value} if isinstance(value, str | int | float) else value


class Inside(Model):
    """One thing in another."""

    object: str
    of: str


class Near(Model):
    """One thing near a place."""

    object: str
    to: Literal["start"] | tuple[Length, Length, Length] = "start"
    within: Length


class Solver(Model):
    """Settings of an engine."""

    solver_iterations: int = 200


class Plain(Model):
    """An engine without settings."""


@dataclass(frozen=True)
class Member:
    name: str
    spec: type[Model]


STEPS = Seam("step", (Member("move", Move), Member("pour", Pour), Member("wait", Wait)))
CONDITIONS = Seam("condition", (Member("inside", Inside), Member("near", Near)))
ENGINES = Seam("engine", (Member("pybullet", Solver), Member("kinematic", Plain)))
PATH_PLANNERS = Seam("path planner", (Member("rrt_connect", PlannerSpec),))
MODEL = task_model(STEPS, CONDITIONS, ENGINES, PATH_PLANNERS, SENSORS)

TASK = """\
task: pour
robot: robot.yaml
controllers: controllers.yaml
params: {tilt: 120 deg, n: 2}
scene:
  cup: {cup: {radius: 36 mm, height: 110 mm}, mass: 150 g, rests_on: desk, at: [0.75, 0]}
  desk: {box: {size: [0.6, 1.0, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}
steps:
  - move: {to: home}
  - pour: {object: cup, tilt: $tilt, count: $n}
    until: {inside: {object: ball, of: cup}}
    timeout: 8 s
  - id: last
    wait: 250 ms
  - wait:
expect:
  - near: {object: cup, to: start, within: 2 cm}
"""


def load(text: str, *overrides: str, seed: int | None = None) -> Located[TaskSpec]:
    return load_task_text(text, "t.yaml", model=MODEL, overrides=overrides, seed=seed)


def findings(text: str, *overrides: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(InvalidInput) as caught:
        load(text, *overrides)
    return caught.value.findings


def only(text: str, *overrides: str) -> Diagnostic:
    (finding,) = findings(text, *overrides)
    return finding


def test_a_step_knows_its_verb_body_and_id() -> None:
    spec = load(TASK).spec
    assert [step.verb for step in spec.steps] == ["move", "pour", "wait", "wait"]
    assert [step.id for step in spec.steps] == ["move_1", "pour_1", "last", "wait_2"]
    pour = spec.steps[1]
    assert pour.body == Pour(object="cup", tilt="120 deg", count=2)
    assert pour.timeout == 8.0
    assert pour.until is not None
    assert (pour.until.name, pour.until.body) == ("inside", Inside(object="ball", of="cup"))
    assert spec.steps[2].body == Wait(duration=0.25)
    assert spec.steps[3].body == Wait()
    assert spec.expect[0].body == Near(object="cup", within=0.02)
    assert spec.scene["cup"].mass == 0.15


def test_later_stages_can_point_at_any_value() -> None:
    located = load(TASK)
    assert str(located.place("scene", "cup", "mass")) == "t.yaml:6:53"
    assert str(located.place("steps", 0, "move", "to")) == "t.yaml:9:16"
    assert str(located.place("steps", 1, "until", "inside", "object")) == "t.yaml:11:30"
    assert str(located.source.key_place("scene", "desk", "fixed")) == "t.yaml:7:69"
    assert str(located.place("scene", "cup", "friction")) == "t.yaml:6:8"  # not written: the block around it


@pytest.mark.parametrize(
    ("written", "message", "hint"),
    [
        (
            "always: {any: [{near: {object: a, within: 1 kg}}]}",
            "18:47: error[TASK207]: expect[1].always.any[0].near.within:",
            "",
        ),
        (
            "always: {any: [{nea: {}}]}",
            "18:21: error[TASK203]: expect[1].always.any[0]: unknown condition 'nea'",
            "'near'",
        ),
        (
            "nver: {near: {}}",
            "18:5: error[TASK203]: expect[1]: unknown expectation 'nver'",
            "did you mean 'never' or 'near'?",
        ),
        ("all: {near: {}}", "18:10: error[TASK205]: expect[1].all: expected a list", ""),
        ("never: []", "18:12: error[TASK209]: expect[1].never: expected a condition: a mapping with one name", ""),
        (
            "near: {object: a, within: 1}\n    durng: x",
            "19:5: error[TASK201]: expect[1]: unknown key 'durng'",
            "'during'",
        ),
        (
            "near: {object: a, within: 1}\n    at: x\n    during: y",
            "20:5: error[TASK208]: expect[1]: both `at` and `during` are given",
            "for an interval",
        ),
        (
            "never: {near: {object: a, within: 1}}\n    at: x",
            "19:5: error[TASK208]: expect[1]: `at` cannot be combined",
            "",
        ),
        (
            "near: {object: a, within: 1}\n    within: 2 s",
            "19:5: error[TASK208]: expect[1]: `within` is only allowed",
            "eventually",
        ),
        (
            "near: {object: a, within: 1}\n    id: 2nd",
            "19:9: error[TASK208]: expect[1].id: '2nd' is not a valid id",
            "",
        ),
        (
            "near: {object: a, within: 1}\n    id: x\n  - near: {object: a, within: 1}\n    id: x",
            "21:9: error[TASK210]",
            "",
        ),
    ],
)
def test_mistakes_in_expectations_are_told_where_they_are(written: str, message: str, hint: str) -> None:
    (found,) = findings(f"{TASK}  - {written}\n")
    assert str(found).startswith(f"t.yaml:{message}"), str(found)
    assert hint in (found.hint or "")


@pytest.mark.parametrize(
    ("old", "new", "expected", "hint"),
    [
        (
            "mass: 150 g",
            "mas: 150 g",
            "t.yaml:6:47: error[TASK201]: scene.cup: unknown key 'mas'",
            "did you mean 'mass'?",
        ),
        (
            "mass: 150 g",
            "mass: 150 mm",
            "t.yaml:6:53: error[TASK207]: scene.cup.mass: '150 mm' is a length; expected a mass (kg, g, mg, t)",
            "",
        ),
        (
            "mass: 150 g",
            "mass: '150'",
            "t.yaml:6:53: error[TASK207]: scene.cup.mass: '150' has no unit; expected a mass (kg, g, mg, t)",
            "write 150 without quotes",
        ),
        (
            "mass: 150 g",
            "mass: true",
            "t.yaml:6:53: error[TASK205]: scene.cup.mass: expected a mass: a number in kg, "
            "or a string such as '5 g', not true",
            "",
        ),
        (
            "mass: 150 g",
            "mass: -1 g",
            "t.yaml:6:53: error[TASK204]: scene.cup.mass: must be more than 0, not '-1 g'",
            "",
        ),
        (
            "mass: 150 g",
            "friction: '1.0'",
            "t.yaml:6:57: error[TASK205]: scene.cup.friction: expected a number, not '1.0'",
            "remove the quotes",
        ),
        ("mass: 150 g", "friction: .nan", "t.yaml:6:57: error[YAML111]: '.nan' is not a finite number", ""),
        (
            "fixed: true",
            "fixed: yes",
            "t.yaml:7:76: error[TASK205]: scene.desk.fixed: expected true or false, not 'yes'",
            "write true",
        ),
        (
            "[0.6, 1.0, 0.4]",
            "[0.6, 1.0]",
            "t.yaml:7:22: error[TASK206]: scene.desk.box.size: expected 3 items, got 2",
            "",
        ),
        (
            "radius: 36 mm, ",
            "",
            "t.yaml:6:14: error[TASK202]: scene.cup.cup: the key 'radius' is missing",
            "Outer radius",
        ),
        (
            "to: home",
            "to: 3",
            "t.yaml:9:16: error[TASK205]: steps[0].move.to: expected a string, or a mapping, not 3",
            "",
        ),
        (
            "to: home",
            "to: {j: 4 kg}",
            "t.yaml:9:20: error[TASK207]: steps[0].move.to.j: '4 kg' is a mass; expected "
            "an angle (rad, deg, mrad, rev) or a length (m, cm, mm, um, km, in)",
            "",
        ),
        (
            "to: home",
            "path: liner",
            "t.yaml:9:18: error[TASK203]: steps[0].move.path: expected one of 'free' or 'linear', not 'liner'",
            "did you mean 'linear'?",
        ),
        (
            "to: home",
            "path: arc",
            "t.yaml:9:18: error[TASK203]: steps[0].move.path: expected one of 'free' or 'linear', not 'arc'",
            "path: `linear`: straight. Default `free`.",
        ),
        (
            "to: start",
            "to: strat",
            "t.yaml:17:29: error[TASK203]: expect[0].near.to: expected one of 'start', or a list, not 'strat'",
            "",
        ),
        (
            "- move: {to: home}",
            "- mvoe: {to: home}",
            "t.yaml:9:5: error[TASK203]: steps[0]: unknown verb 'mvoe', expected one of move, pour, wait",
            "did you mean 'move'?",
        ),
        (
            "- move: {to: home}",
            "- move",
            "t.yaml:9:5: error[TASK209]: steps[0]: expected a step: a mapping with one verb",
            "write `move:` with a colon",
        ),
        (
            "- move: {to: home}",
            "- {timeout: 1}",
            "t.yaml:9:5: error[TASK209]: steps[0]: a step needs a verb: one of move, pour, wait",
            "",
        ),
        (
            "- move: {to: home}",
            "- {move: {}, wait: 1 s}",
            "t.yaml:9:16: error[TASK209]: steps[0]: a step has exactly one verb, not both 'move' and 'wait'",
            "",
        ),
        (
            "timeout: 8 s",
            "timout: 8 s",
            "t.yaml:12:5: error[TASK201]: steps[1]: unknown key 'timout'",
            "did you mean 'timeout'?",
        ),
        (
            "timeout: 8 s",
            "timeout: 0",
            "t.yaml:12:14: error[TASK204]: steps[1].timeout: must be more than 0, not 0",
            "",
        ),
        (
            "until: {inside:",
            "until: {insde:",
            "t.yaml:11:13: error[TASK203]: steps[1].until: unknown condition 'insde', expected one of inside, near",
            "did you mean 'inside'?",
        ),
        (
            "until: {inside: {object: ball, of: cup}}",
            "until: {}",
            "t.yaml:11:12: error[TASK209]: steps[1].until: a condition needs a name: one of inside, near",
            "",
        ),
        ("of: cup}", "off: cup}", "t.yaml:11:36: error[TASK201]", "did you mean 'of'?"),
        ("- id: last", "- id: move_1", "", ""),
        ("- id: last", "- id: 'a b'", "t.yaml:13:9: error[TASK208]: steps[2].id: 'a b' is not a valid id", "letters"),
        (
            "wait: 250 ms",
            "wait: 250 mm",
            "t.yaml:14:11: error[TASK207]: steps[2].wait: '250 mm' is a length; expected a time (s, ms, us, min, h)",
            "",
        ),
        ("task: pour", "task: 3", "t.yaml:1:7: error[TASK205]: task: expected a string, not 3", "put it in quotes"),
        ("task: pour\n", "", "t.yaml:1:1: error[TASK202]: the key 'task' is missing", "The name of the task"),
        (
            "task: pour",
            "task: pour\nversion: 9.9.9\nnew_key: 1",
            "t.yaml:2:10: error[TASK213]: version: this file needs manipcli >= 9.9.9",
            "",
        ),
        (
            "scene:",
            "simulation: {step: 2 ms, control_period: 3 ms}\nscene:",
            "t.yaml:5:42: error[TASK208]: "
            "simulation.control_period: control_period (0.003 s) must be a whole multiple of step (0.002 s)",
            "write 0.004",
        ),
        (
            "scene:",
            "simulation: {step: 10 ms, control_period: 60 ms}\nscene:",
            "t.yaml:5:43: error[TASK204]: simulation.control_period: must be at most 0.05 s, not '60 ms'",
            "",
        ),
        (
            "scene:",
            "simulation: {step: 0}\nscene:",
            "t.yaml:5:20: error[TASK204]: simulation.step: must be at least 1e-06",
            "",
        ),
        (
            "scene:",
            "simulation: {seed: 1.5}\nscene:",
            "t.yaml:5:20: error[TASK205]: simulation.seed: expected a whole number, not 1.5",
            "",
        ),
        (
            "xyz: [0.85, 0, 0.2]",
            "quat_xyzw: [1, 1, 0, 0]",
            "t.yaml:7:58: error[TASK204]: scene.desk.pose.quat_xyzw: not a unit quaternion: its norm is 1.41421",
            "x, y, z, w",
        ),
        (
            "xyz: [0.85, 0, 0.2]",
            "quat: [1, 0, 0, 0]",
            "t.yaml:7:47: error[TASK201]: scene.desk.pose: unknown key 'quat'",
            "did you mean 'quat_xyzw'?",
        ),
        (
            "tilt: $tilt",
            "tilt: $tlit",
            "t.yaml:10:31: error[TASK203]: steps[1].pour.tilt: unknown parameter '$tlit'",
            "did you mean 'tilt'?",
        ),
        (
            "tilt: $tilt",
            "tilt: 2 * $tilt + 3 s",
            "t.yaml:10:31: error[TASK211]: steps[1].pour.tilt: cannot add an angle and a time",
            "",
        ),
        ("tilt: $tilt", "tilt: $n", "", ""),
    ],
)
def test_a_mistake_is_told_at_the_offending_value(old: str, new: str, expected: str, hint: str) -> None:
    assert old in TASK
    text = TASK.replace(old, new, 1)
    if not expected:
        load(text)
        return
    first = findings(text)[0]
    assert str(first).startswith(expected)
    assert hint in (first.hint or "")


@pytest.mark.parametrize("text", ["", "# nothing\n", "[1, 2]", "just words", "3"])
def test_a_file_that_is_no_mapping_says_which_keys_belong_in_it(text: str) -> None:
    finding = only(text)
    assert finding.code == "TASK200"
    assert "expected a mapping with the keys task, robot, controllers, steps" in finding.message
    assert str(finding.place) == "t.yaml:1:1"


def test_all_findings_of_a_file_are_told_at_once_in_its_order() -> None:
    text = TASK.replace("150 g", "150 q").replace("to: home", "too: home").replace("8 s", "8 kg").replace("2 cm", "x")
    assert [str(finding.place) for finding in findings(text)] == [
        "t.yaml:6:53",
        "t.yaml:9:12",
        "t.yaml:12:14",
        "t.yaml:17:44",
    ]


@pytest.mark.parametrize("name", ["../../escape", "a/b", ".", "..", ".hidden", "a ", "", "x\\ty", "n" * 101, "a\\\\b"])
def test_a_task_cannot_be_called_what_no_file_can(name: str) -> None:
    assert str(only(TASK.replace("task: pour", f'task: "{name}"'))).startswith("t.yaml:1:7: error[")


@pytest.mark.parametrize("name", ["pour", "pour 2", "v1.2-beta+x", "茶碗", "p", "n" * 100])
def test_a_task_is_called_what_a_file_can(name: str) -> None:
    assert load(TASK.replace("task: pour", f'task: "{name}"')).spec.task == name


def test_a_generated_id_gives_way_to_a_given_one() -> None:
    spec = load(TASK.replace("id: last", "id: wait_2")).spec
    assert [step.id for step in spec.steps] == ["move_1", "pour_1", "wait_2", "wait_3"]


@pytest.mark.parametrize(
    ("watch", "message", "hint"),
    [
        ("near: {object: a, within: 1}", "unknown watch 'near'", "write `always: {near: ...}` or `never: {near: ...}`"),
        ("not: {near: {}}", "unknown watch 'not'", "write `always: {not: ...}` or `never: {not: ...}`"),
        ("alway: {}", "unknown watch 'alway'", "did you mean 'always'?"),
        ("zzz: {}", "unknown watch 'zzz'", "watches: never, always, id, during"),
        ("[]", "expected a watch", "watches: never, always"),
    ],
)
def test_what_is_watched_stands_under_always_or_never(watch: str, message: str, hint: str) -> None:
    found = only(f"{TASK}watch:\n  - {watch}\n")
    assert message in found.message
    assert found.hint == hint


def test_a_parameter_of_a_retry_that_the_task_does_not_have_is_told_with_what_to_write() -> None:
    task = TASK.replace("params: {tilt: 120 deg, n: 2}\n", "").replace("$tilt", "1").replace("$n", "1")
    text = task.replace("timeout: 8 s", "on_fail: {retry: 1, with: {tilt: 2}}")
    with pytest.raises(InvalidInput) as caught:
        retried(load(text), 1)
    (found,) = caught.value.findings
    assert "`params: {tilt: ...}`" in (found.hint or "")


def test_an_id_is_taken_once() -> None:
    text = TASK.replace("- move: {to: home}", "- id: last\n    move: {to: home}")
    finding = only(text)
    assert str(finding).startswith(
        "t.yaml:14:9: error[TASK210]: steps[2].id: duplicate id 'last': steps[0] has it already"
    )


def test_a_watch_has_no_id_of_an_expectation_for_reports_name_both_in_one_list() -> None:
    near = "{near: {object: cup, to: start, within: 1 m}}"
    text = "task: t\nrobot: r\ncontrollers: c\nsteps: [{wait: 1 s, id: both}]\n"
    text += f"expect: [{{always: {near}, id: both}}]\n"
    text += f"watch: [{{always: {near}, id: both}}, {{always: {near}, id: own}}]\n"
    finding = only(text)
    assert finding.message == "watch[0].id: duplicate id 'both': expect[0] has it already"
    assert finding.hint == "choose another: expectations and watches share their ids"


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("$tilt", 120.0),
        ("2 * $tilt + 5 deg", 245.0),
        ("$tilt/2", 60.0),
        ("-($tilt - 90 deg) * 3", -90.0),
        ("$tilt / $n", 60.0),
        ("$tilt * 50 %", 60.0),
        ("90 deg / 1 s * 2 s * $n / 2", 180.0),
        ("+ $tilt", 120.0),
    ],
)
def test_expressions_compute_with_units(expression: str, value: float) -> None:
    spec = load(TASK.replace("$tilt", expression)).spec
    body = spec.steps[1].body
    assert isinstance(body, Pour)
    assert body.tilt == pytest.approx(value * 3.141592653589793 / 180, rel=1e-14)


@pytest.mark.parametrize(
    "expression",
    [
        "$tilt +",
        "($tilt",
        "$tilt)",
        "$tilt / 0",
        "$tilt ** 2",
        "$tilt.real",
        "${tilt}",
        "a$tilt",
        "$tilt $tilt",
        "$tilt * 1e308 * 1e308",
        "(" * 60 + "$tilt" + ")" * 60,
        "__import__('os') + $tilt",
    ],
)
def test_what_is_no_expression_is_refused_at_its_place(expression: str) -> None:
    finding = only(TASK.replace("$tilt", f'"{expression}"'))
    assert (finding.code, str(finding.place)) == ("TASK211", "t.yaml:10:31")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("30 deg + 5 deg", 35.0),
        ("2 * (30 deg - 5 deg)", 50.0),
        ("90 deg / 1 s * 2 s", 180.0),
        ("$sum", 50.0),
        ("2 * $sum + 5 deg", 105.0),
    ],
)
def test_arithmetic_needs_no_parameter(text: str, value: float) -> None:
    params = "params: {sum: 30 deg + 20 deg, n: 2}"
    spec = load(TASK.replace("params: {tilt: 120 deg, n: 2}", params).replace("$tilt", text)).spec
    body = spec.steps[1].body
    assert isinstance(body, Pour)
    assert body.tilt == pytest.approx(value * 3.141592653589793 / 180, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "expected", "hint"),
    [
        ("30 deg + 5 mm", "cannot add an angle and a length; expected an angle", ""),
        ("30 mm + 5 mm", "'30 mm + 5 mm' is a length; expected an angle", ""),
        ("30 + 5", "'30 + 5' has no unit; expected an angle", "add units to its numbers"),
        ("30 deg / 0", "'30 deg / 0' divides by zero", ""),
        ("30 deg + 5 dge", "unknown unit 'dge'", "did you mean 'deg'?"),
        ("30 deg * 1e308 * 1e308", "exceeds the largest number", ""),
        ("$$n + 5 deg", "'$n + 5 deg' is not a number with a unit", "write a number, a space and a unit"),
    ],
)
def test_arithmetic_that_is_no_such_quantity_is_told(text: str, expected: str, hint: str) -> None:
    finding = only(TASK.replace("$tilt", text))
    assert (finding.code, str(finding.place)) == ("TASK207", "t.yaml:10:31")
    assert expected in finding.message
    assert hint in (finding.hint or "")


def test_parameters_build_on_those_above_them_and_may_be_texts() -> None:
    text = TASK.replace("{tilt: 120 deg, n: 2}", "{half: 60 deg, tilt: 2 * $half, n: 2, what: cup}")
    spec = load(text.replace("pour: {object: cup", "pour: {object: $what")).spec
    assert spec.steps[1].body == Pour(object="cup", tilt="120 deg", count=2)
    finding = only(TASK.replace("{tilt: 120 deg, n: 2}", "{tilt: 2 * $half, half: 60 deg, n: 2}").replace("$tilt", "1"))
    assert (finding.code, str(finding.place)) == ("TASK203", "t.yaml:4:16")


def test_what_is_wrong_with_a_parameter_is_told_once_and_there() -> None:
    """Not again where it is used: the values of those, and of what is computed from them, are not known."""
    wrong = "{b: $a / 2, a: 30 deg, c: $c, d: [1, 2], e: $bb, f: 2 * $e, 1a: 3, ä: 1, a b: 2}"
    used = "- wait: $b\n  - wait: 2 * $c + 1 s\n  - wait: $d\n  - wait: $e\n  - wait: $f"
    text = TASK.replace("{tilt: 120 deg, n: 2}", wrong).replace("$tilt, count: $n", "1")
    text = text.replace("- wait:\n", f"{used}\n")
    assert used in text
    found = sorted((str(f.place), f.message, f.hint or "") for f in findings(text))
    expected = [
        ("13", "params.b: the parameter '$a' is used before it is defined", "move 'a' above 'b'"),
        ("35", "params.c: the parameter '$c' depends on itself", "value"),
        ("42", "params.d: expected true or false", ""),
        ("53", "params.e: unknown parameter '$bb'", "did you mean 'b'?"),
        ("69", "params: '1a' is not a valid parameter name", "begin with a letter"),
        ("76", "params: 'ä' is not", "from a to z"),
        ("82", "params: 'a b' is not", "letters, digits and '_'"),
    ]
    assert [place for place, _, _ in found] == [f"t.yaml:4:{column}" for column, _, _ in expected]
    for (_, message, hint), (_, start, part) in zip(found, expected, strict=True):
        assert message.startswith(start)
        assert part in hint


def test_a_value_that_is_no_yaml_hides_nothing_and_is_told_once() -> None:
    text = TASK.replace(
        "task: pour", "task: pour\ntask: twice\nsimulatoin: {}\nsimulation: {step: .nan, settle: !!float 1}"
    )
    text = text.replace("{tilt: 120 deg, n: 2}", "{tilt: .inf, n: 2, n: 3}")
    told = [(f.code, f.place and (f.place.line, f.place.column)) for f in findings(text)]
    assert sorted(told, key=lambda one: one[1] or (0, 0)) == [
        ("YAML106", (2, 1)),
        ("TASK201", (3, 1)),
        ("YAML111", (4, 20)),
        ("YAML104", (4, 34)),
        ("YAML111", (7, 16)),
        ("YAML106", (7, 28)),
    ]


def test_a_doubled_dollar_is_a_dollar() -> None:
    spec = load(TASK.replace("task: pour", "task: pour\ndescription: costs $5 or $$tilt")).spec
    assert spec.description == "costs $5 or $tilt"
    assert load(resolved(spec)).spec == spec


@pytest.mark.parametrize(
    ("override", "path", "value"),
    [
        ("scene.cup.mass=80 g", "scene.cup.mass", 0.08),
        ("scene.cup.mass = 0.08", "scene.cup.mass", 0.08),
        ("scene.cup.friction=1e-3", "scene.cup.friction", 1e-3),
        ("scene.cup.at=[0.7, 2 cm]", "scene.cup.at", (0.7, 0.02)),
        ("simulation.seed=7", "simulation.seed", 7),
        ("simulation={seed: 7}", "simulation.seed", 7),
        ("steps.1.pour.count=5", "steps.1.body.count", 5),
        ("steps.pour_1.pour.count=5", "steps.1.body.count", 5),
        ("steps.last.wait=3 s", "steps.2.body.duration", 3.0),
        ("steps.wait_2.wait.duration=3 s", "steps.3.body.duration", 3.0),
        ("params.n=9", "steps.1.body.count", 9),
        ("params.tilt=1 rad", "steps.1.body.tilt", 1.0),
        ("steps.1.pour.tilt=$tilt * 0", "steps.1.body.tilt", 0.0),
        ("steps.1.timeout=null", "steps.1.timeout", None),
        ("scene.desk.fixed=null", "scene.desk.fixed", False),
        ("simulation.step=null", "simulation.step", 0.001),
        ("robot=other.yaml", "robot", "other.yaml"),
        ("robot.limits.j.velocity=3", "robot", "robot.yaml"),
        ("scene.new={sphere: {radius: 1 cm}}", "scene.new.sphere.radius", 0.01),
        ("frames.f={parent: cup}", "frames.f.parent", "cup"),
    ],
)
def test_an_override_sets_any_field(override: str, path: str, value: object) -> None:
    found: object = load(TASK, override).spec
    for part in path.split("."):
        if isinstance(found, dict):
            found = found[part]
        elif isinstance(found, tuple) and part.isdecimal():
            found = found[int(part)]
        else:
            found = getattr(found, part)
    assert found == value


@pytest.mark.parametrize(
    ("override", "expected", "hint"),
    [
        ("scene.cup.mas=80 g", "--set scene.cup.mas=80 g: error[TASK201]: scene.cup: unknown key 'mas'", "'mass'"),
        ("scene.cup.mass=80 mm", "--set scene.cup.mass=80 mm: error[TASK207]: scene.cup.mass: '80 mm' is a length", ""),
        ("scene.cap.mass=1", "--set scene.cap.mass=1: error[TASK212]: there is no 'cap' in 'scene'", "'cup'"),
        ("params.tlit=1", "--set params.tlit=1: error[TASK212]: there is no 'tlit' in 'params'", "'tilt'"),
        ("scnee.cup.mass=1", "--set scnee.cup.mass=1: error[TASK212]: there is no 'scnee' at the top", "'scene'"),
        ("simulation.sed.x=1", "--set simulation.sed.x=1: error[TASK212]: there is no 'sed' in 'simulation'", "'seed'"),
        ("steps.9.pour=3", "--set steps.9.pour=3: error[TASK212]: there is no item '9': 'steps' has 4 items", "last"),
        ("steps.por_1.pour=3", "--set steps.por_1.pour=3: error[TASK212]: there is no item 'por_1'", "'pour_1'"),
        ("task.x=1", "--set task.x=1: error[TASK212]: 'task' has no 'x': it is 'pour'", ""),
        ("nothing", "--set nothing: error[TASK212]: expected PATH=VALUE", "--set scene.cup.mass"),
        ("=3", "--set =3: error[TASK212]: expected PATH=VALUE", ""),
        ("scene..mass=3", "--set scene..mass=3: error[TASK212]: expected PATH=VALUE", ""),
        ("task=", "--set task=: error[TASK212]: the value is missing", ""),
        ("task=[1", "--set task=[1: error[YAML100]", ""),
        ("scene.cup.mass=$mas", "--set scene.cup.mass=$mas: error[TASK203]: scene.cup.mass: unknown parameter", ""),
        ("task=\x1b[31m", "--set task=\\x1b[31m: error[YAML102]", ""),
    ],
)
def test_a_wrong_override_is_told_as_the_user_typed_it(override: str, expected: str, hint: str) -> None:
    finding = only(TASK, override)
    assert str(finding).startswith(expected)
    assert hint in (finding.hint or "")


def test_the_seed_of_the_command_line_wins() -> None:
    assert load(TASK, "simulation.seed=3", seed=5).spec.simulation.seed == 5
    with pytest.raises(InvalidInput, match=r"--seed -1: error\[TASK204\]: simulation.seed: must be at least 0"):
        load(TASK, seed=-1)


def test_the_resolved_text_is_the_whole_spec_in_si() -> None:
    spec = load(TASK).spec
    text = resolved(spec)
    assert "tilt: 2.0943951023931953" in text
    assert "settle: 0.5" in text
    assert "id: pour_1" in text
    assert load(text).spec == spec
    assert resolved(load(text).spec) == text


PARAMETERS = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12)


@pytest.mark.slow
@given(
    name=st.from_regex(r"\w[\w .+-]{0,10}\w", fullmatch=True),
    description=TEXTS,
    body=TEXTS,
    mass=st.floats(1e-300, 1e5),
    gravity=st.tuples(*[st.floats(-1e9, 1e9)] * 3),
    params=st.dictionaries(PARAMETERS, st.booleans() | st.integers() | st.floats(-1e300, 1e300) | TEXTS, max_size=4),
)
def test_any_spec_comes_back_equal_from_its_resolved_text(
    name: str,
    description: str,
    body: str,
    mass: float,
    gravity: tuple[float, float, float],
    params: dict[str, bool | int | float | str],
) -> None:
    model = type(load(TASK).spec)
    spec = model.model_validate(
        {
            "task": name,
            "robot": "r",
            "controllers": "c",
            "description": description,
            "params": params,
            "simulation": {"gravity": gravity},
            "scene": {body: {"sphere": {"radius": 0.01}, "mass": mass}},
            "steps": [{"move": {"to": body}}],
        }
    )
    assert load(resolved(spec)).spec == spec


VALUES = st.sampled_from(
    [
        "null",
        "true",
        "3",
        "-1",
        "1e400",
        "x",
        "'5",
        "kg'",
        "[]",
        "[1]",
        "{}",
        "{a:",
        "1}",
        "$tilt",
        "$x",
        "'$tilt",
        "+'",
        "{to:",
        "{}}",
        "{xyz:",
        "3}",
        "[[[]]]",
        "*a",
        "&a",
        "!x",
    ]
)


@given(data=st.data())
def test_a_mutated_task_loads_or_is_refused_with_findings(data: st.DataObject) -> None:
    lines = TASK.splitlines()
    for _ in range(data.draw(st.integers(1, 3))):
        index = data.draw(st.integers(0, len(lines) - 1))
        key, colon, _ = lines[index].partition(":")
        lines[index] = data.draw(
            st.sampled_from([f"{key}{colon} {data.draw(VALUES)}", f"{key}x{colon} 1", "", lines[index][:-1]])
        )
    try:
        load("\n".join(lines))
    except InvalidInput as error:
        assert error.findings
        assert all(finding.place is not None for finding in error.findings)


@pytest.mark.slow
@given(path=st.text("abcdeimnoprstu0123_1.", max_size=12), value=VALUES)
def test_any_override_applies_or_is_refused(path: str, value: str) -> None:
    for prefix in ("", "scene.", "scene.cup.", "steps.", "steps.0.", "steps.pour_1.pour.", "simulation."):
        try:
            load(TASK, f"{prefix}{path}={value}")
        except InvalidInput as error:
            assert error.findings


def test_a_file_that_is_not_there_names_its_neighbour(tmp_path: Path) -> None:
    (tmp_path / "pour.yaml").write_text(TASK)

    def refused(path: Path) -> Diagnostic:
        with pytest.raises(InvalidInput) as caught:
            load_task(path, model=MODEL)
        (finding,) = caught.value.findings
        return finding

    absent = refused(tmp_path / "poor.yaml")
    assert (absent.code, absent.hint) == ("USE101", "did you mean 'pour.yaml'?")
    assert refused(tmp_path).code == "USE102"
    assert refused(tmp_path / "pour.yaml" / "x").code == "USE101"
    assert refused(tmp_path / ("x" * 300)).code == "USE103"
    assert refused(tmp_path / "a\0b").code == "USE103"
    located = load_task(tmp_path / "pour.yaml", model=MODEL)
    assert located.spec == load(TASK).spec


def test_the_schema_offers_each_verb_once_and_takes_expressions() -> None:
    text = task_schema(MODEL)
    assert text == task_schema(MODEL)
    schema = json.loads(text)
    steps = schema["$defs"]["Step"]["oneOf"]
    assert [option["$ref"] for option in steps] == ["#/$defs/MoveStep", "#/$defs/PourStep", "#/$defs/WaitStep"]
    pour = schema["$defs"]["PourStep"]
    assert pour["required"] == ["pour"]
    assert pour["additionalProperties"] is False
    count = schema["$defs"]["Pour"]["properties"]["count"]
    assert count["type"] == ["integer", "string"]


@pytest.mark.slow
def test_the_spec_layer_starts_without_numpy() -> None:
    code = "import sys, manipcli.spec.load, manipcli.spec.schema; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_task_has_the_settings_of_each_engine_and_the_selected_ones() -> None:
    def own(text: str) -> Model | None:
        return load(f"{TASK}simulation: {text}\n").spec.simulation.own

    assert own("{engine: pybullet, pybullet: {solver_iterations: 50}}") == Solver(solver_iterations=50)
    assert own("{engine: kinematic, pybullet: {solver_iterations: 50}}") is None
    assert own("{}") == Solver()


def test_an_unknown_setting_of_an_engine_names_the_nearest() -> None:
    finding = only(f"{TASK}simulation: {{pybullet: {{solver_iteration: 50}}}}\n")
    assert (finding.code, str(finding.place)) == ("TASK201", "t.yaml:18:25")
    assert "solver_iterations" in (finding.hint or "")
