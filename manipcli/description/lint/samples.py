"""Building blocks for the bad examples of checks: small valid descriptions, and a tetrahedron in each mesh format."""

from __future__ import annotations

from manipcli.core.geometry import frozen

_CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))

TETRAHEDRON = frozen([[_CORNERS[k] for k in face] for face in _FACES])
"""(4, 3, 3) [m]: the corners of its triangles."""


LIMIT = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'
MOMENTS = '<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>'
INERTIAL = f'<inertial><mass value="1"/>{MOMENTS}</inertial>'
CUBE = '<collision><geometry><box size="0.35 0.35 0.35"/></geometry></collision>'
"""A cube of 1 kg with this size has the moments of `INERTIAL`."""


def robot(inside: str = "") -> str:
    return f'<robot name="r">{inside}</robot>'


def bare_joint(inside: str = "", *, kind: str = "fixed") -> str:
    """Empty links `base` and `tip` with joint `j` between them."""
    ends = '<parent link="base"/><child link="tip"/>'
    return robot(f'<link name="base"/><link name="tip"/><joint name="j" type="{kind}">{ends}{inside}</joint>')


def one_joint(inside: str = LIMIT, *, kind: str = "revolute", tip: str = INERTIAL + CUBE, more: str = "") -> str:
    """Links `base` and `tip` with joint `j` between them, and `more` elements of <robot>."""
    ends = '<parent link="base"/><child link="tip"/>'
    joint = f'<joint name="j" type="{kind}">{ends}{inside}</joint>'
    return robot(f'<link name="base"/><link name="tip">{tip}</link>{joint}{more}')


def another(inside: str = "", *, link: str = INERTIAL, origin: str = '<origin xyz="0 0 1"/>') -> str:
    """Link `other` below `tip`, with joint `k` between them; for `more` of `one_joint`."""
    ends = '<parent link="tip"/><child link="other"/>'
    return f'<link name="other">{link}</link><joint name="k" type="revolute">{origin}{ends}{LIMIT}{inside}</joint>'


def controlled(inside: str) -> str:
    """A <ros2_control>; for `more` of `one_joint`."""
    plugin = "<hardware><plugin>p/P</plugin></hardware>"
    return f'<ros2_control name="c" type="system">{plugin}{inside}</ros2_control>'


GEARED = '<joint name="j"><hardwareInterface>PositionJointInterface</hardwareInterface></joint>'
MOTOR = '<actuator name="m"><mechanicalReduction>1</mechanicalReduction></actuator>'


def transmission(inside: str = GEARED + MOTOR, *, kind: str = "SimpleTransmission") -> str:
    """A ROS 1 transmission; for `more` of `one_joint`."""
    return f'<transmission name="t"><type>transmission_interface/{kind}</type>{inside}</transmission>'


def one_link(mesh: str, *, role: str = "visual") -> str:
    """A description of one link with a <mesh> that has these attributes."""
    return robot(f'<link name="base"><{role}><geometry><mesh {mesh}/></geometry></{role}></link>')


def ascii_tetrahedron() -> bytes:
    facets = []
    for face in _FACES:
        vertices = "".join("vertex {} {} {}\n".format(*_CORNERS[k]) for k in face)
        facets.append(f"facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    return f"solid tetrahedron\n{''.join(facets)}endsolid tetrahedron\n".encode()


def collada_tetrahedron(*, up_axis: str = "Z_UP", meter: float = 1.0) -> bytes:
    numbers = " ".join(f"{value:g}" for corner in _CORNERS for value in corner)
    indices = " ".join(str(k) for face in _FACES for k in face)
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="{meter!r}"/><up_axis>{up_axis}</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">{numbers}</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
""".encode()
