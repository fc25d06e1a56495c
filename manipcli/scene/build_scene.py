"""Builds a `Scene` from `scene:` and `frames:` of a task: shapes, masses and poses, with all findings at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from manipcli.core.errors import Diagnostic, InvalidInput, Loc
from manipcli.core.geometry import Transform, frozen
from manipcli.core.text import digits
from manipcli.description.packages import NotFound, Packages
from manipcli.description.urdf.urdf import Parts
from manipcli.scene import body_files, body_shapes
from manipcli.scene.body_shapes import COLORS, BodyShape, inertial_of, too_big
from manipcli.scene.drop_test import FORMED, bottom, drop_height
from manipcli.scene.jointed import jointed
from manipcli.scene.joints import SceneJoint
from manipcli.scene.layers import Layers
from manipcli.scene.named_frames import in_owner, named_frames, owner
from manipcli.scene.overlap_hints import SHAPES, apart, blamed
from manipcli.scene.scene import SEPARATOR, Body, Frame, Scene
from manipcli.scene.scene_names import Locate, miscounted, misnamed
from manipcli.scene.start_overlap import overlaps
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Cylinder, Rgba
from manipcli.spec.counted import flat_scene, group, members, written
from manipcli.spec.explain import distinct
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec

LONGEST = 10.0
"""[m] Longest movable body: a longer one was probably meant in millimetres."""
_SCALED = {"mesh": "`scale: 0.001`", "urdf": '`scale="0.001 0.001 0.001"` at its mesh'}
EXACT = 1e-9
"""[m] Tolerance for rounding of bodies that fit exactly."""
UPRIGHT = 1.0 - 1e-6
"""Least cosine of the tilt of a supporting or containing body: upright within rounding."""


def build_scene(spec: TaskSpec, *, place: Locate | None = None, packages: Packages | None = None) -> Scene:
    """The scene of a task: the floor first (when there is one), then the bodies as written.

    Args:
        spec: the task; `scene`, `frames`, `floor` and `simulation.gravity` are read.
        place: gives the position in the file of a value such as `("scene", "cup", "inside")`.
        packages: resolves the mesh and URDF files; default: relative to the working directory.

    Raises:
        InvalidInput: all findings: no or several shapes, no or several placements, unknown bodies, parents or
            containers, a missing mass, a wall thicker than its container, bodies that overlap at the start.
    """
    return _Builder(spec, place or (lambda _: None), packages or Packages(None)).build()


class _Builder:
    """Builds one scene and collects the findings of all bodies."""

    def __init__(self, spec: TaskSpec, place: Locate, packages: Packages) -> None:
        self.counted = {name: body for name, body in spec.scene.items() if body.count is not None}
        self.spec = spec.model_copy(update={"scene": flat_scene(spec.scene)}) if self.counted else spec
        self.place: Locate = (lambda loc: place(written(loc, spec.scene))) if self.counted else place
        self.layers = Layers(self.counted, spec.simulation.seed if self.counted else 0)
        self.packages = packages
        self.findings: list[Diagnostic] = []
        self.shapes: dict[str, BodyShape] = {}
        self.kinds: dict[str, str] = {}
        self.moved_by: dict[str, SceneJoint] = {}  # by the body that they move
        self.parts: dict[str, Frame] = {}
        self.files: dict[str, Parts] = {}
        links = {name: body for own, file in spec.scene.items() for name, body in self._read(own, file)}
        self.findings += distinct((*misnamed(self.spec, self.place, links, self.parts), *miscounted(spec, place)))
        if links:
            self.spec = self.spec.model_copy(update={"scene": {**self.spec.scene, **links}})
        self.poses: dict[str, Transform] = {}
        self.unplaced: set[str] = set()
        self.waiting: list[str] = []

    def build(self) -> Scene:
        bodies: list[Body] = []
        if self.spec.floor:
            self._add_shape("floor", "floor", body_shapes.floor())
            self.poses["floor"] = Transform.of(xyz=(0.0, 0.0, -body_shapes.FLOOR_SIZE[2] / 2.0))
            bodies.append(self._body("floor", BodySpec(fixed=True), self.poses["floor"]))
        for name, body in self.spec.scene.items():
            if name not in self.moved_by:
                self._shape(name, body)
        for name in self.spec.scene:
            X_WO = self._pose(name)
            if X_WO is not None and name in self.shapes:
                bodies.append(self._body(name, self.spec.scene[name], X_WO))
        frames = (*named_frames(self.spec), *self.parts.values())
        if not self.findings:
            for a, b, depth in overlaps(bodies, self.moved_by.values()):
                self._error(
                    "TASK226",
                    f"'{a}' and '{b}' overlap by {depth * 1e3:.1f} mm at the start",
                    blamed(self.spec, self.place, [name for name in reversed(self.spec.scene) if name in (a, b)]),
                    apart(self.spec, a, b),
                )
        if self.findings:
            raise InvalidInput(self.findings)
        gravity = frozen(self.spec.simulation.gravity)
        return Scene(tuple(bodies), frames, gravity, tuple(self.moved_by.values()))

    # -- shapes and mass

    def _read(self, name: str, spec: BodySpec) -> Iterator[tuple[str, BodySpec]]:
        """Read the description file of a body; yields what its links have in common with it, if joints move them."""
        loc: Loc = ("scene", name)
        if spec.urdf is None:
            if spec.joints is not None:
                hint = "joints come with `urdf: {file: ...}`"
                self._error("TASK360", f"body '{name}' has `joints` without `urdf`", (*loc, "joints"), hint)
            return
        with self._reported(name, loc, "urdf"):
            self.files[name] = parts = body_files.read_urdf(spec.urdf, self.packages)
            if len(parts.links) == 1 and spec.joints is None:
                return
            made, faults = jointed(name, spec, parts)
            for fault in faults:
                self._error(fault.code, fault.message, (*loc, *fault.loc), fault.hint)
            if spec.count is not None:
                for one in members(name, spec.count):
                    self._add_shape(one, "urdf", None if made.joints else made.shapes[name])
                return
            self.moved_by |= {joint.child: joint for joint in made.joints}
            own = [f"{name}{SEPARATOR}{part}" for part in spec.parts or ()]
            self.parts |= {frame.name: frame for frame in made.frames if frame.name not in own}
            if not faults:
                for body, shape in made.shapes.items():
                    self._add_shape(body, "urdf", shape)
            contact = ("friction", "rolling_friction", "spinning_friction", "restitution")
            common = BodySpec(color=spec.color, **{word: getattr(spec, word) for word in contact})
            yield from ((joint.child, common) for joint in made.joints)

    def _shape(self, name: str, spec: BodySpec) -> None:
        loc: Loc = ("scene", name)
        words = [word for word in SHAPES if getattr(spec, word) is not None]
        if len(words) != 1:
            found = f"has {len(words)} shapes ({', '.join(words)})" if words else "has no shape"
            self._error("TASK221", f"body '{name}' {found}; expected exactly one of {', '.join(SHAPES)}", loc)
            return
        (kind,) = words
        rgba = spec.color or COLORS["desk" if kind == "box" and spec.fixed else kind]
        if name not in self.shapes:
            with self._reported(name, loc, kind):
                self._add_shape(name, kind, self._made(name, spec, rgba))
        shape = self.shapes.get(name)
        if shape is None:
            return
        if spec.fixed:
            if spec.known is not None:
                hint = "remove `known`, or write `fixed: false`"
                self._error("TASK228", f"body '{name}' is fixed: its pose is known exactly", (*loc, "known"), hint)
            return
        around = self.spec.scene.get(spec.inside or "")
        if spec.known is not None and around is not None and around.known is not None:
            message = f"body '{name}' is inside '{spec.inside}', whose pose is not known exactly"
            hint = "remove `known`: it is known exactly relative to its container"
            self._error("TASK228", message, (*loc, "known"), hint)
        if max(shape.size) > LONGEST:
            message = f"body '{name}' is {max(shape.size):.3g} m long; movable bodies are at most {LONGEST:g} m"
            scaled = _SCALED.get(kind, "each size with its unit, such as '80 mm'")
            self._error("TASK222", message, (*loc, kind), f"in millimetres? write {scaled}; else `fixed: true`")
        if kind == "urdf" and shape.inertial is None:
            hint = "add an <inertial> with mass and moments to the link, or write `fixed: true`"
            self._error("TASK223", f"body '{name}' is movable but its URDF has no inertia", (*loc, kind), hint)
        elif kind != "urdf" and spec.mass is None:
            hint = "write `mass: 150 g`, or `fixed: true`"
            self._error("TASK223", f"body '{name}' is movable but has no mass", loc, hint)

    @contextmanager
    def _reported(self, name: str, loc: Loc, kind: str) -> Iterator[None]:
        """Report what is wrong with the shape of a body."""
        try:
            yield
        except NotFound as error:
            self._error("TASK222", f"body '{name}': {error.message}", (*loc, kind, "file"), error.hint)
        except UnusableMesh as error:
            self._error("TASK222", f"body '{name}': its mesh {error.reason}", (*loc, kind, "file"), error.hint)
        except InvalidInput as error:
            at = self.place((*loc, kind, "args"))  # a file that takes no arguments
            self.findings.extend(each if each.place else replace(each, place=at) for each in error.findings)
        except ValueError as error:
            self._error("TASK222", f"body '{name}': {error}", (*loc, kind))

    def _made(self, name: str, spec: BodySpec, rgba: Rgba) -> BodyShape | None:
        """Raises ValueError if the numbers contradict each other or a file cannot be used."""
        if spec.mesh is not None:
            return body_files.mesh(spec.mesh, self.packages, rgba)
        if spec.urdf is None:
            return body_shapes.primitive(spec, rgba)
        parts = self.files.get(group(name, self.counted) or name)
        return None if parts is None or len(parts.links) > 1 else body_files.urdf(spec.urdf, parts, spec.color)

    def _add_shape(self, name: str, kind: str, shape: BodyShape | None) -> None:
        if shape is not None:
            self.shapes[name] = shape
            self.kinds[name] = kind

    def _body(self, name: str, spec: BodySpec, X_WO: Transform) -> Body:
        shape = self.shapes[name]
        inertial = inertial_of(spec, shape)
        return Body(
            name=name,
            kind=self.kinds[name],
            geometries=shape.geometries,
            mass=inertial.mass,
            X_OI=inertial.X_LI,
            inertia=inertial.inertia,
            friction=spec.friction,
            rolling_friction=spec.rolling_friction,
            spinning_friction=spec.spinning_friction,
            restitution=spec.restitution,
            fixed=spec.fixed,
            X_WO=X_WO,
            interior=shape.interior,
            size=shape.size,
            centre=shape.centre,
        )

    # -- poses

    def _pose(self, name: str) -> Transform | None:
        """X_WO of a body; None with a finding (here or at the body that it depends on)."""
        if name in self.poses or name in self.unplaced:
            return self.poses.get(name)
        if name in self.waiting:
            circle = " -> ".join((*self.waiting[self.waiting.index(name) :], name))
            last = self.waiting[-1]
            follower = self.spec.scene[last]
            word = next(
                word
                for word in ("inside", "rests_on", "frame")
                if owner(self.spec, getattr(follower, word), self.parts) == name
            )
            self._error("TASK225", f"circular placement of bodies: {circle}", ("scene", last, word))
            return None
        self.waiting.append(name)
        X_WO = self._placed(name, self.spec.scene[name])
        self.waiting.pop()
        if X_WO is None:
            self.unplaced.add(name)
        else:
            self.poses[name] = X_WO
        return X_WO

    def _placed(self, name: str, spec: BodySpec) -> Transform | None:
        if (joint := self.moved_by.get(name)) is not None:
            X_WP = self._pose(joint.parent)
            return None if X_WP is None else joint.child_pose(X_WP, joint.start)
        loc: Loc = ("scene", name)
        words = [word for word in ("pose", "rests_on", "inside") if getattr(spec, word) is not None]
        if len(words) != 1:
            found = f"has {len(words)} placements ({', '.join(words)})" if words else "has no placement"
            hint = "`pose: {xyz: [x, y, z]}`, or `rests_on: BODY` with `at: [x, y]`, or `inside: CONTAINER`"
            self._error("TASK224", f"body '{name}' {found}", (*loc, words[-1]) if words else loc, hint)
            return None
        if spec.at is None and spec.rests_on is not None:
            self._error("TASK224", f"body '{name}' has `rests_on` without `at: [x, y]`", (*loc, "rests_on"))
            return None
        if spec.at is not None and spec.pose is not None:
            hint = "write the position in the pose: `xyz: [x, y, z]`"
            self._error("TASK224", f"body '{name}' has both `pose` and `at`", (*loc, "at"), hint)
            return None
        if spec.pose is not None:
            if spec.yaw != 0.0:
                hint = "write the yaw in the pose: `rpy: [0, 0, yaw]`"
                self._error("TASK224", f"body '{name}' has both `pose` and `yaw`", (*loc, "yaw"), hint)
            if spec.frame is None or spec.frame == "world":
                return spec.pose.transform
            X_WF = self._frame_pose(spec.frame)
            return None if X_WF is None else X_WF @ spec.pose.transform
        if spec.inside is not None and spec.frame is not None:
            message = f"body '{name}' has both `inside` and `frame`"
            self._error("TASK224", message, (*loc, "frame"), "remove `frame`: `at` is relative to the container")
            return None
        word = "rests_on" if spec.rests_on is not None else "inside"
        other = spec.rests_on or spec.inside or ""
        known = other in self.spec.scene or other in self.poses  # unknown bodies are already reported
        X_WB = self._pose(other) if known else None
        if X_WB is None or name not in self.shapes or other not in self.shapes:
            return None
        if (owner := group(name, self.counted)) is not None:
            return self._layered(name, owner, spec, other, X_WB)
        if word == "inside":
            return self._inside(name, spec, other, X_WB)
        return self._resting(name, spec, other, X_WB)

    def _layered(self, name: str, owner: str, spec: BodySpec, other: str, X_WB: Transform) -> Transform | None:
        """X_WO of a body of a `count`: at its place in the layers, which begin above earlier ones in a container."""
        interior = self.shapes[other].interior if spec.inside is not None else None
        if spec.inside is not None and (interior is None or spec.at is not None):
            return self._inside(name, spec, other, X_WB)  # refused there, or by `miscounted`
        cell = self.layers.cell(name, owner, self.shapes[name], other, interior)
        if isinstance(cell, int):
            message = f"only {cell} of {self.counted[owner].count} '{owner}' fit into '{other}'"
            hint = "write a smaller `count`, or use a larger container: a tenth of their size is between them"
            self._error("TASK293", message, ("scene", owner, "count"), hint)
            return None
        x, y = spec.at or (0.0, 0.0)
        moved = spec.model_copy(update={"at": (x + cell.x, y + cell.y)})
        X_WO = (self._resting if spec.inside is None else self._inside)(name, moved, other, X_WB)
        return None if X_WO is None else Transform.of(xyz=(0.0, 0.0, cell.lift)) @ X_WO

    def _frame_pose(self, name: str) -> Transform | None:
        """X_WF of the `frame` of a body at the start; None with a finding, here or elsewhere."""
        body = owner(self.spec, name, self.parts)
        known = body in self.spec.scene or body in self.poses  # unknown names are already reported
        X_WP = Transform.identity() if body == "world" else self._pose(body) if known else None
        X_PF = in_owner(self.spec, name, self.shapes.get(body), self.parts)
        return None if X_WP is None or X_PF is None else X_WP @ X_PF

    def _resting(self, name: str, spec: BodySpec, other: str, X_WB: Transform) -> Transform | None:
        """X_WO with the body's bottom on the top face of the other, or, for a body from a file, where a drop ends."""
        loc: Loc = ("scene", name, "rests_on")
        support, shape = self.shapes[other], self.shapes[name]
        assert spec.at is not None
        if X_WB.R[2, 2] < UPRIGHT:
            self._error("TASK224", f"body '{name}' cannot rest on '{other}': it is tilted", loc, "use `pose` instead")
            return None
        formed = self.kinds[other] in FORMED
        if not support.flat_top and not formed:
            flat = "rest it on a box, a cylinder or the floor"
            hint = f"write `inside: {other}`" if support.interior is not None else flat
            message = f"body '{name}' cannot rest on '{other}': a {self.kinds[other]} has no flat top"
            self._error("TASK224", message, loc, hint)
            return None
        at, yaw = spec.at, spec.yaw
        if spec.frame is not None and spec.frame != "world":
            X_WF = self._frame_pose(spec.frame)
            if X_WF is None:
                return None
            if X_WF.R[2, 2] < UPRIGHT:
                message = f"'{spec.frame}' is tilted: its `at: [x, y]` is not level"
                self._error("TASK292", message, ("scene", name, "frame"), "use `pose` instead")
                return None
            x, y, _ = X_WF.apply([*at, 0.0])
            at, yaw = (float(x), float(y)), yaw + float(X_WF.rpy[2])
        top = float(X_WB.p[2] + support.centre[2] + support.size[2] / 2.0)
        X_WO = Transform.of(xyz=(*at, top - bottom(shape, Transform.identity())), rpy=(0.0, 0.0, yaw))
        x, y = X_WB.inverse().apply(X_WO.p)[:2] - support.centre[:2]
        if not support.covers(x, y):
            where = f"[{spec.at[0]:g}, {spec.at[1]:g}] m" + (f" in '{spec.frame}'" if spec.frame else "")
            middle = X_WB.apply(support.centre)
            across = f"{support.size[0]:g} by {support.size[1]:g} m"
            hint = f"the top of '{other}' is {across}, centred at [{middle[0]:g}, {middle[1]:g}] m"
            self._error("TASK224", f"'{name}' at {where} is not above '{other}'", ("scene", name, "at"), hint)
            return None
        if not formed:
            return X_WO
        fall = drop_height(shape, X_WO, support, X_WB)
        if fall is None:
            message = f"'{name}' at [{spec.at[0]:g}, {spec.at[1]:g}] m is not above any part of '{other}'"
            self._error("TASK224", message, ("scene", name, "at"), f"choose `at` above a part of '{other}'")
            return None
        return Transform.of(xyz=(0.0, 0.0, -fall)) @ X_WO

    def _inside(self, name: str, spec: BodySpec, other: str, X_WB: Transform) -> Transform | None:
        """X_WO on the floor of the other's interior, `at` and `yaw` relative to its centre."""
        loc: Loc = ("scene", name, "inside")
        interior, shape = self.shapes[other].interior, self.shapes[name]
        if interior is None:
            containers = [known for known, made in self.shapes.items() if made.interior is not None]
            hint = f"containers here: {', '.join(containers)}" if containers else "use a cup or a tray as container"
            self._error("TASK224", f"'{other}' is not a container but a {self.kinds[other]}", loc, hint)
            return None
        if X_WB.R[2, 2] < UPRIGHT:
            self._error("TASK224", f"body '{name}' cannot be inside '{other}': it is tilted", loc, "use `pose` instead")
            return None
        lack = too_big(shape, spec.yaw, interior)
        if lack > EXACT:
            self._error("TASK224", f"'{name}' is {digits(lack * 1e3)} mm too wide for '{other}'", loc)
            return None
        x, y = spec.at or (0.0, 0.0)
        lack = too_big(shape, spec.yaw, interior, x, y)
        if lack > EXACT:
            hint = f"`at` is relative to the centre of '{other}', along its axes"
            message = f"'{name}' is {digits(lack * 1e3)} mm outside the interior of '{other}'"
            self._error("TASK224", message, ("scene", name, "at"), hint)
            return None
        floor = interior.shape.length if isinstance(interior.shape, Cylinder) else interior.shape.size[2]
        return (
            X_WB
            @ interior.X_OS
            @ Transform.of(xyz=(x, y, -floor / 2.0 - bottom(shape, Transform.identity())), rpy=(0.0, 0.0, spec.yaw))
        )

    # -- findings

    def _error(self, code: str, message: str, loc: Loc, hint: str | None = None) -> None:
        place = self.place(("scene", loc[1].partition(SEPARATOR)[0]) if loc[1] in self.moved_by else loc)
        if not self.counted or all((found.code, found.place) != (code, place) for found in self.findings):
            self.findings.append(Diagnostic(code=code, message=message, place=place, hint=hint))
