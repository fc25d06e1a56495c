"""Makes the visual meshes of arm and hand: `python generate.py` writes them beside this file.

The arm is Collada, one file a colour (a reader that knows one colour a file sees the right one), the hand binary STL.
All measures are metres, in the frame of the link that the file is named after.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mesh_files import write_collada, write_stl
from surfaces import (
    Array,
    Surface,
    join,
    lathe,
    loft,
    rotation_x,
    rounded_cylinder,
    rounded_rectangle,
    skin,
    smooth_max,
    smooth_min,
)

HERE = Path(__file__).parent
SHELL = (0.90, 0.91, 0.92, 1.0)
DARK = (0.17, 0.18, 0.20, 1.0)
ACCENT = (0.96, 0.45, 0.08, 1.0)
LID = 0.62  # radius of a lid, as a part of its drum's
GAP = 0.003  # from the middle plane of a bending joint to either half drum


@dataclass(frozen=True, slots=True)
class Corner:
    """A tube from z = 0 upwards that ends in half a drum about y: at height `axis`, on the side y < 0.

    `tube`: radius at its mouth, `waist`: where it meets the drum of radius `drum` and half length `reach`.
    """

    tube: float
    waist: float
    drum: float
    reach: float
    axis: float

    def __call__(self, points: Array) -> Array:
        x, y, z = np.moveaxis(points, -1, 0)
        top = self.axis - self.drum - GAP  # below the other link's half
        radial = np.hypot(x, y)
        taper = self.tube + (self.waist - self.tube) * np.clip(z / top, 0.0, 1.0)
        tube = rounded_cylinder(radial + self.waist - taper, z - top / 2.0, self.waist, top / 2.0, 0.005)
        bottom = top - 0.015
        column = rounded_cylinder(
            radial, z - (self.axis + bottom) / 2.0, self.waist - 0.001, (self.axis - bottom) / 2.0, 0.005
        )
        drum = rounded_cylinder(np.hypot(x, z - self.axis), y + self.reach / 2.0, self.drum, self.reach / 2.0, 0.018)
        slab = np.abs(y + (self.reach + GAP) / 2.0) - (self.reach - GAP) / 2.0
        half = smooth_max(smooth_min(column, drum, 0.03), slab, 0.006)
        return smooth_min(tube, half, 0.006)


def corner_shell(shape: Corner, columns: int = 40) -> Surface:
    """Skin of a `Corner`: slices up to the axis of the drum, then a fan over its top."""
    top = shape.axis - shape.drum - GAP
    lean = shape.reach / 2.0
    lip = 0.005 * (1.0 - np.cos(np.linspace(0.1, np.pi / 2.0, 4)))
    heights = np.concatenate(
        [lip, np.linspace(0.005, top - 0.005, 7)[1:-1], top - lip[::-1], top + np.array([0.0005, 0.003, 0.006]),
         np.linspace(top + 0.006, shape.axis, 7)[1:]]
    )  # fmt: skip
    centre_y = -lean * np.clip(heights / (0.8 * top), 0.0, 1.0) ** 2
    turn = np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False)
    level = np.stack([np.cos(turn), np.sin(turn), np.zeros(columns)], axis=-1)
    elevation = np.linspace(0.0, np.pi / 2.0, 11)[1:]
    fan = np.cos(elevation)[:, None, None] * level + np.sin(elevation)[:, None, None] * np.array([0.0, 0.0, 1.0])
    origins = np.concatenate(
        [
            np.column_stack([np.zeros_like(heights), centre_y, heights]),
            np.tile([0.0, -lean, shape.axis], (len(elevation), 1)),
        ]
    )
    directions = np.concatenate([np.tile(level, (len(heights), 1, 1)), fan])
    return skin(shape, origins[:, None, :], directions)


def corner_dark(shape: Corner, *, parent: bool) -> Surface:
    """Lid on the face of the drum; on the lower link of a bending joint also its disc and the collar at the mouth."""
    r = LID * shape.drum
    lid = lathe([(r, -0.002), (r, 0.0012), (r - 0.0015, 0.0027), (0.0, 0.0027)])
    parts = [_on_axis(lid, shape, -shape.reach)]
    if parent:
        r = shape.drum - 0.006
        parts.append(_on_axis(lathe([(r, -2.0 * GAP), (r, 2.0 * GAP)]), shape, 0.0))
        parts.append(collar(shape.tube))
    return join(parts)


def collar(radius: float) -> Surface:
    """What shows in the gap between two links that turn about z."""
    return lathe([(0.0, -0.006), (radius - 0.003, -0.006), (radius - 0.003, 0.005)])


def corner_accent(shape: Corner) -> Surface:
    """A ring round the lid."""
    r = LID * shape.drum
    ring = lathe([(r + 0.004, -0.002), (r + 0.004, 0.0008), (r + 0.003, 0.0018), (r, 0.0018)])
    return _on_axis(ring, shape, -shape.reach)


def _on_axis(part: Surface, shape: Corner, y: float) -> Surface:
    """A lathed part turned so that its +z looks along -y, in the middle of the drum."""
    return part.moved(rotation_x(np.pi / 2.0), (0.0, y, shape.axis))


# --- arm -------------------------------------------------------------------------------------------------------------

UPRIGHT = np.eye(3)
UPRIGHT_LEFT = np.diag([-1.0, -1.0, 1.0])  # half drum at y > 0
HANGING = np.diag([-1.0, 1.0, -1.0])
HANGING_LEFT = np.diag([1.0, -1.0, -1.0])
SEAM = 0.002  # half the visible gap between two links that turn about z
CORNERS = {
    "link_1": (Corner(0.072, 0.070, 0.075, 0.080, 0.19 - SEAM), UPRIGHT),
    "link_2": (Corner(0.066, 0.070, 0.075, 0.080, 0.21 - SEAM), HANGING_LEFT),
    "link_3": (Corner(0.066, 0.064, 0.068, 0.074, 0.19 - SEAM), UPRIGHT_LEFT),
    "link_4": (Corner(0.058, 0.064, 0.068, 0.074, 0.21 - SEAM), HANGING),
    "link_5": (Corner(0.058, 0.053, 0.056, 0.064, 0.19 - SEAM), UPRIGHT),
    "link_6": (Corner(0.047, 0.052, 0.056, 0.064, 0.081 - SEAM), HANGING_LEFT),
}


def arm() -> dict[str, tuple[Surface, tuple[float, float, float, float]]]:
    """File name -> surface and colour."""
    parts = {
        "base_link_shell": (base_shell(), SHELL),
        "base_link_dark": (base_dark(), DARK),
        "link_7_dark": (flange_dark(), DARK),
        "link_7_accent": (flange_accent(), ACCENT),
    }
    for name, (shape, rotation) in CORNERS.items():
        upright = rotation[2, 2] > 0.0
        place = (0.0, 0.0, SEAM if upright else shape.axis)
        parts[f"{name}_shell"] = (corner_shell(shape).moved(rotation, place), SHELL)
        parts[f"{name}_dark"] = (corner_dark(shape, parent=upright).moved(rotation, place), DARK)
        parts[f"{name}_accent"] = (corner_accent(shape).moved(rotation, place), ACCENT)
    return parts


def base_shell() -> Surface:
    """A column that flares into the foot."""
    angle = np.linspace(0.0, np.pi / 2.0, 9)
    flare = [(0.092 - 0.020 * np.sin(a), 0.062 - 0.042 * np.cos(a)) for a in angle]
    rim = [(0.072 - 0.005 * (1.0 - np.cos(a)), 0.1405 + 0.005 * np.sin(a)) for a in np.linspace(0.0, np.pi / 2.0, 5)]
    return lathe([(0.092, 0.014), *flare, *rim, (0.0, 0.1475)], columns=44)


def base_dark() -> Surface:
    """The plate under the foot."""
    return lathe([(0.0, 0.0), (0.100, 0.0), (0.100, 0.011), (0.097, 0.014), (0.05, 0.014)], columns=44)


def flange_dark() -> Surface:
    """The wrist's last disc with the plate that the hand is bolted to."""
    return lathe(
        [(0.0, -0.004), (0.041, -0.004), (0.041, 0.004), (0.046, 0.004), (0.046, 0.016), (0.043, 0.016), (0.043, 0.022),
         (0.046, 0.022), (0.046, 0.040), (0.044, 0.042), (0.040, 0.042), (0.040, 0.045), (0.0, 0.045)]
    )  # fmt: skip


