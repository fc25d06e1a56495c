"""Laws of suction and welds in every engine with physics: what they hold, and what breaks them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from manipcli.core.geometry import Transform
from manipcli.model.holding import Holding
from manipcli.model.robot import RobotModel, Tool
from manipcli.model.state import Contact, ContactPoint, WorldState
from manipcli.shapes.primitives import Box, Geometry
from manipcli.simulate.engine import EngineMember
from manipcli.simulate.holder import Holder, tool_links
from tests.contracts.test_engines import STEP, G, Opens, body, inertial, joint, opens, robot, scene, with_physics, write

__all__ = ["opens"]  # a fixture

F, MU = 20.0, 0.5
DOWN, ALONG_X = (np.pi, 0.0, 0.0), (0.0, np.pi / 2, 0.0)
CUP = Holding("suction", F, 10.0, 0.002)


def arm(holding: Holding, rpy: Sequence[float]) -> RobotModel:
    """A braked arm with the tool at (0, 0, 1)."""
    made = robot([joint("slide", "arm", kind="prismatic", axis=(0.0, 0.0, 1.0))], [inertial(1.0)])
    return replace(made, tool=Tool("arm", Transform.of(rpy=rpy), holding))


def held(member: EngineMember, opens: Opens, holding: Holding, rpy: Sequence[float], mass: float, gap: float) -> Holder:
    """After 0.3 s with a cube of 4 cm at this gap along the tool's z axis, hung up by the tool."""
    model = arm(holding, rpy)
    z = Transform.of(rpy=rpy).R[:, 2]
    at = (0.0, 0.0, 1.0) + (0.02 + gap) * z
    world = scene(body("cube", Box((0.04, 0.04, 0.04)), at, mass=mass, moments=(0.001,) * 3, friction=MU))
    engine = opens(member, model, world, modes=("brake",))
    holder = Holder(model, world, holding, engine, STEP)
    missed = holder.take("cube", engine.read(), engine.contacts())
    if missed:
        assert not holder.attached
        holder.broken = missed
        return holder
    for _ in range(300):
        write(engine, np.zeros(1))
        engine.advance()
        state = engine.read()
        if not holder.attached:
            break
        holder.look(state, engine.contacts())
    return holder


@with_physics
@pytest.mark.parametrize(
    ("holding", "rpy", "limit", "why"),
    [
        (CUP, DOWN, F / G, "pull"),
        (CUP, ALONG_X, MU * F / G, "shear"),
        (replace(CUP, torque=0.1), ALONG_X, 0.1 / (0.0205 * G), "torque"),
        (Holding("weld", F, 10.0), ALONG_X, F / G, "force"),
        (Holding("weld", 1e9, 0.1), ALONG_X, 0.1 / (0.0205 * G), "torque"),
    ],
)
def test_an_attachment_holds_nine_tenths_of_its_limit_and_drops_eleven(
    member: EngineMember, opens: Opens, holding: Holding, rpy: Sequence[float], limit: float, why: str
) -> None:
    strong = held(member, opens, holding, rpy, 0.9 * limit, 5e-4)
    assert (strong.attached, strong.broken) == ("cube", "")
    weak = held(member, opens, holding, rpy, 1.1 * limit, 5e-4)
    assert weak.attached == ""
    assert weak.broken.startswith(f"the {holding.kind} lost 'cube' at ") and f": {why} " in weak.broken


@with_physics
@pytest.mark.parametrize("holding", [CUP, Holding("weld", F, 1.0)])
def test_nothing_is_attached_without_touch(member: EngineMember, opens: Opens, holding: Holding) -> None:
    missed = held(member, opens, holding, DOWN, 0.5, 0.004)
    assert (
        missed.broken == f"the surface of 'cube' is 4 mm from the tool frame, the reach is {holding.reach * 1e3:g} mm"
    )


class Nothing:
    """An engine in which an attachment weighs nothing."""

    def attach(self, name: str) -> np.ndarray:
        return np.zeros(6)

    def detach(self, name: str) -> None:
        pass


def test_only_the_tool_and_what_it_carries_weld_and_only_by_contacts_with_a_direction() -> None:
    box = Geometry(Transform.identity(), Box((0.1, 0.1, 0.1)))
    bare = robot(
        [
            joint("slide", "arm", kind="prismatic", axis=(0.0, 0.0, 1.0)),
            joint("mount", "hand", kind="fixed", parent="arm"),
            joint("frame", "tcp", kind="fixed", parent="hand"),
            joint("close", "finger", kind="prismatic", parent="hand"),
        ],
        [inertial(1.0) for _ in range(4)],
    )
    links = tuple(
        replace(link, collisions=(box,)) if link.name in ("arm", "hand", "finger") else link for link in bare.links
    )
    model = replace(bare, links=links, tool=Tool("tcp", Transform.identity(), Holding("weld", 10.0, 1.0)))
    assert tool_links(model) == {"hand", "tcp", "finger"}
    world = scene(body("cube", Box((0.04, 0.04, 0.04)), (0.0, 0.0, 5.0), mass=1.0, moments=(0.001,) * 3))
    state = WorldState.room(2, 1)
    state.body_position[0], state.body_quat_xyzw[0, 3] = (0.0, 0.0, 5.0), 1.0
    finite, nan = (0.0, 0.0, 1.0), (np.nan,) * 3
    for link, normal, touches in (
        ("arm", finite, False),
        ("hand", finite, True),
        ("finger", finite, True),
        ("finger", nan, False),
    ):
        assert model.tool is not None and model.tool.holding is not None
        holder = Holder(model, world, model.tool.holding, Nothing(), STEP)  # type: ignore[arg-type]
        point = ContactPoint((0.0, 0.0, 0.0), normal, 1.0, (0.0, 0.0, 0.0))
        missed = holder.take("cube", state, [Contact("cube", f"robot/{link}", 1.0, 0.0, (point,))])
        assert (missed == "") == touches, (link, missed)
