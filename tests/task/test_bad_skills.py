"""Hostile values in the steps and the scene of jointed and compliant skills: refused with a place and a hint."""

from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput, NotPlannable
from manipcli.core.geometry import Transform
from manipcli.plan.path import interpolate
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
LINK = (
    '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>'
)
LIMIT = '<limit lower="0" upper="1" velocity="1" effort="1"/>'


def urdf(links: int, kind: str = "prismatic") -> str:
    joints = (
        f'<joint name="j{k}" type="{kind}"><parent link="l{k}"/><child link="l{k + 1}"/>'
        f'<origin xyz="0.2 0 0"/><axis xyz="1 0 0"/>{LIMIT}</joint>'
        for k in range(links - 1)
    )
    return f'<robot name="r">{"".join(LINK.format(f"l{k}") for k in range(links))}{"".join(joints)}</robot>'


@pytest.mark.parametrize(
    ("file", "body", "step", "expected", "code"),
    [
        (urdf(2), "", "insert: {object: peg, into: cup, force: x}", "'x' is not a number", "TASK207"),
        (urdf(2), "", "insert: {object: peg, into: cup, depth: 1e-300}", "at least 0.001 m", "TASK204"),
        (urdf(2), "", "press: {object: peg, force: 1 N, direction: [0, 0, -1e-300]}", "has length 1e-300", "TASK208"),
        (urdf(2), "", "push: {object: peg, by: 5 cm, direction: [1e300, 0]}", "has length 1e+300", "TASK208"),
        (urdf(2), ", joints: {j0: {spring: {stiffness: 1e300}}}", "wait: 1 s", "at most 1e+06", "TASK204"),
        (urdf(2), ", joints: {j0: {damping: 1e300}}", "wait: 1 s", "at most 1e+06", "TASK204"),
        (urdf(2, "planar"), "", "wait: 1 s", "joint 'j0' is planar", "URDF065"),
        (urdf(101), "", "wait: 1 s", "has 101 links, expected at most 100", "TASK222"),
    ],
)
def test_a_bad_value_is_refused_where_it_is(
    tmp_path: Path, file: str, body: str, step: str, expected: str, code: str
) -> None:
    (tmp_path / "a.urdf").write_text(file)
    path = tmp_path / "task.yaml"
    path.write_text(
        f"""task: t
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
scene:
  a: {{urdf: {{file: a.urdf}}, fixed: true, pose: {{xyz: [2, 0, 0.5]}}{body}}}
  peg: {{box: {{size: [0.02, 0.02, 0.1]}}, mass: 100 g, pose: {{xyz: [0.5, 0, 0.05]}}}}
  cup: {{cup: {{radius: 4 cm, height: 8 cm}}, mass: 100 g, pose: {{xyz: [0.5, 0.3, 0]}}}}
steps:
  - {step}
"""
    )
    with pytest.raises(InvalidInput) as refused:
        load_task(path)
    (found,) = [each for each in refused.value.findings if code in ("", each.code)]
    assert expected in found.message and found.place is not None and found.place.line > 0


@pytest.mark.parametrize("far", [1e6, 1e300])
def test_a_line_is_at_most_100_m(far: float) -> None:
    with pytest.raises(NotPlannable, match="straight line"):
        interpolate(Transform.identity(), Transform.of(xyz=(far, 0.0, 0.0)))