def flange_accent() -> Surface:
    """The ring in the groove of the flange."""
    return lathe([(0.043, 0.016), (0.0455, 0.0165), (0.0455, 0.0215), (0.043, 0.022)])


# --- hand ------------------------------------------------------------------------------------------------------------


def palm() -> Surface:
    """Adapter, tapered housing and the three knuckle brackets."""
    housing = loft(
        [
            rounded_rectangle(0.086, 0.090, 0.040),
            rounded_rectangle(0.092, 0.098, 0.034),
            rounded_rectangle(0.108, 0.118, 0.020),
            rounded_rectangle(0.110, 0.120, 0.018),
            rounded_rectangle(0.110, 0.120, 0.018),
            rounded_rectangle(0.108, 0.119, 0.017),
            rounded_rectangle(0.104, 0.116, 0.015),
        ],
        [0.000, 0.004, 0.018, 0.022, 0.040, 0.045, 0.047],
    )
    cheeks = [
        cheek(x + side * 0.0115, y) for x, y in ((0.030, 0.052), (-0.030, 0.052), (0.0, -0.052)) for side in (-1.0, 1.0)
    ]
    return join([housing, *cheeks])


def cheek(x: float, y: float) -> Surface:
    """One plate of the bracket that holds a finger: a half disc over a block, about the joint's axis (z = 0.05)."""
    turn = np.linspace(0.0, np.pi, 9)
    outline = np.column_stack([0.0078 * np.cos(turn), 0.0078 * np.sin(turn)])
    outline = np.concatenate([outline, [(-0.0078, -0.006), (0.0078, -0.006)]])
    plate = loft([outline, outline], [-0.002, 0.002])
    # the outline's plane (u, v) becomes (y, z), its normal x
    return plate.moved(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), (x, y, 0.050))


