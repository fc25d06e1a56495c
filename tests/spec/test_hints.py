"""Hints lead somewhere: what they say to write is taken, and messages say in words what was expected."""

from __future__ import annotations

import re

import pytest

from manipcli.conditions.members import CONDITIONS
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.plan.steps import STEPS
from manipcli.spec.base import Model
from manipcli.spec.load import load_controllers_text, load_robot_text, load_task_text
from manipcli.spec.source.yaml import parse
from manipcli.task.vocabulary import controllers_spec, task_spec

ROBOT = "robot: r\ndescription: r.urdf\n"


def refused(text: str, *overrides: str) -> Diagnostic:
    with pytest.raises(InvalidInput) as error:
        load_robot_text(text, "r.yaml", overrides=overrides)
    (finding,) = error.value.findings
    return finding


def test_what_an_override_is_told_to_give_whole_is_taken() -> None:
    hint = refused(ROBOT, "robot.limits.a.velocity=2").hint or ""
    path = re.search(r"robot\.limits\.a=", hint)
    assert path is not None, hint
    assert load_robot_text(ROBOT, "r.yaml", overrides=[f"{path.group()}{{velocity: 2}}"]).spec.limits["a"].velocity == 2


@pytest.mark.parametrize("version", ["9.0", "v1.2.3", "1.2.3 ", "latest"])
def test_a_version_is_explained_in_words(version: str) -> None:
    finding = refused(f'{ROBOT}version: "{version}"\n')
    assert (finding.code, finding.place and finding.place.line) == ("ROBOT208", 3)
    assert finding.message == f"version: '{version}' is not a version: expected three numbers such as '0.1.0'"


@pytest.mark.parametrize("number", ["9" * 400, "-" + "9" * 309, "0x" + "f" * 300, "9" * 3000])
def test_a_number_beyond_all_others_is_too_large(number: str) -> None:
    with pytest.raises(InvalidInput, match=r"exceeds the largest number, 1\.8e308"):
        parse(f"a: {number}", "f.yaml")


def test_the_greatest_whole_numbers_are_read() -> None:
    root = parse(f"a: {'9' * 308}", "f.yaml")
    assert root is not None
    assert refused(f"{ROBOT}default_acceleration: -{'9' * 308}\n").code == "ROBOT204"


def test_what_is_not_finite_is_not_said_to_be_a_text() -> None:
    assert refused(f"{ROBOT}friction: .nan\n").hint == "write a finite number"


def test_a_tolerance_of_zero_is_told_what_leaving_it_out_means() -> None:
    constraints = "constraints: {joints: {a: {goal: 0, trajectory: 0.1}}}"
    with pytest.raises(InvalidInput) as error:
        load_controllers_text(
            f"controllers: {{c: {{type: joint_trajectory, joints: [a], {constraints}}}}}",
            "c.yaml",
            model=controllers_spec(),
        )
    (finding,) = error.value.findings
    assert (finding.code, finding.hint) == (
        "CTRL204",
        "goal: Goal tolerance [rad or m], above 0 to pi. Default: not enforced.",
    )


def test_a_tolerance_in_degrees_is_told_to_say_so() -> None:
    constraints = "constraints: {joints: {a: {trajectory: 15, goal: 2}}}"
    with pytest.raises(InvalidInput) as error:
        load_controllers_text(
            f"controllers: {{c: {{type: joint_trajectory, joints: [a], {constraints}}}}}",
            "c.yaml",
            model=controllers_spec(),
        )
    (finding,) = error.value.findings
    assert finding.message == "controllers.c.constraints.joints.a.trajectory: must be at most 3.1416 rad or m, not 15"
    assert finding.hint == "in degrees? write '15 deg'; in millimetres? write '15 mm'"


def test_a_number_out_of_range_comes_with_the_description_of_its_key() -> None:
    hint = refused(f"{ROBOT}default_acceleration: -1\n").hint
    assert hint is not None and hint.startswith("default_acceleration: Acceleration limit of joints without one")


