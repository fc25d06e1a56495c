"""Every mistake of a task is told at once, each at its own place, and a mistake hides no other."""

import re
import shutil
from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
TASKS = sorted([*ROOT.glob("tasks/*.yaml"), *ROOT.glob("examples/*/task.yaml")])

HEAD = f"""\
task: bad
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
"""


def findings(tmp_path: Path, text: str) -> list[tuple[int, int, str]]:
    file = tmp_path / "bad.yaml"
    file.write_text(HEAD + text)
    with pytest.raises(InvalidInput) as refused:
        load_task(file)
    return [
        (f.place.line, f.place.column, f"{f.message} {f.hint or ''}")
        for f in refused.value.findings
        if f.place is not None
    ]


def test_schema_and_names_are_told_together_in_the_order_of_the_file(tmp_path: Path) -> None:
    found = findings(
        tmp_path,
        """\
scene:
  cup: {cup: {radius: 36 mm, height: 110 mm}, mass: 150 mm, pose: {}, frction: 1.0}
steps:
  - pick: {object: cop, grasp: {posture: wrap}}
  - moove: {to: home}
  - move: {to: hom}
expect:
  - near: {object: cup, to: strt, within: 2 cm}
  - duration: {below: -1 s}
""",
    )
    assert [place[:2] for place in found] == [(5, 53), (5, 71), (7, 20), (8, 5), (9, 16), (11, 29), (12, 23)]
    for (_, _, text), hint in zip(
        found, ("mass", "friction", "cup", "move", "home", "start", "more than 0"), strict=True
    ):
        assert hint in text


def test_names_are_not_missed_where_a_key_stands_twice(tmp_path: Path) -> None:
    """The second `lower` was to be `upper`, which is no reason to tell every line that speaks of `upper`."""
    text = """\
scene:
  lower: {box: {size: [4 cm, 4 cm, 4 cm]}, mass: 50 g, pose: {xyz: [0.5, 0, 0.02]}}
  lower: {box: {size: [4 cm, 4 cm, 4 cm]}, mass: 50 g, pose: {xyz: [0.5, 0.2, 0.02]}}
  third: {box: {size: [4 cm, 4 cm, 4 cm]}, mass: 50 g, rests_on: upper, at: [0.5, 0.2]}
steps:
  - pick: {object: upper}
  - lift: {object: upper, by: 10 m}
expect:
  - at_rest: {object: upper}
  - duration: {below: -1 s}
"""
    found = findings(tmp_path, text)
    assert [line for line, _, _ in found] == [6, 13]
    names = findings(tmp_path, text.replace("  lower: ", "  uper: ", 1).replace("-1 s", "1 s"))
    assert {line for line, _, _ in names} == {7, 9, 10, 12}


def test_ids_that_are_taken_are_told_with_everything_else(tmp_path: Path) -> None:
    found = findings(
        tmp_path,
        """\
steps:
  - id: a
    wait: 1 s
  - id: a
    move: {to: hom}
  - id: a
    moove: {to: home}
  - move: {to: hom}
expect:
  - duration: {below: 1 s}
    id: b
  - tool_speed: {below: 1 m/s, link: tol}
    id: b
""",
    )
    told = [f"{line} {text}" for line, _, text in found]
    taken = [
        "7 steps[1].id: duplicate id 'a': steps[0] has it already",
        "9 steps[2].id: duplicate id 'a'",
        "16 expect[1].id: duplicate id 'b'",
    ]
    for start in (
        *taken,
        "8 steps[1].move.to: ",
        "10 steps[2]: unknown verb",
        "11 steps[3].move.to: ",
        "15 expect[1].",
    ):
        assert any(one.startswith(start) for one in told), (start, told)
    assert len(told) == 7


def test_an_item_keeps_its_number_when_the_one_before_it_is_faulty(tmp_path: Path) -> None:
    found = findings(tmp_path, "steps:\n  - moove: {}\n  - move: {to: hom}\n")
    assert [text.split(":")[0] for _, _, text in found] == ["steps[0]", "steps[1].move.to"]


def test_the_only_step_being_wrong_hides_no_other_file(tmp_path: Path) -> None:
    (tmp_path / "controllers.yaml").write_text("controllers:\n  arm: {type: joint_trajectry}\n")
    file = tmp_path / "bad.yaml"
    head = HEAD.replace(f"{ROOT}/controllers/arm7_hand3.yaml", "controllers.yaml")
    for steps in ("[{mov: {to: home}}]", "[]", "{}", "3"):
        file.write_text(f"{head}start: hme\nsteps: {steps}\n")
        with pytest.raises(InvalidInput) as refused:
            load_task(file)
        places = [(Path(f.place.file).name, f.place.line) for f in refused.value.findings if f.place is not None]
        assert places == [("bad.yaml", 4), ("bad.yaml", 5), ("controllers.yaml", 2)]