def knuckle(radius: float, width: float, z: float) -> Surface:
    """A cylinder along x."""
    turn = np.linspace(0.0, 2.0 * np.pi, 20, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    half = width / 2.0
    cylinder = loft([0.88 * radius * circle, radius * circle, radius * circle, 0.88 * radius * circle],
                    [-half, -half + 0.001, half - 0.001, half])  # fmt: skip
    return cylinder.moved(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), (0.0, 0.0, z))


def phalanx_sections(rows: list[tuple[float, float, float, float]]) -> tuple[list[Array], list[float]]:
    """Sections of a finger from (z, width in x, inner y, outer y)."""
    sections = [
        rounded_rectangle(width, outer - inner, 0.42 * min(width, outer - inner), 4, (outer + inner) / 2.0)
        for _, width, inner, outer in rows
    ]
    return sections, [row[0] for row in rows]


def proximal() -> Surface:
    """First phalanx of a finger at y > 0: it closes towards -y. Its fork takes the distal knuckle."""
    body = loft(
        *phalanx_sections(
            [
                (0.004, 0.013, -0.0055, 0.0060),
                (0.010, 0.0165, -0.0065, 0.0078),
                (0.024, 0.0180, -0.0065, 0.0080),
                (0.048, 0.0170, -0.0065, 0.0076),
                (0.059, 0.0160, -0.0060, 0.0070),
                (0.064, 0.0140, -0.0050, 0.0060),
            ]
        )
    )
    return join(
        [knuckle(0.0080, 0.0180, 0.0), body, knuckle(0.0070, 0.0180, 0.070), *(fork(s * 0.0072) for s in (-1, 1))]
    )


def fork(x: float) -> Surface:
    """One side of the fork between body and distal knuckle."""
    return loft([rounded_rectangle(0.0036, 0.012, 0.001, 2)] * 2, [0.056, 0.070]).moved(np.eye(3), (x, 0.0, 0.0))


def distal() -> Surface:
    """Last phalanx with a rounded tip."""
    rows = [(0.000, 0.0100, -0.0050, 0.0050), (0.009, 0.0150, -0.0065, 0.0070), (0.034, 0.0165, -0.0065, 0.0070)]
    for angle in np.linspace(0.15, 1.0, 6) * np.pi / 2.0:
        shrink = np.cos(angle)
        rows.append((0.041 + 0.014 * np.sin(angle), 0.0165 * shrink**0.6, -0.0065 * shrink**0.5, 0.0070 * shrink))
    rows[-1] = (0.055, 0.0040, -0.0030, 0.0)
    return loft(*phalanx_sections(rows))


def pad(start: float, end: float, width: float) -> Surface:
    """A cushion on the inner side, its face at y = -0.008."""
    rows = [(0.0, 0.6), (0.0012, 0.9), (0.003, 1.0)]
    levels = rows + [(end - start - z, scale) for z, scale in reversed(rows)]
    sections = [rounded_rectangle(width * scale, 0.004 * scale, 0.0015 * scale, 3, -0.006) for _, scale in levels]
    return loft(sections, [start + z for z, _ in levels])


def hand() -> dict[str, Surface]:
    """File name -> surface."""
    return {
        "palm": palm(),
        "palm_pad": loft(
            [rounded_rectangle(0.070, 0.070, 0.012), rounded_rectangle(0.070, 0.070, 0.012),
             rounded_rectangle(0.066, 0.066, 0.010)], [0.044, 0.0485, 0.050]),
        "finger_proximal": proximal(),
        "finger_proximal_pad": pad(0.016, 0.054, 0.0140),
        "finger_distal": distal(),
        "finger_distal_pad": pad(0.012, 0.044, 0.0140),
    }  # fmt: skip


def main() -> None:
    """Writes every mesh."""
    for name, (surface, rgba) in arm().items():
        write_collada(HERE / f"{name}.dae", surface, rgba)
    for name, surface in hand().items():
        write_stl(HERE / f"{name}.stl", surface)


if __name__ == "__main__":
    main()
