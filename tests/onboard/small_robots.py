"""Descriptions of small robots for tests: a chain of boxes, and hands with known places of their finger tips."""

from __future__ import annotations

from collections.abc import Sequence

LINK = 0.2
"""[m] Length of the links of the arm."""
FINGER = 0.06
"""[m] Length of the fingers."""
OPENING = 0.08
"""[m] Gap between the open fingers."""
AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
"""Axes of the joints of the arm, which stretches along x from its second link on."""


def arm(names: Sequence[str], *, limits: str = 'velocity="2" effort="80"', inertials: bool = True) -> list[str]:
    """Links `names[0]` to `names[6]` with joints between them, as elements."""
    found = [_link(names[0], "0 0 0.05", "0.1 0.1 0.1", inertials)]
    for k, axis in enumerate(AXES):
        place = "0 0 0.15" if k == 0 else "0 0 0.12" if k == 1 else f"{LINK} 0 0"
        size, centre = ("0.06 0.06 0.1", "0 0 0.03") if k == 0 else (f"{LINK - 0.08} 0.05 0.05", f"{LINK / 2} 0 0")
        found.append(_link(names[k + 1], centre, size, inertials))
        found.append(
            f'<joint name="j_{names[k + 1]}" type="revolute"><parent link="{names[k]}"/><child link="{names[k + 1]}"/>'
            f'<origin xyz="{place}"/><axis xyz="{axis}"/><limit lower="-2.6" upper="2.6" {limits}/></joint>'
        )
    return found


def gripper(palm: str, *, reversed_: bool = False, names: Sequence[str] = ("left", "right")) -> list[str]:
    """Two fingers along x of the palm that slide along y; a positive position opens them, if not `reversed_`.

    The inner faces of the tips are `OPENING` apart when open, and meet when closed; they end at x = 0.02 + FINGER.
    """
    found = []
    for name, side in zip(names, (1.0, -1.0), strict=True):
        found.append(_link(name, f"{FINGER / 2} {side * 0.005} 0", f"{FINGER} 0.01 0.02", True))
        at, axis = (side * OPENING / 2, -side) if reversed_ else (0.0, side)
        found.append(
            f'<joint name="slide_{name}" type="prismatic"><parent link="{palm}"/><child link="{name}"/>'
            f'<origin xyz="0.02 {at} 0"/><axis xyz="0 {axis} 0"/>'
            f'<limit lower="0" upper="{OPENING / 2}" velocity="0.2" effort="30"/></joint>'
        )
    return found


def curling(palm: str) -> list[str]:
    """Two fingers of 8 cm along x of the palm that turn about z, from 0.9 rad outwards to 0.9 rad inwards."""
    found = []
    for name, side in (("left", 1.0), ("right", -1.0)):
        found.append(_link(name, "0.04 0 0", "0.08 0.004 0.02", True))
        found.append(
            f'<joint name="curl_{name}" type="revolute"><parent link="{palm}"/><child link="{name}"/>'
            f'<origin xyz="0.02 {side * 0.05} 0"/><axis xyz="0 0 {-side}"/>'
            '<limit lower="-0.9" upper="0.9" velocity="2" effort="3"/></joint>'
        )
    return found


def one_jaw(palm: str) -> list[str]:
    """A fixed jaw along x of the link `palm`, which it is, and one that turns about z away from it."""
    return [
        _link(palm, "0.05 -0.015 0", "0.1 0.01 0.03", True),
        _link("jaw", "0.035 -0.02 0", "0.07 0.01 0.03", True),
        f'<joint name="turn" type="revolute"><parent link="{palm}"/><child link="jaw"/><origin xyz="0.03 0.02 0"/>'
        '<axis xyz="0 0 1"/><limit lower="0" upper="1.6" velocity="3" effort="3"/></joint>',
    ]


def fixed(parent: str, child: str) -> list[str]:
    """A fixed joint at the end of a link of the arm."""
    return [
        f'<joint name="to_{child}" type="fixed"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{LINK} 0 0"/></joint>'
    ]


def robot(*elements: Sequence[str]) -> str:
    """The description of these elements."""
    return f'<robot name="small">{"".join(each for some in elements for each in some)}</robot>'


def palm(name: str, *, parent: str | None = None) -> list[str]:
    """A box that carries fingers, fixed at the end of a link."""
    return [_link(name, "0 0 0", "0.03 0.1 0.04", True), *([] if parent is None else fixed(parent, name))]


def _link(name: str, centre: str, size: str, inertial: bool) -> str:
    shape = f'<origin xyz="{centre}"/><geometry><box size="{size}"/></geometry>'
    mass = (
        f'<inertial><origin xyz="{centre}"/><mass value="0.5"/>'
        '<inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    return f'<link name="{name}">{mass if inertial else ""}<collision>{shape}</collision></link>'