def test_a_quantity_with_another_unit_comes_with_the_description_of_its_key() -> None:
    hint = refused(f"{ROBOT}default_acceleration: 3 kg\n").hint
    assert hint is not None and hint.startswith("default_acceleration: Acceleration limit of joints without one")


@pytest.mark.parametrize("prefix", ["b/ \\n", " b_", "b\\u202e", "b" * 101])
def test_a_prefix_makes_names_that_can_be_written(prefix: str) -> None:
    block = f'attach: [{{description: h.urdf, parent: a, prefix: "{prefix}"}}]\n'
    finding = refused(ROBOT + block)
    assert (finding.code, finding.hint) == ("ROBOT208", "use letters, digits and '_', '.', '/', '-'")
    load_robot_text(ROBOT + block.replace(prefix, "left_arm/"), "r.yaml")


TASK = "task: t\nrobot: r.yaml\ncontrollers: c.yaml\n"
TASK += "scene: {cup: {cup: {radius: 4 cm, height: 8 cm}, mass: 1, pose: {}}}\n"


def told(block: str) -> Diagnostic:
    with pytest.raises(InvalidInput) as error:
        load_task_text(TASK + block, "t.yaml", model=task_spec())
    (finding,) = error.value.findings
    return finding


def test_a_key_of_a_single_mapping_that_stands_for_a_list_has_the_hints_of_an_item() -> None:
    """`keep` takes one mapping, or a list of them."""
    step = "steps: [{move: {to: home}, keep: KEEP}]\n"
    for keep in ("{tool_sped: 1}", "[{tool_sped: 1}]"):
        finding = told(step.replace("KEEP", keep))
        assert finding.hint is not None and finding.hint.startswith("did you mean 'tool_speed'?")


@pytest.mark.parametrize("block", ["{region: {size: [1, 1, 1]}}", "{boxx: 3}"])
def test_a_misspelt_key_is_not_also_missing(block: str) -> None:
    step = f"steps: [{{move: {{to: home}}, keep: {{inside: {block}}}}}]\n"
    finding = told(step)
    assert finding.code == "TASK201"


def test_an_unknown_engine_is_reported_with_the_other_errors_of_the_file() -> None:
    text = "simulation: {engine: pybulet, settle: -1 s}\nsteps: [{move: {to: home}}]\n"
    with pytest.raises(InvalidInput) as error:
        load_task_text(TASK + text, "t.yaml", model=task_spec())
    findings = error.value.findings
    assert [(f.code, f.message) for f in findings] == [
        ("TASK203", "simulation.engine: unknown engine 'pybulet'"),
        ("TASK204", "simulation.settle: must be at least 0, not '-1 s'"),
    ]
    assert findings[0].hint == "did you mean 'pybullet'?"


@pytest.mark.parametrize(
    ("block", "place", "hint"),
    [
        ("steps: [{lift: {object: cup, by: 1 cm, until: {at_rest: {object: cup}}}}]", "steps[0].lift", "until,lift"),
        ("steps: [{lift: {object: cup, by: 1 cm, timeout: 3 s}}]", "steps[0].lift", "timeout,lift"),
        ("steps: [{lift: {object: cup, by: 1 cm, id: up}}]", "steps[0].lift", "id,lift"),
        ("steps: [{pick: {object: cup, approach: {on_fail: stop}}}]", "steps[0].pick.approach", "on_fail,pick"),
        (
            "steps: [wait: 1 s]\nexpect: [{upright: {object: cup, within: 1, during: a}}]",
            "expect[0].upright",
            "during,upright",
        ),
        ("steps: [wait: 1 s]\nframes: {f: {pose: {parent: cup}}}", "frames.f.pose", "parent,pose"),
    ],
)
def test_a_key_of_the_block_around_is_told_to_stand_there(block: str, place: str, hint: str) -> None:
    key, beside = hint.split(",")
    finding = told(block)
    assert finding.message == f"{place}: unknown key '{key}'"
    assert finding.hint == f"put `{key}` next to `{beside}`, not inside it"
    assert finding.code == "TASK201"


