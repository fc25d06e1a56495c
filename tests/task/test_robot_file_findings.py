"""Every mistake of a robot file is told at once: what is wrong in itself hides no name that is not there."""

from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.task.load_task import load_task
from manipcli.task.robot_file import read_robot

ROOT = Path(__file__).parents[2]
HEAD = f"robot: r\ndescription: {ROOT}/robots/arm7_hand3/urdf/arm7_hand3.urdf.xacro\n"


def findings(tmp_path: Path, text: str) -> list[tuple[int, str, str]]:
    file = tmp_path / "robot.yaml"
    file.write_text(HEAD + text)
    with pytest.raises(InvalidInput) as refused:
        read_robot(file)
    return [(f.place.line, f.code, f.message) for f in refused.value.findings if f.place is not None]


def test_types_keys_and_names_are_told_together_in_the_order_of_the_file(tmp_path: Path) -> None:
    found = findings(
        tmp_path,
        """\
groups:
  arm: {chain: {base: base_link, tip: plam}}
  hand: {joints: [finger_1_proximal, finger_9]}
poses:
  home: {hand: open}
  open: {hand: [0, 0, 0]}
limits:
  joint_1: {acceleration: 10 m/s^2, jerk: -2}
  joint_99: {acceleration: 1, jerk: x}
tool: {link: tol}
atach: []
collision_ignore: [[palm, 3], [palm, plam]]
""",
    )
    expected = [
        (4, "306"), (5, "312"), (10, "207"), (10, "204"), (11, "304"), (11, "207"), (12, "306"), (13, "201"),
        (14, "205"), (14, "306"),
    ]  # fmt: skip
    assert [(line, code.removeprefix("ROBOT")) for line, code, _ in found] == expected


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        # What refers to something faulty is not told to refer to nothing.
        ("groups:\n  hand: {joint: [finger_1_proximal]}\n  arm: 3\nposes:\n  home: {hand: [0], arm: [0]}\n", [4, 5]),
        (
            "groups:\n  hand: {joints: [finger_1_proximal]}\nposes:\n  home: {hand: open}\n"
            "  open: {hand: [x]}\n  shut: {hand: none}\n  none: 3\n",
            [7, 9],
        ),
        (
            "transmissions:\n  t: {joints: [joint_1], actuators: [m], kind: simple}\n  u: {joints: [joint_1]}\n"
            "actuators:\n  m: {effort: 1}\n",
            [4, 5],
        ),
        # Nothing is known of a robot whose description is not known.
        ("attach: [{description: 3}]\ntool: {link: tol}\n", [3, 3]),
    ],
)
def test_what_was_left_out_is_missed_by_nobody(tmp_path: Path, text: str, lines: list[int]) -> None:
    assert [line for line, _, _ in findings(tmp_path, text)] == lines


def test_a_mistake_in_a_robot_file_hides_no_name_of_the_task(tmp_path: Path) -> None:
    sound = (ROOT / "robots/arm7_hand3/robot.yaml").read_text()
    sound = sound.replace("description: ", f"description: {ROOT}/robots/arm7_hand3/")
    (tmp_path / "robot.yaml").write_text(f"atach: []\n{sound}")
    task = tmp_path / "task.yaml"
    controllers = ROOT / "controllers/arm7_hand3.yaml"
    task.write_text(f"task: t\nrobot: robot.yaml\ncontrollers: {controllers}\nsteps:\n  - move: {{to: hom}}\n")
    with pytest.raises(InvalidInput) as refused:
        load_task(task)
    assert [f.code for f in refused.value.findings] == ["ROBOT201", "TASK230"]


def test_a_robot_that_cannot_move_does_no_task(tmp_path: Path) -> None:
    """Its description is sound, and can be looked at."""
    urdf = tmp_path / "stick.urdf"
    urdf.write_text('<robot name="s"><link name="stick"/><link name="end"/><joint name="weld" type="fixed">'
                    '<parent link="stick"/><child link="end"/></joint></robot>')  # fmt: skip
    (tmp_path / "robot.yaml").write_text("robot: r\ndescription: stick.urdf\n")
    read_robot(tmp_path / "robot.yaml")
    (tmp_path / "controllers.yaml").write_text("{}\n")
    task = tmp_path / "task.yaml"
    task.write_text("task: t\nrobot: robot.yaml\ncontrollers: controllers.yaml\nsteps: [wait: 1 s]\n")
    with pytest.raises(InvalidInput) as refused:
        load_task(task)
    (found,) = [one for one in refused.value.findings if one.place is not None and one.place.line == 2]
    assert (found.code, found.place and found.place.column) == ("TASK244", 8)
    assert "no movable joint" in found.message
    assert "body of the scene" in (found.hint or "")
