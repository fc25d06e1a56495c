"""Conditions on contacts, joints, references and time: margins in closed form, good and spoilt, for any cut."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from manipcli.conditions.condition import CheckContext, Condition, World
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.robustness import Robustness
from manipcli.conditions.state_window import Reference, StateWindow, StepTime, Touching
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Joint, JointLimits, JointType, Link
from manipcli.model.robot import Group, RobotModel, Tool
from manipcli.model.state import Contact, WorldState
from manipcli.scene.build_scene import build_scene
from manipcli.shapes.primitives import Geometry, Sphere
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec

PERIOD, T = 0.01, 101
TIMES = np.arange(T) * PERIOD
ARM = 0.5
"""[m] from the axis of the turning joint to the tool."""


def joint(name: str, kind: JointType, parent: str, child: str, axis: tuple[float, float, float], x: float) -> Joint:
    limits = JointLimits(lower=-1.0, upper=2.0, velocity=4.0, effort=10.0)
    return Joint(name, kind, parent, child, Transform.of(xyz=(x, 0, 0)), frozen(axis), limits)


ROBOT = RobotModel(
    name="arm",
    root="base",
    links=tuple(Link(name, None, (), ()) for name in ("base", "one", "finger", "thumb")),
    joints=(
        joint("j1", "revolute", "base", "one", (0, 0, 1), 0.0),
        joint("slide", "prismatic", "one", "finger", (1, 0, 0), 0.0),
        joint("spin", "continuous", "one", "thumb", (0, 0, 1), 0.0),
    ),
    groups=(Group("arm", ("j1",)), Group("all", ("j1", "slide")), Group("endless", ("spin",))),
    poses=(),
    transmissions=(),
    X_WB=Transform.identity(),
    urdf="",
    tool=Tool("one", Transform.of(xyz=(ARM, 0, 0))),
)
BODIES: dict[str, Any] = {
    "desk": {"box": {"size": [1, 1, 0.4]}, "pose": {"xyz": [0, 0, 0.2]}, "fixed": True},
    "cube": {"box": {"size": [0.1, 0.1, 0.1]}, "mass": 2.0, "rests_on": "desk", "at": [0.3, 0.0]},
}
SCENE = build_scene(
    TaskSpec.model_construct(
        task="t", floor=False, scene={name: BodySpec.model_validate(body) for name, body in BODIES.items()}
    )
)
CUBE = SCENE.body("cube")


def still(**changes: Array) -> StateWindow:
    """One second of nothing, in which all that can be followed is."""
    states = WorldState(
        time=TIMES,
        position=np.zeros((T, 3)),
        velocity=np.zeros((T, 3)),
        effort=np.zeros((T, 3)),
        body_position=np.tile(CUBE.X_WO.p, (T, 1, 1)),
        body_quat_xyzw=np.tile(CUBE.X_WO.quat_xyzw, (T, 1, 1)),
        body_linear=np.full((T, 1, 3), np.nan),
        body_angular=np.full((T, 1, 3), np.nan),
    )
    steps = (StepTime("go", 0.2, 0.5, "done"), StepTime("then", 0.5, 0.8, "failed"), StepTime("last", None, None, ""))
    reference = Reference(ROBOT.joint_names, np.zeros((T, 3)))
    return StateWindow(replace(states, **changes), None, (reference,), (), steps)


WORLD = World(
    robot=ROBOT,
    scene=SCENE,
    start=still().states.map(lambda a: a[0]),
    referenced=frozenset(ROBOT.joint_names),
    steps=("go", "then", "last"),
)


def touching(*changes: tuple[float, list[tuple[str, str, float]]]) -> StateWindow:
    return replace(
        still(),
        contacts=tuple(Touching(t, tuple(Contact(a, b, f, -1e-4) for a, b, f in pairs)) for t, pairs in changes),
    )


def read(name: str, moments: StateWindow, **written: Any) -> Robustness:
    """The whole at once, after it gave the same in pieces, with a tick alone and without regard of where it is cut."""
    condition: Condition[Any] = CONDITIONS[name]
    spec = condition.spec.model_validate(written)
    assert condition.check(spec, CheckContext(ROBOT, SCENE, WORLD.steps)) == ()
    assert condition.absent(spec, WORLD) is None
    whole: Robustness = condition.open(spec, WORLD)(moments)
    assert whole.margins.shape == whole.relative.shape == whole.applies.shape == (T,)
    assert set(whole.units) <= set(condition.units)
    monitor = condition.open(spec, WORLD)
    pieces: list[Robustness] = [monitor(moments.part(a, b)) for a, b in ((0, 1), (1, 37), (37, 38), (38, 90), (90, T))]
    for field in ("margins", "relative", "applies"):
        np.testing.assert_array_equal(np.concatenate([getattr(one, field) for one in pieces]), getattr(whole, field))
    assert pieces[3].found(20) == whole.found(58)
    np.testing.assert_array_equal(np.sign(whole.relative), np.sign(whole.margins))
    return whole


GRIP = [("cube", "robot/finger", 5.0), ("cube", "robot/thumb", 3.0)]


def test_grasped_is_the_second_hardest_of_two_links() -> None:
    found = read(
        "grasped",
        touching((0.1, [("cube", "desk", 19.6)]), (0.2, [*GRIP[:1], ("cube", "desk", 9.0)]), (0.3, GRIP), (0.6, [])),
        object="cube",
        above=1.0,
    )
    assert found.margins[[0, 15, 25, 29, 30, 59, 60]] == pytest.approx([-1, -1, -1, -1, 2, 2, -1])
    assert found.found(30).text == (
        "'cube' is touched by 'robot/finger' with 5 N and 'robot/thumb' with 3 N; two links with at least 1 N"
    )
    assert "is not touched by the robot" in found.found(0).text


def test_one_link_that_touches_twice_is_no_grasp() -> None:
    twice = touching((0.0, [("cube", "robot/finger", 5.0), ("cube", "robot/finger", 5.0)]))
    assert read("grasped", twice, object="cube").margins[0] == pytest.approx(-0.1)


def test_rests_on_is_the_share_of_the_weight() -> None:
    weight = 2.0 * 9.81
    held = touching((0.0, [("cube", "desk", weight)]), (0.5, [("cube", "desk", 0.25 * weight)]))
    found = read("rests_on", held, object="cube", of="desk")
    assert found.margins[[0, 49, 50]] == pytest.approx([weight / 2, weight / 2, -weight / 4])
    assert found.found(0).text == "'cube' presses on 'desk' with 19.6 N, its weight is 19.6 N; at least 9.81 N"


@pytest.mark.parametrize("share", [0.5, 0.1, 1.0])
def test_what_rests_on_nothing_is_its_whole_share_short(share: float) -> None:
    wanted = share * 2.0 * 9.81
    pressed = touching((0.5, [("cube", "desk", wanted)]), (0.75, [("cube", "desk", 3 * wanted)]))
    found = read("rests_on", pressed, object="cube", of="desk", share=share)
    assert found.relative[[0, 75]] == pytest.approx([-1.0, 2.0])


def test_rests_on_adds_up_what_the_two_touch_with_and_nothing_else() -> None:
    held = touching((0.0, [("cube", "desk", 3.0), *GRIP, ("desk", "cube", 4.0), ("desk", "robot/one", 50.0)]))
    assert read("rests_on", held, object="cube", of="desk", share=0.25).margins[0] == pytest.approx(7.0 - 0.5 * 9.81)


def test_a_weight_is_that_in_the_gravity_of_the_scene() -> None:
    """On the moon, and on a table that is tilted: the size of the gravity counts."""
    condition: Condition[Any] = CONDITIONS["rests_on"]
    world = replace(WORLD, scene=replace(SCENE, gravity=frozen([0.6, 0.0, -0.8 * 2.0])))
    found = condition.open(condition.spec(object="cube", of="desk"), world)(touching((0.0, [("cube", "desk", 3.0)])))
    assert found.margins[0] == pytest.approx(3.0 - 0.5 * 2.0 * np.hypot(0.6, 1.6))


def test_contact_force_sums_up_and_is_bounded_on_both_sides() -> None:
    moments = touching((0.0, [("cube", "desk", 19.6), *GRIP]), (0.5, GRIP))
    pair = {"pair": ["robot", "cube"]}
    assert read("contact_force", moments, **pair, below=10).margins[0] == pytest.approx(2.0)
    assert read("contact_force", moments, **pair, below=10, above=7.5).margins[0] == pytest.approx(0.5)
    assert read("contact_force", moments, of="cube", below=20).margins[[0, 50]] == pytest.approx([-7.6, 12])
    assert read("contact_force", moments, of="robot", above=9).margins[0] == pytest.approx(-1)
    text = read("contact_force", moments, pair=["robot/thumb", "cube"], above=4).found(0).text
    assert text == "the force between 'robot/thumb' and 'cube' is 3 N; above 4 N"


def test_a_mean_force_is_that_of_its_window_however_the_ticks_come() -> None:
    """Against the mean of the ticks before each; all at once, a few at a time, of a log that holds every seventh."""
    rng = np.random.default_rng(4)
    forces = rng.uniform(0.0, 100.0, T)
    moments = touching(*((float(t), [("cube", "robot/one", force)]) for t, force in zip(TIMES, forces, strict=True)))
    condition: Condition[Any] = CONDITIONS["contact_force"]
    for ticks in (1, 7, 2 * T):
        window = {"of": "cube", "above": 1.0, "mean_over": ticks * PERIOD}
        means = [forces[0], *(forces[max(0, k - ticks) : k].mean() for k in range(1, T))]
        found = read("contact_force", moments, **window).margins
        assert found == pytest.approx(np.array(means) - 1.0)
        for cuts in ([0, 1, 4, 30, 31, T], [*range(T + 1)]):
            monitor = condition.open(condition.spec.model_validate(window), WORLD)
            parts = [monitor(moments.part(first, last)).margins for first, last in pairwise(cuts)]
            assert np.array_equal(np.concatenate(parts), found)
        monitor = condition.open(condition.spec.model_validate(window), WORLD)
        thinned = monitor(replace(moments, states=moments.states.map(lambda a: a[::7])))
        assert thinned.margins == pytest.approx(found[::7])
    text = read("contact_force", moments, of="cube", above=1, mean_over="50 ms").found(0).text
    assert text.startswith("the mean force over 50 ms on 'cube' is ")


def test_collision_and_its_absence_name_the_hardest_touch() -> None:
    moments = touching((0.2, [("desk", "robot/one", 2.0), ("desk", "robot/thumb", 5.0)]), (0.4, []))
    none = read("no_collision", moments, pairs=[["robot", "desk"]])
    assert none.margins[[0, 19, 20, 39, 40]] == pytest.approx([0, 0, -5, -5, 0])
    assert (none.found(20).text, none.found(20).at) == ("'desk' and 'robot/thumb' touch with 5 N", 0.2)
    assert (none.found(0).text, none.found(0).at) == ("no contact", None)
    some = read("collision", moments, pairs=[["desk", "robot/one"]], above=1.5)
    assert some.margins[[0, 20, 40]] == pytest.approx([-1.5, 0.5, -1.5])
    short = CONDITIONS["collision"].spec.model_validate(["robot", "desk"])
    assert (short.pairs, short.above) == ((("robot", "desk"),), 0.01)


def carried(slide: Array, turn: Array) -> StateWindow:
    """The arm turns by a radian with the cube in its hand, in which the cube slides along x and turns about z."""
    q = np.zeros((T, 3))
    q[:, 0] = TIMES
    start = SCENE.body("cube").X_WO
    hands = [Transform.of(rpy=(0, 0, angle)) for angle in q[:, 0]]
    inside = [
        Transform.of(xyz=start.p + np.array([far, 0, 0]), rpy=(0, 0, angle))
        for far, angle in zip(slide, turn, strict=True)
    ]
    poses = [hand @ X for hand, X in zip(hands, inside, strict=True)]
    return still(
        position=q,
        body_position=np.array([[X.p] for X in poses]),
        body_quat_xyzw=np.array([[X.quat_xyzw] for X in poses]),
    )


def test_slip_is_what_moves_in_the_hand_since_it_was_taken() -> None:
    moments = carried(0.02 * TIMES, np.zeros(T))
    moments = replace(moments, contacts=tuple(touching((0.2, GRIP), (0.8, [])).contacts))
    found = read("slip", moments, object="cube", within=0.01)
    assert list(np.flatnonzero(found.applies)) == list(range(20, 80))
    np.testing.assert_allclose(found.margins[20:80], 0.01 - 0.02 * (TIMES[20:80] - 0.2), atol=1e-12)
    assert found.found(79).text == "'cube' slipped by 11.8 mm; within 10 mm"


def test_slip_is_a_turn_too_and_a_new_grasp_begins_anew() -> None:
    # Let go for one tick: the same grasp; for 0.2 s: another.
    changes = ((0.1, GRIP), (0.3, []), (0.31, GRIP), (0.5, []), (0.7, GRIP))
    moments = replace(carried(np.zeros(T), 0.5 * TIMES), contacts=touching(*changes).contacts)
    found = read("slip", moments, object="cube", within=0.01, rotation=0.2)
    assert not found.applies[30]
    assert not found.applies[50:70].any()
    for k, since in ((49, 0.1), (99, 0.7)):
        told = found.found(k)
        assert (told.unit, told.margin) == ("rad", pytest.approx(0.2 - 0.5 * (TIMES[k] - since)))
    assert "'cube' rotated in the hand by" in found.found(49).text
    # Where nothing slips at all, both have all of their tolerance left, and the first is told.
    assert (found.found(70).unit, found.found(70).margin) == ("m", pytest.approx(0.01))


def test_an_object_that_nobody_holds_has_no_slip() -> None:
    found = read("slip", touching((0.0, GRIP[:1])), object="cube", within=0.01)
    assert not found.applies.any()
    assert found.idle == "'cube' was never held by two links with 0.1 N each"


def test_tool_speed_is_that_of_a_point_on_a_circle() -> None:
    speed = np.stack([2.0 * TIMES, np.zeros(T), np.zeros(T)], axis=1)
    found = read("tool_speed", still(velocity=speed, position=speed), below=0.6)
    np.testing.assert_allclose(found.margins, 0.6 - ARM * 2.0 * TIMES, atol=1e-12)
    assert found.found(100).text == "the tool moves at 1 m/s; below 600 mm/s"
    # The finger slides out at 1 m/s on an arm that turns: two speeds at right angles.
    both = np.tile([3.0, 1.0, 0.0], (T, 1))
    at = np.tile([0.0, 0.4, 0.0], (T, 1))
    found = read("tool_speed", still(velocity=both, position=at), below=1.0, link="finger")
    assert found.margins[0] == pytest.approx(1.0 - np.hypot(1.0, 3.0 * 0.4))


def test_energy_is_the_positive_work_of_the_joints() -> None:
    # tau = 3 and v = cos(2 pi t): the work of the first and last quarter, and none of the half in which it brakes.
    speed = np.cos(2.0 * np.pi * TIMES)
    velocity, effort = np.zeros((T, 3)), np.zeros((T, 3))
    velocity[:, 0], effort[:, 0] = speed, 3.0
    velocity[:, 1], effort[:, 1] = -2.0, -1.0
    found = read("energy", still(velocity=velocity, effort=effort), below=10)
    assert found.margins[0] == 10.0
    assert found.margins[-1] == pytest.approx(10 - 2.0 - 3.0 / np.pi, abs=1e-3)  # trapezoids: (2 pi / 100)^2 / 12
    np.testing.assert_array_less(-1e-12, -np.diff(found.margins))
    assert found.found(100).text == "2.95 J; below 10 J"
    arm = read("energy", still(velocity=velocity, effort=effort), below=0.9, group="arm")
    assert arm.margins[-1] == pytest.approx(0.9 - 3.0 / np.pi, abs=1e-3)


def test_the_largest_share_of_a_limit_decides() -> None:
    position, velocity, effort = np.zeros((T, 3)), np.zeros((T, 3)), np.zeros((T, 3))
    position[10, 0] = 1.9  # 0.1 rad of a half range of 1.5 left
    velocity[20, 1] = 4.2  # 0.2 m/s too much, of 4
    effort[30, 0] = -8.0
    moments = still(position=position, velocity=velocity, effort=effort)
    found = read("limits", moments)
    texts = {
        10: ("rad", 0.1, "position of joint 'j1' is 109 deg; allowed -57.3 deg to 115 deg"),
        20: ("m/s", -0.2, "velocity of joint 'slide' is 4.2 m/s; allowed -4 m/s to 4 m/s"),
        30: ("N m", 2.0, "effort of joint 'j1' is -8 N m; allowed -10 N m to 10 N m"),
    }
    for k, (unit, margin, text) in texts.items():
        told = found.found(k)
        assert (told.unit, told.margin, told.text) == (unit, pytest.approx(margin), text)
    spare = read("limits", moments, group="arm", of=["effort"], spare=0.3)
    assert spare.margins[[0, 30]] == pytest.approx([7.0, -1.0])


def test_tracking_errs_the_short_way_round_and_rests_while_nobody_is_active() -> None:
    reference = np.zeros((T, 3))
    reference[:, 0], reference[:, 2] = 0.03, 2.0 * np.pi - 0.02
    reference[:10] = np.nan
    other = np.full((T, 1), np.nan)
    other[5:10, 0] = 0.04
    moments = replace(still(), references=(Reference(ROBOT.joint_names, reference), Reference(("j1",), other)))
    found = read("tracking", moments, group="arm", within=0.05)
    assert list(np.flatnonzero(~found.applies)) == [0, 1, 2, 3, 4]
    assert found.margins[[5, 9, 10]] == pytest.approx([0.01, 0.01, 0.02])
    assert found.idle == "no controller of joint 'j1' was active"
    assert read("tracking", moments, group="endless", within=0.05).margins[-1] == pytest.approx(0.03)
    assert read("tracking", moments, group="all", within=0.05).found(50).unit == "rad"


def test_a_joint_on_its_reference_has_all_of_its_tolerance_left() -> None:
    """Wherever that is; and beside it, what is left is the same on both sides."""
    reference = np.ones((T, 3))
    reference[50], reference[51] = 1.02, 0.98
    moments = replace(still(position=np.ones((T, 3))), references=(Reference(ROBOT.joint_names, reference),))
    for group in ("arm", "all", "endless"):
        found = read("tracking", moments, group=group, within=0.05)
        assert found.margins[[0, 50, 51]] == pytest.approx([0.05, 0.03, 0.03])


def test_tracking_of_a_joint_without_a_controller_cannot_be_judged() -> None:
    condition: Condition[Any] = CONDITIONS["tracking"]
    spec = condition.spec(group="all", within=0.1)
    assert condition.absent(spec, replace(WORLD, referenced=frozenset({"j1"}))) == (
        "the recording has no reference of joint 'slide'"
    )


def test_a_joint_that_leans_on_its_stop_keeps_its_limit_and_one_beyond_it_is_told_with_digits_that_differ() -> None:
    position = np.zeros((T, 3))
    position[10:13, 0] = 2.0 + 5e-5, 2.0 + 2e-4, -1.0 - 9e-5
    found = read("limits", still(position=position), of=["position"], group="arm")
    assert found.margins[10:13] == pytest.approx([0.0, -2e-4, 0.0])
    assert (found.margins >= 0.0)[[10, 12]].all()
    assert found.found(11).text == "position of joint 'j1' is 114.6 deg; allowed -57.296 deg to 114.59 deg"
    assert found.found(10).text == "position of joint 'j1' is 114.594 deg; allowed -57.2958 deg to 114.592 deg"
    spare = read("limits", still(position=position - 0.15), of=["position"], group="arm", spare=0.1)
    assert spare.margins[10] == pytest.approx(-5e-5), "what is to be left is no stop"


@pytest.mark.parametrize(
    ("name", "written", "told"),
    [
        ("energy", {"below": 1}, "joints have no efforts"),
        ("tracking", {"group": "arm", "within": 0.1}, "tracking is ideal"),
        ("limits", {}, "joints have no efforts; use `of: [position, velocity]`"),
        ("limits", {"of": ["effort"]}, "joints have no efforts"),
        ("limits", {"of": ["velocity", "position"]}, None),
    ],
)
def test_what_is_true_by_definition_without_physics_is_not_judged(
    name: str, written: dict[str, Any], told: str | None
) -> None:
    condition: Condition[Any] = CONDITIONS[name]
    spec = condition.spec.model_validate(written)
    world = replace(WORLD, referenced=frozenset(ROBOT.joint_names))
    assert condition.absent(spec, world) is None
    reason = None if told is None else f"the engine has no physics, so {told}"
    assert condition.absent(spec, replace(world, physics=False)) == reason


def test_without_limits_of_efforts_there_is_nothing_that_needs_physics() -> None:
    joints = tuple(replace(one, limits=replace(one.limits, effort=None)) for one in ROBOT.joints)
    world = replace(WORLD, robot=replace(ROBOT, joints=joints), physics=False)
    condition: Condition[Any] = CONDITIONS["limits"]
    assert condition.absent(condition.spec(), world) is None


def test_duration_counts_from_the_first_tick_that_is_shown() -> None:
    condition: Condition[Any] = CONDITIONS["duration"]
    late = condition.open(condition.spec(below="250 ms"), WORLD)(still().part(20, 61))
    assert late.margins[[0, 25, 40]] == pytest.approx([0.25, 0.0, -0.15])
    assert late.found(40).text == "0.400 s; below 0.25 s"
    assert read("duration", still(), below=2).margins[-1] == pytest.approx(1.0)


def test_a_step_is_done_from_its_end_on() -> None:
    for step, word, done in (("go", "done", 50), ("then", "failed", T), ("last", "not run", T)):
        found = read("step_done", still(), step=step)
        np.testing.assert_array_equal(found.margins, np.where(np.arange(T) >= done, 1.0, -1.0))
        assert found.found(T - 1).text == f"step '{step}': {word}"
    early = read("step_done", still(), step="go").found(30)
    assert (early.text, early.at) == ("step 'go': not done before 0.50 s", pytest.approx(still().times[30]))


@pytest.mark.parametrize(
    ("name", "written", "loc", "hint"),
    [
        ("grasped", {"object": "desk"}, ("object",), None),
        ("rests_on", {"object": "cube", "of": "dsk"}, ("of",), "did you mean 'desk'?"),
        ("slip", {"object": "cub", "within": 1}, ("object",), "did you mean 'cube'?"),
        ("slip", {"object": "cube", "within": 1, "link": "thum"}, ("link",), "did you mean 'thumb'?"),
        ("contact_force", {"pair": ["robot/fingr", "cube"], "below": 1}, ("pair", 0), "did you mean 'robot/finger'?"),
        ("contact_force", {"of": "cbe", "below": 1}, ("of",), "did you mean 'cube'?"),
        ("no_collision", {"pairs": [["robot", "deks"]]}, ("pairs", 0, 1), "did you mean 'desk'?"),
        ("collision", ["robt", "desk"], ("pairs", 0, 0), "did you mean 'robot'?"),
        ("collision", ["finger", "desk"], ("pairs", 0, 0), "name a link with its robot: 'robot/finger'"),
        ("tracking", {"group": "ram", "within": 1}, ("group",), "did you mean 'arm'?"),
        ("limits", {"group": "ram"}, ("group",), "did you mean 'arm'?"),
        ("tool_speed", {"below": 1, "link": "fingr"}, ("link",), "did you mean 'finger'?"),
        ("energy", {"below": 1, "group": "rm"}, ("group",), "did you mean 'arm'?"),
        ("step_done", {"step": "og"}, ("step",), None),
    ],
)
def test_what_robot_scene_and_steps_do_not_know_is_told(
    name: str, written: Any, loc: tuple[str | int, ...], hint: str | None
) -> None:
    condition: Condition[Any] = CONDITIONS[name]
    (problem,) = condition.check(condition.spec.model_validate(written), CheckContext(ROBOT, SCENE, WORLD.steps))
    assert problem.loc == loc
    assert hint is None or problem.hint == hint


@pytest.mark.parametrize(
    ("pair", "told"),
    [
        (["robot", "robot"], "'robot' and 'robot' never touch in the simulation"),  # no link has a shape
        (["robot/finger", "robot"], "'robot/finger' and 'robot' never touch in the simulation"),
        (["robot/finger", "robot/finger"], "'robot/finger' cannot touch itself"),
        (["cube", "cube"], "'cube' cannot touch itself"),
        (["desk", "shelf"], "'desk' and 'shelf' are both fixed"),
        (["desk", f"robot/{ROBOT.root}"], f"'desk' and 'robot/{ROBOT.root}' are both fixed"),
    ],
)
@pytest.mark.parametrize("name", ["collision", "no_collision", "contact_force"])
def test_parts_that_never_touch_are_refused(name: str, pair: list[str], told: str) -> None:
    shelf = replace(SCENE.body("desk"), name="shelf")
    context = CheckContext(ROBOT, replace(SCENE, bodies=(*SCENE.bodies, shelf)))
    written, loc = (
        ({"pair": pair, "below": 1}, ("pair",)) if name == "contact_force" else ({"pairs": [pair]}, ("pairs", 0))
    )
    condition: Condition[Any] = CONDITIONS[name]
    (problem,) = condition.check(condition.spec.model_validate(written), context)
    assert problem.loc == loc
    assert problem.message.startswith(told)


def test_links_of_the_robot_that_are_checked_can_be_named() -> None:
    # `finger` and `thumb` each have a joint on `one`: two joints between them, one to `one`.
    ball = (Geometry(Transform.of(xyz=(0.0, 0.0, 0.3)), Sphere(0.01)),)
    apart = (Geometry(Transform.identity(), Sphere(0.01)),)
    shapes = {"one": ball, "finger": ball, "thumb": apart}
    robot = replace(ROBOT, links=tuple(replace(link, collisions=shapes.get(link.name, ())) for link in ROBOT.links))
    context, off = CheckContext(robot, SCENE), CheckContext(robot, SCENE, self_collision=False)
    condition: Condition[Any] = CONDITIONS["no_collision"]

    def problems(pair: list[str], context: CheckContext) -> list[str]:
        return [found.message for found in condition.check(condition.spec.model_validate(pair), context)]

    for pair in (["robot", "robot"], ["robot/thumb", "robot"], ["robot/thumb", "robot/finger"]):
        assert problems(pair, context) == []
        (message,) = problems(pair, off)
        assert message.startswith("two links of the robot never touch")
    for pair in (["robot/one", "robot/finger"], ["robot/base", "robot"]):
        (message,) = problems(pair, context)
        assert message.endswith("they have no pair of links that is checked")
    pressed = touching((0.0, [("robot/finger", "robot/thumb", 3.0)]))
    for written in (["robot", "robot"], ["robot/thumb", "robot/finger"]):
        assert condition.open(condition.spec.model_validate(written), WORLD)(pressed).margins.min() == -3.0
    for written in (["robot", "cube"], ["robot/thumb", "cube"]):
        assert condition.open(condition.spec.model_validate(written), WORLD)(pressed).margins.min() == 0.0


@pytest.mark.parametrize("written", [["robot"], [], ["robot", "desk", "cube"], [["robot", "desk"]], ["robot", 3]])
@pytest.mark.parametrize("name", ["collision", "no_collision"])
def test_a_short_collision_is_two_names(name: str, written: Any) -> None:
    spec = CONDITIONS[name].spec
    assert spec.model_validate(["robot", "desk"]) == spec.model_validate({"pairs": [["robot", "desk"]]})
    with pytest.raises(ValidationError, match="expected two names") as caught:
        spec.model_validate(written)
    (error,) = caught.value.errors()
    assert error["loc"] == ()
    assert "`[robot, desk]`" in error["ctx"]["hint"]


@pytest.mark.parametrize("above", [1.0, 3.0])
def test_a_range_of_forces_in_which_no_force_is_is_refused(above: float) -> None:
    with pytest.raises(ValidationError, match=r"`above` [13] N is not less than `below` 1 N"):
        CONDITIONS["contact_force"].spec.model_validate({"of": "cube", "below": 1.0, "above": above})


@pytest.mark.parametrize("name", ["slip", "tool_speed"])
def test_without_a_tool_the_link_must_be_named(name: str) -> None:
    condition: Condition[Any] = CONDITIONS[name]
    written = {"slip": {"object": "cube", "within": 1}, "tool_speed": {"below": 1}}[name]
    (problem,) = condition.check(condition.spec.model_validate(written), CheckContext(replace(ROBOT, tool=None), SCENE))
    assert "link" in (problem.hint or "")


@pytest.mark.parametrize("name", ["grasped", "rests_on", "slip", "contact_force", "no_collision", "collision"])
def test_contacts_need_physics_and_a_log_that_holds_them(name: str) -> None:
    condition: Condition[Any] = CONDITIONS[name]
    written: Any = {
        "grasped": {"object": "cube"},
        "rests_on": {"object": "cube", "of": "desk"},
        "slip": {"object": "cube", "within": 1},
        "contact_force": {"of": "cube", "below": 1},
        "no_collision": {"pairs": [["robot", "desk"]]},
        "collision": ["robot", "desk"],
    }[name]
    spec = condition.spec.model_validate(written)
    assert "no physics" in str(condition.absent(spec, replace(WORLD, physics=False)))
    assert condition.absent(spec, replace(WORLD, unrecorded={"contacts": "left out"})) == "left out"