def test_a_key_of_the_file_is_not_told_to_stand_anywhere() -> None:
    assert "beside" not in (told("steps: [{lift: {object: cup, by: 1 cm, robot: r}}]").hint or "")


@pytest.mark.parametrize(
    ("block", "written", "guess", "right"),
    [
        ("steps: [{wait: 1 s, on_fail: @}]", "retry", "write", "{retry: 1}"),
        ("steps: [{move: {to: home, touch: @}}]", "cup", "write", "[cup]"),
        ("steps: [wait: 1 s]\ntags: @", "slow", "write", "[slow]"),
        ("steps: [{switch_controllers: {activate: @}}]", "arm", "write", "[arm]"),
        ("steps: [{move: {to: home, velocity_scaling: @}}]", "30", "in percent? write", "'30 %'"),
        ("steps: [wait: 1 s]\nexpect: [{limits: {spare: @}}]", "20", "in percent? write", "'20 %'"),
    ],
)
def test_what_is_told_to_be_written_is_taken(block: str, written: str, guess: str, right: str) -> None:
    assert told(block.replace("@", written)).hint == f"{guess} {right}"
    load_task_text(TASK + block.replace("@", right), "t.yaml", model=task_spec())


@pytest.mark.parametrize(
    "block",
    [
        "steps: [{move: {to: home, velocity_scaling: 300}}]",
        "steps: [{move: {pose: {xyz: cup}}}]",
        "steps: [wait: 1 s]\nreplan: yes",
    ],
)
def test_what_is_no_list_of_names_and_no_percentage_has_no_such_hint(block: str) -> None:
    assert not (told(block).hint or "").startswith(("in percent", "write ["))


@pytest.mark.parametrize("to", ["[0.1, 0.2]", "{arm: [0.1, 0.2]}"])
def test_positions_of_a_group_are_told_to_go_by_joint(to: str) -> None:
    """As they stand in the poses of the robot file."""
    finding = told(f"steps: [{{move: {{to: {to}}}}}]")
    assert finding.code == "TASK205"
    where = "steps[0].move.to" if to.startswith("[") else "steps[0].move.to.arm"
    assert finding.message == f"{where}: joint positions are a mapping by joint, not a list"
    written = re.search(r"\{joint: 30 deg\}", finding.hint or "")
    assert written is not None, finding.hint
    load_task_text(f"{TASK}steps: [{{move: {{to: {written.group()}}}}}]", "t.yaml", model=task_spec())


WHOLE = "task: t\nrobot: r.yaml\ncontrollers: c.yaml\nsteps: [{move: {to: home}%s}]\n%s"
CONTROLLERS = "controllers:\n  js: %s\n"


@pytest.mark.parametrize(
    ("step", "rest", "hint"),
    [
        ("", "seed: 4\n", "put `seed` inside `simulation`"),
        (", velocity_scaling: 0.5", "", "put `velocity_scaling` inside `move`"),
        ("", "scene: {b: {sphere: {radius: 1}, mass: 1, xyz: [0, 0, 1]}}\n", "put `xyz` inside `pose`"),
        ("", "scene: {b: {mass: 1, size: [1, 1, 1]}}\n", "put `size` inside `box` or `tray`"),
        ("", "expect: [{no_collision: {pairs: [robot]}}]\n", "write each pair as a list: [[A, B]]"),
        ("", "expect: [{contact_force: {pair: cup, above: 1}}]\n", "write a pair as a list: [A, B]"),
    ],
)
def test_where_a_key_belongs_and_how_a_pair_is_written(step: str, rest: str, hint: str) -> None:
    with pytest.raises(InvalidInput) as error:
        load_task_text(WHOLE % (step, rest), "t.yaml", model=task_spec())
    assert any((finding.hint or "").startswith(hint) for finding in error.value.findings), error.value


