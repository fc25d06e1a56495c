"""Inertials of links that the robot file states, or has estimated from the shapes of the links (`inertials:`)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from manipcli.core.errors import Diagnostic, Loc
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.core.text import did_you_mean, digits, number_of
from manipcli.description.elements import Inertial, Joint, Link
from manipcli.description.urdf.link import ROUNDING, TRIANGLE_TOLERANCE
from manipcli.model.reporter import Reporter
from manipcli.model.robot import LinkInertial
from manipcli.scene.mass_properties import volume
from manipcli.scene.solids import Solid, solid
from manipcli.shapes.primitives import Sphere
from manipcli.spec.inertials import WATER, InertialsSpec, LinkInertialSpec, MomentsSpec

WITHOUT_SHAPE: Final = 0.025
"""[m] Radius of the ball that stands for a moved link without a shape, on which no other link with mass is fixed."""
ESTIMATE: Final = "add `inertials: estimate` to the robot file"
"""The hint for links without a usable inertial."""


_Found = dict[str, tuple[LinkInertial, Inertial | None]]
"""Inertials by link, and where they come from; None: no mass."""


@dataclass(frozen=True, slots=True)
class _Measured:
    """The solid of a link's shapes, and what it was measured from."""

    solid: Solid
    source: str

    def inertial(self, mass: float, centre: Array | None = None, inertia: Array | None = None) -> Inertial:
        """The solid scaled to `mass` [kg], with another centre (3,) [m] or inertia (3, 3) [kg m2] where given."""
        return Inertial(
            mass=mass,
            X_LI=Transform.of(xyz=self.solid.centre if centre is None else centre),
            inertia=frozen(self.solid.inertia * (mass / self.solid.volume) if inertia is None else inertia),
        )


def repaired_links(spec: InertialsSpec | None, links: Sequence[Link], prefix: str = "") -> Collection[Diagnostic]:
    """The findings about unusable inertials of the description that the robot file replaces."""
    if spec is None:
        return ()
    return {
        finding
        for link in links
        if link.unusable is not None and (spec.estimate is not None or prefix + link.name in spec.links)
        for finding in link.unusable.findings
    }


def with_inertials(
    reporter: Reporter, spec: InertialsSpec | None, links: Sequence[Link], joints: Sequence[Joint]
) -> tuple[list[Link], tuple[LinkInertial, ...]]:
    """The links with the inertials of the robot file, and where these come from.

    Args:
        reporter: receives unknown links, links that cannot be measured, and a note about all estimates.
        spec: `inertials:` of the robot file.
        links, joints: of the whole robot, parents before children.
    """
    if spec is None:
        return list(links), ()
    names = [link.name for link in links]
    for name in spec.links:
        if name not in names:
            hint = did_you_mean(name, names)
            reporter.error("ROBOT306", f"link '{name}' is not in the robot", ("inertials", "links", name), hint=hint)
    found: _Found = {}
    for link in links:
        if link.name in spec.links:
            made = _given(reporter, link, spec.links[link.name], _density(spec))
        elif spec.estimate is not None and link.inertial is None and _measurable(link):
            made = _estimated(link, spec.estimate.density)
        else:
            made = None
        if made is not None:
            found[link.name] = made
    if spec.estimate is not None:
        known = {link.name for link in links if _inertial(link, found) is not None}
        massless = massless_bodies(joints, known)
        for link in links:
            if link.name in massless and link.name not in spec.links:
                found[link.name] = _estimated(link, spec.estimate.density)
        if spec.estimate.total_mass is not None:
            found = _scaled(reporter, spec.estimate.total_mass, links, found)
    rows = tuple(found[link.name][0] for link in links if link.name in found)
    _note(reporter, rows)
    return [replace(link, inertial=_inertial(link, found)) for link in links], rows


def _inertial(link: Link, found: _Found) -> Inertial | None:
    return found[link.name][1] if link.name in found else link.inertial


def _density(spec: InertialsSpec) -> float:
    return WATER if spec.estimate is None else spec.estimate.density


def _measured(link: Link) -> _Measured | None:
    """The solid of the collision shapes, else of the visual shapes; None without a volume."""
    for what, shapes in (("collision", link.collisions), ("visual", link.visuals)):
        found = solid(shapes)
        if found is not None:
            return _Measured(found, f"{what} shapes ({', '.join(found.by)})")
    return None


def _measurable(link: Link) -> bool:
    """Whether the description says how heavy the link is: by its shapes, or by a mass without a usable inertia."""
    return _measured(link) is not None or (link.unusable is not None and link.unusable.mass is not None)


def _ball(mass: float, density: float) -> _Measured:
    """A ball of this mass and density, for a link without shapes."""
    radius = float(np.cbrt(3.0 * mass / (4.0 * np.pi * density)))
    size = volume(Sphere(radius))
    second = np.eye(3) * (size * radius**2 / 5.0)
    return _Measured(
        Solid(size, np.zeros(3), second, ("ball",)), f"no shape: a ball of radius {1000.0 * radius:.3g} mm"
    )


def _estimated(link: Link, density: float) -> tuple[LinkInertial, Inertial]:
    """An inertial from the shapes; without them, of a ball."""
    stated = link.unusable
    mass = stated.mass if stated is not None else None
    centre = stated.X_LI.p if stated is not None and stated.X_LI is not None else None
    measured = _measured(link)
    if measured is None:
        measured = _ball(mass or density * volume(Sphere(WITHOUT_SHAPE)), density)
    inertial = measured.inertial(mass or density * measured.solid.volume, centre)
    return _row(link, "estimated" if mass is None else "repaired", inertial, measured.source), inertial


