"""Checks whose findings come from reading collision meshes."""

from functools import partial

from manipcli.description.lint.check import Check, reading_check
from manipcli.description.lint.samples import TETRAHEDRON, one_link
from manipcli.description.urdf.link import WITHOUT_IT
from manipcli.shapes.mesh_formats import binary_stl

assets_check = partial(reading_check, "assets")

READING_MESHES: tuple[Check, ...] = (
    assets_check(
        "URDF013",
        "missing-mesh",
        "A collision mesh is not found",
        "A link without its collision shape passes through obstacles. Many descriptions are published without their "
        f"meshes: {WITHOUT_IT}. A missing visual is a warning (URDF033).",
        one_link('filename="package://missing_package/a.stl"', role="collision"),
    ),
    assets_check(
        "URDF200",
        "unusable-mesh",
        "A collision mesh is damaged, empty, too large, or in an unsupported format",
        "An engine crashes (index out of range), misplaces the shape (negative index), or drops it, so that the arm "
        "passes through obstacles.",
        one_link('filename="cut.stl"', role="collision"),
        files=lambda: {"cut.stl": b"cut off".ljust(80) + (12).to_bytes(4, "little") + bytes(50 * 11)},
    ),
    assets_check(
        "URDF201",
        "remote-mesh",
        "A mesh is named by http, ftp, data: or another unsupported URI scheme",
        "manipcli downloads nothing: a description must not depend on a server.",
        one_link('filename="https://example.org/a.stl"'),
    ),
    assets_check(
        "URDF202",
        "outside-mesh",
        "A mesh is outside the description's folder and packages",
        "A description from an untrusted source could name any file of this machine. Symbolic links are resolved "
        "first. `--allow-outside` permits it.",
        one_link('filename="/etc/passwd"'),
    ),
    assets_check(
        "URDF210",
        "flat-mesh",
        "A collision mesh is flat",
        "A collision shape is the convex hull of its vertices; a hull without volume cannot collide.",
        one_link('filename="a.stl"', role="collision"),
        severity="warning",
        files=lambda: {"a.stl": binary_stl(TETRAHEDRON * (1.0, 1.0, 0.0))},
    ),
)
