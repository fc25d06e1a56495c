"""Specs of the scene: bodies with one shape each, and named frames."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.known import KnownSpec
from manipcli.spec.names import BodyName, FrameName
from manipcli.spec.quantity import JointDamping, JointEffort, JointStiffness, JointValue, Length, Mass, Turn
from manipcli.spec.robot import Arguments, PoseSpec

Fraction = Annotated[float, Field(ge=0, le=1)]
MOST: Final = 200
"""Largest `count` of a body."""
Positive = Annotated[int, Field(ge=1, le=MOST)]
Size = Annotated[Length, Field(ge=1e-6, le=100.0)]


class BoxSpec(Model):
    """A solid box; its frame is at its centre."""

    size: tuple[Size, Size, Size] = Field(description="Full lengths along x, y, z [m], 1 um to 100 m.")


class SphereSpec(Model):
    """A solid sphere; its frame is at its centre."""

    radius: Size = Field(description="Radius [m], 1 um to 100 m.")


class CylinderSpec(Model):
    """A solid upright cylinder; its frame is in the middle of its bottom."""

    radius: Size = Field(description="Radius [m], 1 um to 100 m.")
    height: Size = Field(description="Height [m], 1 um to 100 m.")


class HandleSpec(Model):
    """A handle of three bars in the plane y = 0, on the side of x."""

    reach: Size = Field(description="From the outer radius of the cup to its outer side [m], 1 um to 100 m.")
    height: Size = Field(description="Outer height [m], up to that of the cup.")
    middle: Length | None = Field(None, description="Height of its middle [m]. Default: half that of the cup.")
    thickness: Size = Field(0.008, description="Thickness of the bars [m], less than half the height. Default 8 mm.")


class CupSpec(Model):
    """An open cup: a floor disc and a ring of `segments` wall boxes; its frame is in the middle of its bottom."""

    radius: Size = Field(description="Outer radius [m], 1 um to 100 m.")
    height: Size = Field(description="Outer height [m], 1 um to 100 m.")
    wall: Size = Field(0.004, description="Thickness of wall and floor [m], 1 um to 100 m. Default 4 mm.")
    segments: Annotated[int, Field(ge=6, le=64, description="Wall boxes, 6 to 64. Default 16.")] = 16
    handle: HandleSpec | None = Field(
        None, description="Handle; steps treat the cup as if it had none, but for collisions. Default: none."
    )


class TraySpec(Model):
    """An open tray: floor and four walls; its frame is in the middle of its bottom."""

    size: tuple[Size, Size, Size] = Field(description="Outer lengths along x, y, z [m], 1 um to 100 m.")
    wall: Size = Field(0.005, description="Thickness of walls and floor [m], 1 um to 100 m. Default 5 mm.")


MeshCollision = Literal["hull", "parts"]
"""The shape for contact of a mesh: its convex hull, or convex parts of it."""
_COLLISION: Final = (
    "Shape of a mesh for contact: `hull`, its convex hull; `parts`, its convex parts, so that a bowl is hollow (needs "
    "`manipcli[coacd]`). Default: `hull` for a mesh that fills at least 90 % of its hull, else `parts`."
)


class MeshSpec(Model):
    """A mesh file (STL, OBJ, Collada); for contact it is its convex hull or convex parts."""

    file: str = Field(description="Path, relative to this file, or `package://NAME/...`.")
    scale: Annotated[float, Field(ge=1e-6, le=1e6, description="Factor on all three axes, 1e-6 to 1e6. Default 1.")] = (
        1.0
    )
    collision: MeshCollision | None = Field(None, description=_COLLISION)


class UrdfSpec(Model):
    """A URDF or xacro file as an object; with joints that move, each link that they move is the body `BODY/LINK`."""

    file: str = Field(description="URDF or xacro file: a path relative to this file, or `package://NAME/...`.")
    args: Arguments = Field({}, description="Arguments of the xacro file.")
    collision: MeshCollision | None = Field(None, description=_COLLISION)


class SpringSpec(Model):
    """A spring in a joint: its effort is -`stiffness` (position - `rest`)."""

    stiffness: Annotated[JointStiffness, Field(ge=0, le=1e6)] = Field(description="[N m/rad or N/m], 0 to 1e6.")
    rest: Annotated[JointValue, Field(ge=-1e3, le=1e3)] = Field(
        0.0, description="Position at which it is relaxed [rad or m]. Default 0."
    )


class SceneJointSpec(Model):
    """A joint of a body from a URDF file."""

    start: JointValue | None = Field(
        None, description="Position at the start [rad or m]. Default: 0, or the limit nearest to it."
    )
    damping: Annotated[JointDamping, Field(ge=0, le=1e6)] | None = Field(
        None, description="Viscous damping [N m s/rad or N s/m], 0 to 1e6. Default: that of the file."
    )
    friction: Annotated[JointEffort, Field(ge=0, le=1e6)] | None = Field(
        None, description="Dry friction [N m or N], 0 to 1e6. Default: that of the file."
    )
    spring: SpringSpec | None = Field(None, description="A spring. Default: none.")
    closed: JointValue | None = Field(
        None, description="The position that counts as closed [rad or m]. Default: 0, or the limit nearest to it."
    )


class PartSpec(Model):
    """A named part of a body: a frame fixed to it, `BODY/PART` wherever a frame is named."""

    pose: PoseSpec = Field(PoseSpec(), description="Pose of the part in the frame of the body. Default: identity.")
    size: tuple[Size, Size, Size] | None = Field(
        None, description="Its lengths along its x, y, z [m], for `pick` with `part`. Default: it is a point."
    )


class BodySpec(Model):
    """A body of the scene: exactly one shape key, one placement, and contact parameters.

    Placement: `pose` in `frame`, or `rests_on: BODY` with `at: [x, y]` in `frame` (yaw by `yaw`), or `inside:
    CONTAINER`, in its middle or offset from it by `at: [x, y]`.

    `count: 20` makes this body `ball` many, `ball[0]` to `ball[19]`, in layers on what they rest on or in a container.
    """

    box: BoxSpec | None = Field(None, description="Shape: a solid box.")
    sphere: SphereSpec | None = Field(None, description="Shape: a solid sphere.")
    cylinder: CylinderSpec | None = Field(None, description="Shape: a solid upright cylinder.")
    cup: CupSpec | None = Field(None, description="Shape: an open cup.")
    tray: TraySpec | None = Field(None, description="Shape: an open tray.")
    mesh: MeshSpec | None = Field(None, description="Shape: a mesh file.")
    urdf: UrdfSpec | None = Field(None, description="Shapes, masses and joints from a URDF or xacro file.")
    joints: dict[str, SceneJointSpec] | None = Field(
        None,
        description="Start, friction, damping and springs of the joints of `urdf`, by name. Default: as in the file.",
    )
    pose: PoseSpec | None = Field(None, description="Start pose of its frame, in `frame`.")
    frame: FrameName | None = Field(
        None,
        description="What `pose`, or `at` and `yaw` with `rests_on`, refer to: `world`, a body, a part of one "
        "(`desk/top`) or a named frame, as it is at the start. Default: `world`.",
    )
    rests_on: BodyName | None = Field(
        None, description="The body it rests on, which must not be tilted; `at` gives the position."
    )
    at: tuple[Length, Length] | None = Field(
        None,
        description="x, y [m]. With `rests_on`, which needs it: in `frame`. With `inside`: from the middle of the "
        "container, along its axes.",
    )
    yaw: Turn = Field(
        0.0,
        description="Rotation about the vertical [rad], from the x axis of `frame`; with `inside`, of the container. "
        "Default 0.",
    )
    inside: BodyName | None = Field(None, description="The container on whose floor it lies; it must not be tilted.")
    count: Annotated[int, Field(ge=1, le=MOST)] | None = Field(
        None,
        description=f"How many of it there are, 1 to {MOST}: bodies `NAME[0]`, `NAME[1]`, ..., upright in layers "
        "`inside` a container, or around `at` on what they rest on; apart by a tenth of their size, of which the seed "
        "draws half as an offset. They fall and settle before the start. Default: one body, NAME.",
    )
    grid: tuple[Positive, Positive] | None = Field(
        None,
        description="Only with `count`: how many there are along x and along y in a layer. Default: as many as fit "
        "`inside` the container; with `rests_on`, all in one layer.",
    )
    fixed: bool = Field(
        False, description="Whether it never moves; a movable body is at most 10 m long. Default false."
    )
    known: KnownSpec | None = Field(
        None, description="How well the robot knows its pose at the start, of a movable body. Default: exactly."
    )
    mass: Annotated[Mass, Field(gt=0, le=1e5)] | None = Field(
        None, description="Mass [kg], above 0 to 100 t; required unless `fixed` or `urdf`."
    )
    friction: Annotated[float, Field(ge=0)] = Field(
        0.8,
        description="Sliding friction coefficient, 0 or more; the engine multiplies it by the other body's. "
        "Default 0.8.",
    )
    rolling_friction: Annotated[
        float, Field(ge=0, description="Rolling friction coefficient, 0 or more. Default 0.")
    ] = 0.0
    spinning_friction: Annotated[
        float, Field(ge=0, description="Spinning friction coefficient, 0 or more. Default 0.")
    ] = 0.0
    restitution: Fraction = Field(
        0.0, description="Coefficient of restitution, 0 to 1; the engine multiplies it by the other body's. Default 0."
    )
    color: tuple[Fraction, Fraction, Fraction, Fraction] | None = Field(
        None, description="Red, green, blue, opacity, each 0 to 1; only for pictures."
    )
    parts: dict[str, PartSpec] | None = Field(
        None, description="Named parts, for steps and conditions to refer to: `BODY/PART`."
    )


class FrameSpec(Model):
    """A named frame, fixed in `parent`: `world` or a body of the scene."""

    parent: FrameName = Field("world", description="`world` or a body. Default `world`.")
    pose: PoseSpec = Field(PoseSpec(), description="Pose of the frame in its parent. Default: identity.")