def test_what_a_task_cannot_do_without_hides_nothing(tmp_path: Path) -> None:
    (tmp_path / "controllers.yaml").write_text("controllers:\n  arm: {type: joint_trajectry}\n")
    file = tmp_path / "bad.yaml"
    file.write_text("task: a/b\ncontrollers: controllers.yaml\nscene: []\nexpect: {a: 1}\n")
    with pytest.raises(InvalidInput) as refused:
        load_task(file)
    told = [(Path(f.place.file).name, f.place.line, f.message) for f in refused.value.findings if f.place is not None]
    assert [one[:2] for one in told] == [*(("bad.yaml", line) for line in (1, 1, 1, 3, 4)), ("controllers.yaml", 2)]
    assert {one[2] for one in told[:2]} == {"the key 'robot' is missing", "the key 'steps' is missing"}


def test_names_in_a_faulty_scene_are_told_with_its_other_mistakes(tmp_path: Path) -> None:
    found = findings(
        tmp_path,
        """\
scene:
  desk: {box: {size: [1, 1, 1]}, pose: {xyz: [2, 0, 0]}, fixed: yes}
  cup: {cup: {radius: 36 mm, height: 110 mm}, mass: 150 g, rests_on: desc, at: [2, 0]}
  ball: {sphere: {radius: 14 mm}, mas: 10 g, inside: cpu}
  world: {sphere: {radius: 14 mm}, mass: 10 g, pose: {}}
frames:
  desk: {parent: desk}
  f: {parent: deks, pos: {}}
steps:
  - wait: 1 s
""",
    )
    assert [place[:2] for place in found] == [(5, 65), (6, 70), (7, 35), (7, 54), (8, 10), (10, 9), (11, 15), (11, 21)]


def test_a_step_that_is_not_there_is_told_though_others_are_faulty(tmp_path: Path) -> None:
    found = findings(
        tmp_path,
        """\
steps:
  - moove: {to: home}
  - {}
  - {wait: 1 s, id: pause}
expect:
  - step_done: {step: move_1}
  - step_done: {step: wait_1}
  - step_done: {step: pause}
  - step_done: {step: pase}
  - duration: {below: 1 s}
    during: move_3
""",
    )
    assert [place[:2] for place in found] == [(5, 5), (6, 5), (12, 23), (14, 13)]
    assert "pause" in found[2][2]


def test_engine_and_recorded_rates_are_told_with_the_rest(tmp_path: Path) -> None:
    found = findings(
        tmp_path,
        """\
simulation: {engine: pybulet, step: 1 mm, control_period: 1.5 ms}
steps:
  - wait: 1 s
""",
    )
    assert [place[:2] for place in found] == [(4, 22), (4, 37)]
    found = findings(tmp_path, "record: {rates: {tf: 300 Hz}}\nsteps:\n  - wait: 1 m\n  - {id: 1a, wait: 1 s}\n")
    assert [place[:2] for place in found] == [(4, 22), (6, 11), (7, 10)]


def test_a_faulty_field_of_a_step_hides_no_name_in_its_others(tmp_path: Path) -> None:
    """Of each step but the last the faulty field can be left out; of that, its only value."""
    file = tmp_path / "task.yaml"
    file.write_text(
        f"""task: t
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
scene:
  cup: {{cup: {{radius: 36 mm, height: 110 mm, wall: 4 mm}}, mass: 150 g, at: [0.75, 0.0], rests_on: floor}}
steps:
  - pick: {{object: cupp, approach: {{from: sid}}, grasp: {{posture: wrapp}}}}
  - pour: {{object: cup, into: try, tilt: $titl}}
    until: {{inside: {{object: bal, of: cup}}}}
    timeout: 15 kg
  - place: {{object: cop, at: strt}}
  - move: {{to: hom, velocity_scaling: fast}}
  - wait: soon
"""
    )
    with pytest.raises(InvalidInput) as refused:
        load_task(file, allow_outside=True)
    told = [(f.place.line, shown) for f in refused.value.findings if f.place for shown in [f.message.split(": ")[0]]]
    assert told == [
        (7, "steps[0].pick.object"), (7, "steps[0].pick.approach.from"), (7, "steps[0].pick.grasp.posture"),
        (8, "steps[1].pour.into"), (8, "steps[1].pour.tilt"), (9, "steps[1].until.inside.object"),
        (10, "steps[1].timeout"), (11, "steps[2].place.object"), (11, "steps[2].place.at"),
        (12, "steps[3].move.to"), (12, "steps[3].move.velocity_scaling"), (13, "steps[4].wait"),
    ]  # fmt: skip