@pytest.mark.parametrize(
    ("block", "key", "column", "now"),
    [
        ("steps: [{move: {to: home, speed: 0.5}}]", "speed", 27, "velocity_scaling"),
        ("steps: [{lift: {object: cup, speed: 0.5}}]", "speed", 30, "velocity_scaling"),
        ("steps: [{place: {object: cup, at: [0, 0], on: desk}}]", "on", 43, "onto"),
        ("steps: [wait: 1 s]\nexpect: [{slip: {object: cup, within: 1 mm, turn: 1 deg}}]", "turn", 45, "rotation"),
        ("steps: [wait: 1 s]\nwatch: [{never: {moved: {object: cup, turn: 1 deg}}}]", "turn", 39, "rotation"),
    ],
)
def test_a_key_that_was_renamed_is_refused_with_its_new_name(block: str, key: str, column: int, now: str) -> None:
    finding = told(block)
    assert finding.code == "TASK201" and f"unknown key '{key}'" in finding.message
    assert finding.place is not None and finding.place.column == column
    assert finding.hint == f"write `{now}`: `{key}` was renamed"
    load_task_text(TASK + block.replace(f"{key}: ", f"{now}: "), "t.yaml", model=task_spec())


@pytest.mark.parametrize("spec", [member.spec for seam in (STEPS, CONDITIONS) for member in seam])
def test_a_renamed_key_leads_to_one_that_there_is(spec: type[Model]) -> None:
    assert not spec.renamed.keys() & spec.model_fields.keys()
    assert set(spec.renamed.values()) <= spec.model_fields.keys()


def test_of_a_controller_of_any_type_only_the_type_is_asked_for() -> None:
    with pytest.raises(InvalidInput) as error:
        load_controllers_text(CONTROLLERS % "[]", "c.yaml", model=controllers_spec())
    (finding,) = error.value.findings
    assert finding.hint == "write {type: ...}"
    load_controllers_text(CONTROLLERS % "{type: joint_state_broadcaster}", "c.yaml", model=controllers_spec())


def test_a_list_of_one_length_is_asked_for_with_that_length() -> None:
    for xyz in ("[0, 0]", "[0, 0, 0, 1]"):
        assert "expected 3 items, got" in refused(f"{ROBOT}mount: {{xyz: {xyz}}}\n").message


def test_where_a_plain_number_is_wanted_no_unit_is_proposed() -> None:
    with pytest.raises(InvalidInput) as error:
        load_task_text(WHOLE.replace("home", "home, velocity_scaling: fast") % ("", ""), "t.yaml", model=task_spec())
    (finding,) = error.value.findings
    assert "expected a plain number (0.5, 50 %)" in finding.message
    assert finding.hint is None or "deg" not in finding.hint


def test_a_joint_that_stands_twice_is_told_without_a_robot() -> None:
    with pytest.raises(InvalidInput) as error:
        load_controllers_text(
            CONTROLLERS % "{type: joint_state_broadcaster, joints: [a, b, a]}", "c.yaml", model=controllers_spec()
        )
    (finding,) = error.value.findings
    assert (finding.code, str(finding.place)) == ("CTRL210", "c.yaml:2:54")
    assert finding.message == "controllers.js.joints[2]: duplicate joint 'a'"


def test_a_key_is_not_told_to_stand_next_to_a_number_of_a_list() -> None:
    hint = told("steps: [wait: 1 s]\nexpect: [{duration: {below: 1 s}}, {never: {tool_speed: {above: 0.2}}}]").hint
    assert hint is not None
    assert "next to" not in hint
    assert "below" in hint


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("planner: {effort: 4}", "put `effort` inside `plan`"),
        ("saturation: off", "write false"),
        ("frames: {f: {parnt: world}}", "did you mean 'parent'"),
    ],
)
def test_a_key_of_another_block_and_a_word_for_false(line: str, hint: str) -> None:
    with pytest.raises(InvalidInput) as error:
        load_task_text(
            f"task: t\nrobot: r.yaml\ncontrollers: c.yaml\n{line}\nsteps: [{{wait: 0}}]\n", "t", model=task_spec()
        )
    (finding,) = error.value.findings
    assert finding.hint is not None and hint in finding.hint
