"""Values that nobody means are refused where they stand: they would run for days, or leave the range of numbers."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.spec.controllers import GainsSpec
from manipcli.spec.load import load_task_text
from manipcli.task.vocabulary import task_spec

TASK = """\
task: t
robot: r.yaml
controllers: c.yaml
scene:
  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 80 g, pose: {}}
  ball: {sphere: {radius: 1 cm}, mass: 1, pose: {}}
  thing: {mesh: {file: a.stl, scale: 0.001}, mass: 1, pose: {}}
simulation: {step: 1 ms, control_period: 1 ms}
steps:
  - wait: 1 s
  - pour: {object: block, into: ball, dwell: 1 s}
    timeout: 10 s
"""


def refused(written: str, instead: str) -> Diagnostic:
    with pytest.raises(InvalidInput) as told:
        load_task_text(TASK.replace(written, instead), "t.yaml", model=task_spec())
    (finding,) = told.value.findings
    return finding


@pytest.mark.parametrize(
    ("written", "instead", "told"),
    [
        ("wait: 1 s", "wait: 1e9 s", "t.yaml:10:11: error[TASK204]: steps[0].wait: must be at most 3600, not"),
        ("wait: 1 s", "wait: {duration: 61 min}", "must be at most 3600 s, not '61 min'"),
        ("step: 1 ms", "step: 1e-9", "simulation.step: must be at least 1e-06 s, not 1e-09"),
        ("dwell: 1 s", "dwell: 2 h", "must be at most 3600 s, not '2 h'"),
        ("timeout: 10 s", "timeout: 1e9 s", "must be at most 3600 s, not '1e9 s'"),
        ("timeout: 10 s", "timeout: 0", "must be more than 0, not 0"),
        (
            "mass: 80 g",
            "mass: 1e300",
            "t.yaml:5:50: error[TASK204]: scene.block.mass: must be at most 100000 kg, not 1e+300",
        ),
        ("mass: 80 g", "mass: 101 t", "must be at most 100000 kg, not '101 t'"),
        ("[4 cm, 4 cm, 5 cm]", "[4 cm, 1e300, 5 cm]", "scene.block.box.size[1]: must be at most 100 m, not 1e+300"),
        ("[4 cm, 4 cm, 5 cm]", "[4 cm, 4 cm, 1e-300]", "scene.block.box.size[2]: must be at least 1e-06 m, not 1e-300"),
        (
            "steps:",
            "watch: [{never: {collision: [robot, block]}, within: 3 s}]\nsteps:",
            "watch[0].within: expected no value, not '3 s'",
        ),
        (
            "steps:",
            "steps:\n  - pour: {object: cup, into: bin, tilt: 200 deg}",
            "must be at most 180 deg, not '200 deg'",
        ),
        ("radius: 1 cm", "radius: 0", "scene.ball.sphere.radius: must be at least 1e-06 m, not 0"),
        ("scale: 0.001", "scale: 1e300", "scene.thing.mesh.scale: must be at most 1e+06, not 1e+300"),
    ],
)
def test_it_is_told_with_the_most_that_is_taken(written: str, instead: str, told: str) -> None:
    assert told in str(refused(written, instead))


@pytest.mark.parametrize(
    ("written", "instead"),
    [("wait: 1 s", "wait: 1 h"), ("timeout: 10 s", "timeout: 1 h"), ("mass: 80 g", "mass: 100 t"), ("1 cm", "100 m")],
)
def test_the_most_is_taken(written: str, instead: str) -> None:
    load_task_text(TASK.replace(written, instead), "t.yaml", model=task_spec())


@pytest.mark.parametrize(
    ("written", "instead", "hint"),
    [
        ("[4 cm, 4 cm, 5 cm]", "[4 cm, 400, 5 cm]", "in millimetres? write '400 mm'"),
        ("radius: 1 cm", "radius: 200", "in millimetres? write '200 mm'"),
        ("dwell: 1 s", "dwell: 1 s, tilt: 120", "in degrees? write '120 deg'"),
    ],
)
def test_degrees_and_millimetres_are_guessed(written: str, instead: str, hint: str) -> None:
    assert refused(written, instead).hint == hint


@pytest.mark.parametrize(
    ("block", "most"),
    [
        ("watch: [{always: {upright: {object: block, within: 30}}}]", "at most 180 deg, not 30"),
        ("expect: [{unmoved: {object: block, within: 1 cm, rotation: 30}}]", "at most 180 deg, not 30"),
        ("expect: [{moved: {object: block, rotation: 30}}]", "at most 180 deg, not 30"),
        ("watch: [{always: {slip: {object: block, within: 1 cm, rotation: 30}}}]", "at most 180 deg, not 30"),
        ("expect: [{at_pose: {pose: home, within: 30}}]", "at most 180 deg, not 30"),
        ("expect: [{tracking: {group: arm, within: 30}}]", "at most 3.1416 rad or m, not 30"),
        ("replan: {rotation: 30}", "at most 180 deg, not 30"),
        ("replan: {joints: 30}", "at most 3.1416 rad or m, not 30"),
        ("frames: {f: {pose: {rpy: [30, 0, 0]}}}", "frames.f.pose.rpy[0]: must be at most 360 deg, not 30"),
        ("frames: {f: {pose: {rpy: [0, 0, -30]}}}", "frames.f.pose.rpy[2]: must be at least -360 deg, not -30"),
    ],
)
def test_degrees_without_their_unit_make_no_condition_that_always_holds(block: str, most: str) -> None:
    finding = refused("steps:", f"{block}\nsteps:")
    number = most.rpartition(" ")[2]
    assert most in finding.message
    assert (finding.hint or "").startswith(f"in degrees? write '{number} deg'")
    tried = f"{block.replace(number, f'{number} deg')}\nsteps:"
    load_task_text(TASK.replace("steps:", tried), "t.yaml", model=task_spec())


@pytest.mark.parametrize(
    ("written", "instead"),
    [
        ("mass: 80 g", "mass: 80 g, yaw: 45"),
        ("- wait: 1 s", "- pick: {object: block, approach: {yaw: 45}}"),
        ("- wait: 1 s", "- place: {object: block, yaw: 45}"),
    ],
)
def test_a_yaw_is_a_turn_at_most(written: str, instead: str) -> None:
    assert refused(written, instead).hint == "in degrees? write '45 deg'"
    for yaw in ("-360 deg", "6.2832", "1 rev"):
        text = TASK.replace(written, instead.replace("45", yaw))
        load_task_text(text, "t.yaml", model=task_spec())


@pytest.mark.parametrize(
    ("written", "instead"),
    [("radius: 1 cm", "radius: 200 m"), ("radius: 1 cm", "radius: 1e7"), ("mass: 80 g", "mass: 2e5")],
)
def test_what_has_a_unit_or_fits_neither_way_is_not_guessed(written: str, instead: str) -> None:
    assert "millimetres" not in (refused(written, instead).hint or "")


@pytest.mark.parametrize("gain", ["p", "i", "d"])
def test_no_gain_is_so_large_that_its_products_are_no_numbers(gain: str) -> None:
    with pytest.raises(ValidationError, match=r"less than or equal to 1000000000000"):
        GainsSpec.model_validate({gain: 1e308})
    assert getattr(GainsSpec.model_validate({gain: 1e12}), gain) == 1e12