def test_a_faulty_point_of_a_trajectory_is_told_at_its_line(tmp_path: Path) -> None:
    points = (
        ("[a, b]", "{positions: [0, 0, 0], time_from_start: 1}", "points[1].positions: 3 positions for 2 joints"),
        ("[a, b]", "{positions: [0, 0], time_from_start: 0.5}", "points[1].time_from_start: 0.5 s is not after 0.5 s"),
        ("[a, b]", "{positions: [0, 0], time_from_start: -1}", "points[1].time_from_start: must be 0 or more, not -1"),
        ("[a, a]", "{positions: [0, 0], time_from_start: 1}", "joint_names[1]: duplicate joint 'a'"),
    )
    text = "steps:\n" + "".join(
        f"  - follow:\n      joint_names: {names}\n      points:\n"
        f"        - {{positions: [0, 0], time_from_start: {{nsecs: 500000000}}}}\n        - {point}\n"
        for names, point, _ in points
    )
    found = findings(tmp_path, text)
    assert [place[:2] for place in found] == [(9, 23), (14, 48), (19, 48), (21, 24)]
    for (_, _, told), (_, _, expected) in zip(found, points, strict=True):
        assert expected in told


def test_what_cannot_be_computed_or_was_told_before_is_told_once(tmp_path: Path) -> None:
    found = findings(
        tmp_path,
        """\
params: {s: home, h: 0.1 rad}
steps:
  - move: {to: pre_$s}
  - move: {to: $zz}
  - id: a
    move: {to: {joint_1: $h}, velocity_scaling: 150 %}
  - id: b
    move: {to: {joint_1: $h}, velocity_scaling: 50 %}
    until: {step_done: {step: zz}}
    on_fail: {retry: 2, with: {h: -0.1 rad}}
""",
    )
    assert [place[:2] for place in found] == [(6, 16), (7, 16), (9, 49), (12, 31)]
    assert "at most 1, not '150 %'" in found[2][2]
    text = "steps:\n  - move: {to: {joint_1: $h}}\n    until: {step_done: {step: zz}}\n"
    (once,) = findings(tmp_path, f"params: {{h: 0.1 rad}}\n{text}    on_fail: {{retry: 2, with: {{h: -0.1 rad}}}}\n")
    assert once[:2] == (7, 31)


def test_a_faulty_body_is_still_known_by_its_name(tmp_path: Path) -> None:
    found = findings(
        tmp_path, "scene:\n  cup: {box: {size: 1}}\nsteps:\n  - pick: {object: cup, grasp: {posture: wrap}}\n"
    )
    assert {line for line, _, _ in found} == {5}