def _given(
    reporter: Reporter, link: Link, spec: LinkInertialSpec, density: float
) -> tuple[LinkInertial, Inertial | None] | None:
    """The inertial that the robot file states; what it leaves out is from the shapes."""
    loc: Loc = ("inertials", "links", link.name)
    if spec.mass == 0.0:
        return LinkInertial(link.name, "given", 0.0, (0.0,) * 3, (0.0,) * 3, "robot file"), None
    centre = None if spec.centre is None else np.array(spec.centre)
    inertia = None if spec.inertia is None else _matrix(spec.inertia)
    if inertia is not None and (why := _impossible(inertia)):
        reporter.error("ROBOT350", f"link '{link.name}': {why}", (*loc, "inertia"), hint="leave it out to estimate it")
        return None
    if centre is not None and inertia is not None and spec.mass is not None:
        made = Inertial(mass=spec.mass, X_LI=Transform.of(xyz=centre), inertia=frozen(inertia))
        return _row(link, "given", made, "robot file"), made
    measured = _measured(link)
    if measured is None and spec.mass is None:
        message = f"link '{link.name}' has no shape with a volume, so a density gives no mass"
        reporter.error("ROBOT351", message, (*loc, "density"), hint="state its mass instead")
        return None
    if measured is None:
        assert spec.mass is not None
        measured = _ball(spec.mass, density)
    mass = spec.mass if spec.mass is not None else (spec.density or density) * measured.solid.volume
    made = measured.inertial(mass, centre, inertia)
    return _row(link, "given", made, f"robot file and {measured.source}"), made


def _row(link: Link, kind: Literal["given", "estimated", "repaired"], made: Inertial, source: str) -> LinkInertial:
    moments = np.linalg.eigvalsh(made.inertia).tolist()
    return LinkInertial(link.name, kind, made.mass, tuple(made.X_LI.p.tolist()), tuple(moments), source)


def _matrix(spec: MomentsSpec) -> Array:
    rows = ((spec.ixx, spec.ixy, spec.ixz), (spec.ixy, spec.iyy, spec.iyz), (spec.ixz, spec.iyz, spec.izz))
    return np.array(rows, dtype=np.float64)


def _impossible(inertia: Array) -> str | None:
    """Why no body has this inertia (3, 3); None if one has."""
    least, middle, largest = np.linalg.eigvalsh(inertia)
    shown = f"principal moments {least:.4g}, {middle:.4g}, {largest:.4g} kg m2"
    if least <= ROUNDING * largest:
        return f"inertia is not positive definite ({shown})"
    if largest > (least + middle) * (1.0 + TRIANGLE_TOLERANCE):
        return f"impossible {shown}: the largest exceeds the sum of the others"
    return None


def massless_bodies(joints: Sequence[Joint], massive: Collection[str]) -> frozenset[str]:
    """The links that a joint moves with no mass: neither they nor the links fixed to them are `massive`."""
    heavy = set(massive)
    for joint in reversed(joints):  # children come after parents
        if not joint.moves and joint.child in heavy:
            heavy.add(joint.parent)
    return frozenset(joint.child for joint in joints if joint.moves) - heavy


def _scaled(reporter: Reporter, total: float, links: Sequence[Link], found: _Found) -> _Found:
    """The estimates, scaled so that all links together have the mass `total` [kg]."""
    loc = ("inertials", "estimate", "total_mass")
    masses = {link.name: 0.0 if (own := _inertial(link, found)) is None else own.mass for link in links}
    estimated = [name for name, (row, _) in found.items() if row.kind == "estimated"]
    ours = sum(masses[name] for name in estimated)
    known = sum(masses.values()) - ours
    if not estimated:
        hint = "remove it, or correct masses under `links`"
        message = f"total_mass has no effect: every link with a shape has a mass; they have {digits(known)} kg"
        reporter.warning("ROBOT352", message, loc, hint=hint)
        return dict(found)
    if total <= known:
        message = f"total_mass is {digits(total)} kg; the links that are not estimated have {digits(known)} kg already"
        reporter.error("ROBOT352", message, loc, hint="state the mass of the whole robot, with its base")
        return dict(found)
    factor = (total - known) / ours
    scaled = dict(found)
    for name in estimated:
        row, inertial = found[name]
        assert inertial is not None
        heavier = replace(inertial, mass=inertial.mass * factor, inertia=frozen(inertial.inertia * factor))
        moments = tuple(value * factor for value in row.moments)
        scaled[name] = replace(row, mass=heavier.mass, moments=moments), heavier
    return scaled


def _note(reporter: Reporter, rows: Sequence[LinkInertial]) -> None:
    """One line about all links whose inertial was not stated."""
    made = [row for row in rows if row.kind != "given"]
    if not made:
        return
    shown = ", ".join(f"{row.link} {digits(row.mass)} kg" for row in made[:6]) + (", ..." if len(made) > 6 else "")
    message = f"inertials of {number_of(len(made), 'link')} are estimated from shapes: {shown}"
    hint = "`manipcli check` of the robot file shows the table; measured values go under `inertials: {links: ...}`"
    reporter.note("ROBOT353", message, ("inertials",), hint=hint)
