"""Conditions on sensors: margins in closed form of hand-made readings, which hold until the next, for any cut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from manipcli.conditions.condition import CheckContext, Condition, World
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.robustness import Extreme, NotEvaluated, Robustness
from manipcli.conditions.sensed import Readings, Sensed, pixels_of_parts
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array, Transform
from manipcli.description.elements import Link
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.build_scene import build_scene
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec

PERIOD, T = 0.01, 101
TIMES: Array = np.arange(T) * PERIOD
ROBOT = RobotModel("r", "base", (Link("base", None, (), ()),), (), (), (), (), Transform.identity(), "")
CUP = BodySpec.model_validate({"box": {"size": [0.1, 0.1, 0.1]}, "mass": 1.0, "pose": {}})
SCENE = build_scene(TaskSpec.model_construct(task="t", floor=False, scene={"cup": CUP}))
CELLS = (("", "force", 6), ("/shear", "x", 6), ("/shear", "y", 6))
SENSORS = {
    "switch": Sensed("contact", (("", "force", 1),), forces=1, threshold=2.0),
    "pad": Sensed("tactile", CELLS[:1], forces=6, most={"force": 2.0}),
    "skin": Sensed("tactile", CELLS, forces=6, shear=True),
    "wrist": Sensed("force_torque", (("", "wrench", 6),), most={"force": 100.0, "torque": 5.0}),
    "eye": Sensed(
        "camera", picture="/segmentation", parts=("world", "robot/base", "robot/tip", "cup"), most={"pixels": 76_800}
    ),
    "blind": Sensed("camera"),
    "encoder": Sensed("joint"),
}
WORLD = World(ROBOT, SCENE, WorldState(*([np.zeros(())] * 8)), sensors=SENSORS)
CONTEXT = CheckContext(ROBOT, SCENE, sensors=SENSORS)


def window(sensor: str, arrivals: Mapping[float, Sequence[float]]) -> StateWindow:
    """Ticks at 100 Hz, and readings that arrive at these times."""
    states = WorldState(TIMES, *([np.zeros((T, 0))] * 7))
    values = np.array([*arrivals.values()], dtype=float).reshape(len(arrivals), SENSORS[sensor].width)
    return StateWindow(
        states, None, (), (), (), readings={sensor: Readings(np.array([*arrivals], dtype=float), values)}
    )


def read(name: str, shown: StateWindow, **written: Any) -> Robustness:
    """The whole at once, after it gave the same bits tick by tick."""
    condition: Condition[Any] = CONDITIONS[name]
    spec = condition.spec.model_validate(written)
    assert condition.check(spec, CONTEXT) == ()
    assert condition.absent(spec, WORLD) is None
    assert condition.sensor is not None
    assert condition.sensor(spec) == written["sensor"]
    whole: Robustness = condition.open(spec, WORLD)(shown)
    monitor = condition.open(spec, WORLD)
    ticks = [monitor(_alone(shown, k)) for k in range(T)]
    np.testing.assert_array_equal([one.applies[0] for one in ticks], whole.applies)
    np.testing.assert_array_equal([one.margins[0] for one in ticks], whole.margins)
    assert set(whole.units) <= set(condition.units)
    return whole


def _alone(shown: StateWindow, k: int) -> StateWindow:
    """One tick, with the last reading before it alone, as a live run has it."""
    ((name, readings),) = shown.readings.items()
    index, known = readings.at(TIMES[k : k + 1])
    held = slice(index[0], index[0] + 1) if known[0] else slice(0, 0)
    return replace(shown.part(k, k + 1), readings={name: Readings(readings.times[held], readings.values[held])})


def margins(found: Robustness) -> Array:
    return np.where(found.applies, found.margins, np.nan)


def at(times: Array, of: float) -> int:
    return int(np.searchsorted(times, of - 1e-9))


def test_a_reading_holds_from_its_arrival_to_the_next_and_nothing_before_the_first() -> None:
    found = read("touches", window("switch", {0.2: [5.0], 0.5: [1.5], 0.505: [3.0]}), sensor="switch")
    before, first, second = at(TIMES, 0.2), at(TIMES, 0.5), at(TIMES, 0.51)
    expected = np.full(T, np.nan)
    expected[before:first], expected[first:second], expected[second:] = 3.0, -0.5, 1.0  # less its threshold of 2 N
    np.testing.assert_array_equal(margins(found), expected)
    assert found.found(first).text == "'switch' measures 1.5 N; at least 2 N"
    assert found.idle == "no measurement of sensor 'switch' has arrived"


def test_without_an_arrival_nothing_is_judged() -> None:
    found = read("touches", window("switch", {}), sensor="switch", force=0.1)
    assert not found.applies.any()
    extreme = Extreme("least")
    extreme.add(found, TIMES)
    assert extreme.found == NotEvaluated("no measurement of sensor 'switch' has arrived")


def test_touch_is_the_sum_of_normal_forces_alone() -> None:
    cells = [0.1 * k for k in range(6)]
    for sensor, more in (("pad", []), ("skin", [7.0] * 12)):
        found = read("touches", window(sensor, {0.0: [*cells, *more]}), sensor=sensor, force=1.0)
        np.testing.assert_allclose(found.margins, sum(cells) - 1.0, atol=1e-15)


def test_the_nearer_limit_of_a_wrench_decides() -> None:
    shown = window("wrist", {0.0: [3, 4, -10.5, 0, 0, 0], 0.5: [0, 0, -8, 0.6, 0, -0.8]})
    along = read("wrench", shown, sensor="wrist", force={"axis": "z", "above": -11, "below": -9})
    assert (along.margins[0], along.margins[-1]) == (0.5, -1.0)  # 0.5 N above -11 N; 1 N above -9 N
    assert along.found(T - 1).text == "the force along z on 'wrist' is -8 N; above -11 N and below -9 N"
    size = read("wrench", shown, sensor="wrist", force={"above": 10})
    np.testing.assert_allclose(size.margins[[0, -1]], [np.sqrt(3**2 + 4**2 + 10.5**2) - 10, -2.0], rtol=1e-15)
    both = read("wrench", shown, sensor="wrist", force={"below": 20}, torque={"axis": "x", "below": 0.5})
    assert (both.margins[-1], both.found(T - 1).unit) == (pytest.approx(-0.1), "N m")
    turned = read("wrench", shown, sensor="wrist", torque={"above": 0.25})
    np.testing.assert_allclose(turned.margins[[0, -1]], [-0.25, 0.75])


def test_a_camera_sees_what_has_enough_pixels() -> None:
    picture = np.array([[0, 1, 1], [3, 3, 2], [3, 0, 3]])
    counts = {
        code: pixels_of_parts(picture.astype(kind).tobytes(), code, 4)
        for code, kind in (("8UC1", "u1"), ("16UC1", "<u2"))
    }
    np.testing.assert_array_equal(counts["8UC1"], [(picture == k).sum() for k in range(4)])
    np.testing.assert_array_equal(counts["8UC1"], counts["16UC1"])
    shown = window("eye", {0.1: [*counts["8UC1"]], 0.6: [9, 0, 0, 0]})
    for written, pixels in (("cup", 4), ("robot", 3), ("robot/base", 2)):
        spec = {"sensor": "eye", "object": written, "pixels": 3}
        if written == "robot/base":
            assert (
                read("sees", shown, **spec).found(20).text == "'eye' sees 'robot/base' with 2 pixels; at least 3 pixels"
            )
        assert (read("sees", shown, **spec).margins[[20, -1]] == [pixels - 3, -3]).all()


def test_slip_begins_at_a_share_of_the_friction_and_needs_a_touch() -> None:
    # 2 N on each cell; 0.3 N and 0.4 N along the surface are 0.5 N: a quarter of what 2 N carry at a friction of 1.
    shown = window(
        "skin",
        {0.0: [0] * 18, 0.2: [2] * 6 + [0.3] * 6 + [0.4] * 6, 0.6: [2, 2, 2, 0, 0, 0] + [1] * 3 + [-1] * 3 + [0] * 6},
    )
    found = read("slips", shown, sensor="skin", friction=1.0)
    assert not found.applies[at(TIMES, 0.2) - 1]
    assert found.applies[at(TIMES, 0.2) :].all()
    assert found.idle == "nothing touches 'skin'"
    np.testing.assert_allclose(found.margins[at(TIMES, 0.3)], 0.25 - 0.9)
    np.testing.assert_allclose(found.margins[-1], -0.9)  # forces that cancel
    slippery = read("slips", shown, sensor="skin", friction=0.25, onset=1.0)
    np.testing.assert_allclose(slippery.margins[at(TIMES, 0.3)], 0.0, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "written", "loc", "message"),
    [
        ("touches", {"sensor": "swich"}, ("sensor",), "'swich' is not a sensor of the task or its robot"),
        ("touches", {"sensor": "pad"}, (), "`force` is missing: sensor 'pad' of type `tactile` has no threshold"),
        ("touches", {"sensor": "eye"}, ("sensor",), "the condition needs `contact` or `tactile`"),
        ("wrench", {"sensor": "pad", "force": {"below": 1}}, ("sensor",), "the condition needs `force_torque`"),
        ("sees", {"sensor": "blind", "object": "cup"}, ("sensor",), "does not publish which part each pixel shows"),
        ("sees", {"sensor": "eye", "object": "cap"}, ("object",), "'cap' is not a body"),
        ("slips", {"sensor": "pad", "friction": 1.0}, ("sensor",), "sensor 'pad' measures no tangential forces"),
        ("slips", {"sensor": "encoder", "friction": 1.0}, ("sensor",), "the condition needs `tactile`"),
        ("sees", {"sensor": "eye", "object": "cup", "pixels": 76_801}, ("pixels",), "at most 76800 px, not 76801 px"),
        ("touches", {"sensor": "pad", "force": 12.1}, ("force",), "at most 12 N"),  # 6 cells of 2 N
        ("wrench", {"sensor": "wrist", "force": {"axis": "z", "above": 101.0}}, ("force", "above"), "at most 100 N"),
        ("wrench", {"sensor": "wrist", "torque": {"axis": "x", "below": -6.0}}, ("torque", "below"), "at most 5 N m"),
        ("wrench", {"sensor": "wrist", "force": {"above": 174.0}}, ("force", "above"), "at most 173.2051 N"),
    ],
)  # fmt: skip
def test_what_a_sensor_cannot_answer_is_refused(name: str, written: Any, loc: Any, message: str) -> None:
    condition: Condition[Any] = CONDITIONS[name]
    spec = condition.spec.model_validate(written)
    (problem,) = condition.check(spec, CONTEXT)
    assert problem.loc == loc
    assert message in problem.message
    assert problem.hint
    unknown_sensors = replace(CONTEXT, sensors=None)  # of a file that is refused
    assert condition.check(spec, unknown_sensors) == ((problem,) if loc == ("object",) else ())


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("sees", {"sensor": "eye", "object": "cup", "pixels": 76_800}),
        ("touches", {"sensor": "pad", "force": 12.0}),
        ("wrench", {"sensor": "wrist", "force": {"above": 173.0}, "torque": {"axis": "x", "below": 6.0}}),
    ],
)
def test_what_a_sensor_can_just_measure_is_accepted(name: str, written: Any) -> None:
    condition: Condition[Any] = CONDITIONS[name]
    assert condition.check(condition.spec.model_validate(written), CONTEXT) == ()


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ({}, "limits missing"),
        ({"force": {}}, "limit missing"),
        ({"force": {"above": 3, "below": 2}}, "is not less than `below`"),
        ({"torque": {"above": "3 N"}}, "is a force"),
        ({"force": {"axis": "w", "above": 1}}, "'x', 'y', 'z' or 'magnitude'"),
    ],
)
def test_limits_of_a_wrench_have_units_and_an_order(written: Any, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        CONDITIONS["wrench"].spec.model_validate({"sensor": "wrist", **written})


def test_forces_need_physics_and_pictures_do_not() -> None:
    ideal = replace(WORLD, physics=False)
    for name, written, known in (
        ("touches", {"sensor": "switch"}, False),
        ("sees", {"sensor": "eye", "object": "cup"}, True),
    ):
        condition: Condition[Any] = CONDITIONS[name]
        spec = condition.spec.model_validate(written)
        assert (condition.absent(spec, ideal) is None) == known
        assert condition.absent(spec, replace(WORLD, sensors={})) is not None
        assert condition.absent(spec, replace(WORLD, unrecorded={"sensors": "left out"})) == "left out"