def test_a_missing_robot_file_is_told_where_it_is_named(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text("task: bad\nrobot: nowhere.yaml\ncontrollers: no.yaml\nsteps:\n  - wait: 1 s\n")
    with pytest.raises(InvalidInput) as refused:
        load_task(file)
    assert [(f.place.line, f.place.column) for f in refused.value.findings if f.place] == [(2, 8), (3, 14)]


def test_a_robot_without_a_hand_is_not_asked_for_poses_of_one(tmp_path: Path) -> None:
    folder = ROOT / "examples" / "04_own_robot"
    file = tmp_path / "bad.yaml"
    file.write_text(
        f"""\
task: bad
robot: {folder}/robot.yaml
controllers: {folder}/controllers.yaml
scene:
  cup: {{cup: {{radius: 3 cm, height: 10 cm}}, mass: 0.1, pose: {{xyz: [0.4, 0, 0]}}}}
steps:
  - pick: {{object: cop}}
  - release: {{}}
"""
    )
    with pytest.raises(InvalidInput) as refused:
        load_task(file)
    told = [(f.place and f.place.line, f.message.partition(": ")[2]) for f in refused.value.findings]
    handless = "no gripper controller moves a hand of robot 'reacher'"
    assert told == [(7, handless), (7, "'cop' is not a movable body of the scene"), (8, handless)]


def test_a_step_that_is_left_out_puts_no_other_out_of_order(tmp_path: Path) -> None:
    """Without its faulty first step the second would be called move_1, for which it would wait itself."""
    found = findings(
        tmp_path,
        """\
steps:
  - move: {to: home, velocity_scaling: 7}
  - move: {to: zero}
    until: {step_done: {step: move_1}}
  - wait: 1 s
expect:
  - step_done: {step: move_2}
    at: wait_1
""",
    )
    assert [line for line, _, _ in found] == [5]


def test_a_value_that_a_parameter_says_is_told_with_the_place_of_the_parameter(tmp_path: Path) -> None:
    ((line, column, told),) = findings(tmp_path, "params: {pause: 2 kg}\nsteps:\n  - wait: $pause\n")
    assert (line, column) == (6, 11)
    assert "a mass" in told
    assert "bad.yaml:4:17" in told  # where `2 kg` stands


NO_ROBOT = f"""\
task: x
robot: nowhere.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
scene:
  desk: {{box: {{size: [0.6, 1, 0.4]}}, pose: {{xyz: [0.85, 0, 0.2]}}, fixed: true}}
  cup: {{cup: {{radius: 36 mm, height: 110 mm}}, mass: 150 g, rests_on: desk, at: [0.75, 0]}}
steps:
  - pick: {{object: cupp, grasp: {{posture: any}}}}
  - move: {{pose: {{xyz: [0, 0, 1]}}, frame: dsk}}
  - move: {{to: {{any_joint: 0}}}}
expect:
  - tracking: {{group: any_group, within: 1 deg}}
  - collision: [robot/any_link, cu]
  - step_done: {{step: nowhere}}
  - at_pose: {{pose: any_pose}}
"""


def test_names_of_the_scene_are_told_where_the_robot_cannot_be_built(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(NO_ROBOT)
    with pytest.raises(InvalidInput) as invalid:
        load_task(path)
    told = [(one.code, one.place.line, one.message.rsplit(": ")[-1]) for one in invalid.value.findings if one.place]
    assert told == [
        ("TASK231", 2, f"there is no file '{tmp_path / 'nowhere.yaml'}'"),
        ("TASK230", 8, "'cupp' is not a movable body of the scene"),
        ("TASK230", 9, "unknown frame 'dsk'"),
        ("TASK230", 13, "'cu' is not a body of the scene or a part of the robot"),
        ("TASK230", 14, "the task has no step 'nowhere'"),
    ]


def test_the_floor_of_a_scene_that_cannot_be_built_is_no_body_to_pick(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(NO_ROBOT.replace("expect:", "  - pick: {object: floor}\nexpect:") + "  - no_such: {}\n")
    with pytest.raises(InvalidInput) as invalid:
        load_task(path)
    (finding,) = (one for one in invalid.value.findings if "'floor'" in one.message)
    assert finding.message.endswith("'floor' is not a movable body of the scene")
    assert finding.hint is not None and "floor" not in finding.hint


@pytest.mark.parametrize(
    ("named", "told", "hint"),
    [("/dev/null", "is not a regular file", None), ("robots", "is a folder", "name the YAML file in it")],
)
def test_what_is_there_and_no_file_is_not_called_absent(
    tmp_path: Path, named: str, told: str, hint: str | None
) -> None:
    (tmp_path / "robots").mkdir()
    path = tmp_path / "task.yaml"
    path.write_text(NO_ROBOT.replace("nowhere.yaml", named))
    with pytest.raises(InvalidInput) as invalid:
        load_task(path)
    (finding,) = (one for one in invalid.value.findings if one.code == "TASK231")
    assert finding.message.endswith(f"{told}; expected a YAML file")
    assert finding.hint == hint


@pytest.mark.parametrize("file", TASKS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_nothing_is_made_up_where_the_robot_cannot_be_built(tmp_path: Path, file: Path) -> None:
    text = re.sub(r"(?m)^robot: .*$", "robot: nowhere.yaml", file.read_text())
    text = re.sub(r"(?m)^controllers: ", f"controllers: {file.parent}/", text)
    path = tmp_path / "task.yaml"
    path.write_text(text)
    if (file.parent / "objects").exists():
        shutil.copytree(file.parent / "objects", tmp_path / "objects")
    with pytest.raises(InvalidInput) as invalid:
        load_task(path)
    assert [one.code for one in invalid.value.findings] == ["TASK231"]


def test_a_body_called_as_a_word_and_as_a_link_is_told_once(tmp_path: Path) -> None:
    body = "{box: {size: [1 cm, 1 cm, 1 cm]}, pose: {xyz: [1, 0, 1]}, mass: 1}"
    told = findings(tmp_path, f"scene:\n  tool: {body}\nsteps: [wait: 1 s]\n")
    assert [line for line, *_ in told] == [5]
    assert "the name is reserved" in told[0][2]


def of_controllers(tmp_path: Path, text: str) -> list[tuple[int, str, str | None]]:
    """Line, code and hint of each finding about a controllers file."""
    (tmp_path / "controllers.yaml").write_text(text)
    file = tmp_path / "t.yaml"
    head = HEAD.replace(f"{ROOT}/controllers/arm7_hand3.yaml", "controllers.yaml")
    file.write_text(f"{head}steps:\n  - move: {{to: zero}}\n")
    with pytest.raises(InvalidInput) as refused:
        load_task(file)
    return [(f.place.line, f.code, f.hint) for f in refused.value.findings if f.place is not None]


def test_a_faulty_value_of_a_controller_hides_no_joint_that_is_not_there(tmp_path: Path) -> None:
    found = of_controllers(
        tmp_path,
        """\
controllers:
  arm_controller:
    type: joint_trajectory
    joints: [joint_1, jont_3]
    gains:
      joint_1: {p: 300, d: fast}
      joint_9: {p: 300, dd: 3}
    constraints: {joints: {joint_1: {goal: 1 kg}, wrist: {goal: 0.1}}}
  hand:
    type: gripper
    joint: finger_1_proximal
    speed: {}
    max_effort: [1]
""",
    )
    assert [one[:2] for one in found] == [
        (4, "CTRL144"), (6, "CTRL205"), (7, "CTRL102"), (7, "CTRL201"), (8, "CTRL207"), (8, "CTRL104"),
        (11, "CTRL201"), (12, "CTRL205"), (13, "CTRL205"),
    ]  # fmt: skip
    assert found[1][2] == "d: Derivative, 0 or more. Default 0."


@pytest.mark.parametrize(
    ("written", "faulty", "code"),
    [
        ("{p: 300, d: 12}", "{p: much, d: 12}", "CTRL205"),
        ("command_interface: effort", "command_interface: efort", "CTRL203"),
        ("[joint_1, joint_2", "[1, joint_2", "CTRL205"),
        ("type: gripper", "type: griper", "CTRL203"),
    ],
)
def test_of_a_controller_without_its_faulty_value_only_names_are_told(
    tmp_path: Path, written: str, faulty: str, code: str
) -> None:
    """No gain of 0, no joint that nobody commands, no claim of another interface is made up."""
    whole = (ROOT / "controllers" / "arm7_hand3.yaml").read_text()
    assert written in whole
    assert [one[1] for one in of_controllers(tmp_path, whole.replace(written, faulty, 1))] == [code]


def test_a_name_that_a_launch_file_completes_is_not_called_absent(tmp_path: Path) -> None:
    whole = (ROOT / "controllers" / "arm7_hand3.yaml").read_text()
    text = whole.replace("[joint_1,", '["$(var prefix)joint_1",', 1).replace("type: gripper", "type: griper")
    assert {one[1] for one in of_controllers(tmp_path, text)} == {"CTRL217", "CTRL203"}


def test_hints_on_names_know_parameters_parts_and_blocks(tmp_path: Path) -> None:
    found = findings(
        tmp_path,
        """\
scene:
  cup: {cup: {radius: 36 mm, height: 110 mm}, mass: 150 g, pose: {}}
steps:
  - id: r
    repeat:
      each: {thing: [cup]}
      steps: [{pick: {object: thing, grasp: {posture: wrap}}}, {lift: {object: $thing}}, {wait: 1 s}]
  - pick: {object: cup/rim, grasp: {posture: wrap}}
expect:
  - step_done: {step: r}
  - at_rest: {object: cup}
    during: r[1]
""",
    )
    hints = (
        "write `$thing`: 'thing' is a parameter",
        "name the body, 'cup'; where the step has `part`, add `part: rim`",
        "name a step in it: r[0]/pick_1, r[0]/lift_1, r[0]/wait_1",
        "rounds: r[0]",
    )
    assert [(line, text[text.index(hint) :]) for (line, _, text), hint in zip(found, hints, strict=False)] == [
        (10, hints[0]), (11, hints[1]), (13, hints[2]), (15, hints[3])
    ]  # fmt: skip
