"""SRDF files: what they state, and what is wrong with them, with places."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.description.srdf import read_srdf

GOOD = """<robot name="r">
  <group name="arm"><chain base_link="l0" tip_link="l6"/></group>
  <group name="hand"><joint name="slide_left"/><link name="right"/></group>
  <group name="both"><group name="arm"/><group name="hand"/></group>
  <group_state name="ready" group="arm"><joint name="j_l1" value="0.5"/></group_state>
  <end_effector name="e" parent_link="p" group="hand" parent_group="arm"/>
  <virtual_joint name="v" type="fixed" parent_frame="world" child_link="l0"/>
  <disable_collisions link1="l0" link2="l2" reason="Never"/>
</robot>"""


def test_all_entries_are_read(tmp_path: Path) -> None:
    path = tmp_path / "r.srdf"
    path.write_text(GOOD)
    srdf = read_srdf(path)
    arm, hand, both = srdf.groups
    assert (arm.chain, hand.joints, hand.links, both.groups) == (
        ("l0", "l6"), ("slide_left",), ("right",), ("arm", "hand"),
    )  # fmt: skip
    assert [(state.name, state.group, dict(state.positions)) for state in srdf.states] == [
        ("ready", "arm", {"j_l1": 0.5})
    ]
    assert [(each.group, each.parent_link, each.parent_group) for each in srdf.end_effectors] == [("hand", "p", "arm")]
    assert (srdf.touching, srdf.virtual) == ((("l0", "l2"),), ("v",))


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ('<robot name="r"><link name="a"/></robot>', "SRDF001", 1),
        ('<robot name="r">\n<group/></robot>', "SRDF002", 2),
        ('<robot name="r">\n<group name="g"><chain base_link="a"/></group></robot>', "SRDF002", 2),
        ('<robot name="r">\n\n<group_state name="s" group="g"/></robot>', "SRDF003", 3),
        (GOOD.replace('value="0.5"', 'value="half"'), "SRDF004", 5),
        (GOOD.replace('value="0.5"', 'value="inf"'), "SRDF004", 5),
        ("<sdf/>", "URDF002", 1),
    ],
)
def test_errors_name_the_line(tmp_path: Path, text: str, code: str, line: int) -> None:
    path = tmp_path / "r.srdf"
    path.write_text(text)
    with pytest.raises(InvalidInput) as refused:
        read_srdf(path)
    (finding, *_) = refused.value.findings
    assert finding.code == code
    assert finding.place is not None
    assert finding.place.line == line
