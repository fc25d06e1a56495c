"""Proposed gains: by their formulas, within their caps, and as good in the engine as predicted."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.command import JointCommand
from manipcli.control.controllers.joint_trajectory import JointTrajectorySpec
from manipcli.control.gain_design import MARGIN, Tuned, Wish
from manipcli.control.stability import Loop, largest_damping
from manipcli.core.errors import InvalidInput
from manipcli.model.build_robot import build_robot
from manipcli.pipeline import run_task
from manipcli.preflight.findings import preflight_findings
from manipcli.record.read.reading import open_recording
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.spec.load import load_controllers, load_robot
from manipcli.task.load_task import load_task
from manipcli.task.vocabulary import controllers_spec
from manipcli.tuning.propose_gains import Tuning, chart_of, tune, written

ROOT = Path(__file__).parents[2]
INERTIA = 0.004 + 0.5 * 0.2**2
"""[kg m2] of the pendulum about its joint."""


def pendulum(
    folder: Path,
    *,
    axis: str = "0 0 1",
    friction: float = 0.0,
    effort: float = 40.0,
    acceleration: float = 1000.0,
    control: str = "",
) -> tuple[Path, Path]:
    """A robot of one joint that moves 0.5 kg at 0.2 m, and its controllers file."""
    (folder / "one.urdf").write_text(f"""<robot name="one"><link name="base"/><link name="arm"><inertial>
        <origin xyz="0.2 0 0"/><mass value="0.5"/>
        <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.004" iyz="0" izz="0.004"/></inertial></link>
        <joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="{axis}"/>
        <limit lower="-2" upper="2" velocity="20" effort="{effort}"/><dynamics damping="{friction}"/></joint>
        </robot>""")
    robot, controllers = folder / "one.yaml", folder / "controllers.yaml"
    robot.write_text(f"robot: one\ndescription: one.urdf\nlimits: {{hinge: {{acceleration: {acceleration}}}}}\n")
    control = control or "command_interface: effort, gravity_compensation: true, gains: {hinge: {p: 1}}"
    controllers.write_text(f"controllers:\n  c: {{type: joint_trajectory, joints: [hinge], {control}}}\n")
    return robot, controllers


def tuned(folder: Path, wish: Wish, *, simulated: bool = False, step: float = 0.02, **of: object) -> Tuned:
    (one,) = tune(*pendulum(folder, **of), wish, simulated=simulated, step=step).joints  # type: ignore[arg-type]
    return one


@pytest.mark.parametrize("simulated", [False, True])
@pytest.mark.parametrize(("first", "second"), [("effort", "effort"), ("effort", "velocity"), ("velocity", "velocity")])
def test_of_two_controllers_on_a_joint_the_active_one_is_tuned(
    tmp_path: Path, first: str, second: str, simulated: bool
) -> None:
    robot, controllers = pendulum(tmp_path)
    one = "{{type: joint_trajectory, active: {}, command_interface: {}, joints: [hinge], gains: {{hinge: {{p: 7}}}}}}"
    controllers.write_text(f"controllers:\n  a: {one.format('false', first)}\n  b: {one.format('true', second)}\n")
    found = tune(robot, controllers, Wish(4.0, 1.0, 1e-3), simulated=simulated)
    assert [each.controller for each in found.joints] == ["b"]
    assert any(note.startswith("a: its gains are unchanged") and "with b;" in note for note in found.notes)
    assert found.controllers.controllers["a"].gains["hinge"].p == 7  # type: ignore[attr-defined]


def test_gains_are_those_of_the_formulas(tmp_path: Path) -> None:
    w = 2 * math.pi * 4.0
    one = tuned(tmp_path, Wish(4.0, 0.7, 1e-3), friction=0.1)
    assert one.inertia == pytest.approx(INERTIA)
    assert one.p == pytest.approx(INERTIA * w**2, rel=5e-3)
    assert one.d == pytest.approx(2 * 0.7 * INERTIA * w - 0.1, rel=5e-3)
    assert (one.i, one.limited_by, one.frequency) == (0.0, "", 4.0)
    assert one.bandwidth == pytest.approx(4.0, rel=0.03)  # a damping ratio of 0.7
    assert one.predicted.overshoot == pytest.approx(math.exp(-math.pi * 0.7 / math.sqrt(1 - 0.49)), abs=0.005)


@pytest.mark.parametrize(
    ("bandwidth", "limit", "p"),
    [(1.0, "", 40.0 / 2.0), (1.0, ", max_effort: 20", 20.0 / 2.0), (5.0, "", INERTIA * (2 * math.pi * 5.0) ** 2)],
)
def test_the_joint_of_a_hand_presses_with_its_effort_over_half_its_travel_at_least(
    tmp_path: Path, bandwidth: float, limit: str, p: float
) -> None:
    robot, controllers = pendulum(tmp_path)
    controllers.write_text(
        f"controllers:\n  c: {{type: gripper, joints: [hinge], gains: {{hinge: {{p: 1}}}}{limit}}}\n"
    )
    found = tune(robot, controllers, Wish(bandwidth, 1.0, 1e-3))
    (one,) = found.joints
    raised = [note for note in found.notes if "full effort" in note and "hinge" in note]
    assert bool(raised) == (one.frequency > bandwidth)
    assert one.p == pytest.approx(p, rel=5e-3)
    assert one.d == pytest.approx(2.0 * math.sqrt(p * INERTIA), rel=5e-3)
    assert one.frequency == pytest.approx(math.sqrt(p / INERTIA) / math.tau, rel=5e-3)


def test_a_joint_whose_weight_nobody_carries_gets_an_integral_that_can(tmp_path: Path) -> None:
    control = "command_interface: effort, gains: {hinge: {p: 1}}"
    one = tuned(tmp_path, Wish(3.0, 1.0, 1e-3), axis="0 1 0", control=control)
    assert one.i == pytest.approx(0.1 * 2 * math.pi * 3.0 * one.p, rel=5e-3)  # it takes over ten times as slowly
    assert one.i_clamp is not None
    assert one.i_clamp == pytest.approx(1.2 * 0.5 * 9.81 * 0.2, rel=0.01)


@pytest.mark.parametrize("axis", ["0 0 1", "1e-14 0 1"])
def test_a_joint_without_weight_gets_a_tenth_of_its_effort_also_where_rounding_weighs(
    tmp_path: Path, axis: str
) -> None:
    control = "command_interface: effort, gains: {hinge: {p: 1}}"
    assert tuned(tmp_path, Wish(3.0, 1.0, 1e-3), axis=axis, control=control).i_clamp == 4.0


@pytest.mark.parametrize(
    ("wish", "of", "why"),
    [
        (Wish(20.0, 1.0, 1e-3), {"effort": 1.0}, "effort"),
        (Wish(40.0, 1.0, 5e-3), {}, "control step"),
    ],
)
def test_what_limits_the_gains_is_named_and_kept(tmp_path: Path, wish: Wish, of: dict[str, float], why: str) -> None:
    one = tuned(tmp_path, wish, **of)
    assert one.limited_by == why
    assert one.margin >= MARGIN
    if why == "effort":
        assert one.p * one.predicted.size == pytest.approx(of["effort"], rel=0.01)
    else:
        assert one.margin < 1.15 * MARGIN  # no more is given up than must be


@pytest.mark.parametrize(
    ("damping", "axis", "friction"),
    [(0.3, "0 0 1", 0.0), (0.7, "0 1 0", 0.05), (1.0, "0 0 1", 0.1), (1.0, "0 0 1", 80.0)],
)
def test_the_engine_answers_as_predicted(tmp_path: Path, damping: float, axis: str, friction: float) -> None:
    """Overshoot to one percent of the step, settling to two ticks; upright and under gravity, which is carried."""
    one = tuned(tmp_path, Wish(4.0, damping, 1e-3), simulated=True, axis=axis, friction=friction)
    assert one.simulated is not None
    assert one.simulated.overshoot == pytest.approx(one.predicted.overshoot, abs=0.01)
    assert one.simulated.settling_time == pytest.approx(one.predicted.settling_time, abs=0.002)
    np.testing.assert_allclose(one.simulated.share, one.predicted.share, atol=0.01)


def test_the_engine_saturates_as_predicted(tmp_path: Path) -> None:
    """A step ten times as large as what the effort is enough for: slower, and as slow in the engine."""
    of = {"effort": 1.0, "axis": "0 0 1"}
    (one,) = tune(*pendulum(tmp_path, **of), Wish(5.0, 0.5, 1e-3), step=0.2, simulated=True).joints  # type: ignore[arg-type]
    assert one.limited_by == "effort"
    assert one.simulated is not None
    assert one.simulated.overshoot == pytest.approx(one.predicted.overshoot, abs=0.01)


def test_the_velocity_interface_too(tmp_path: Path) -> None:
    """A first-order loop: no overshoot, settled to 2 % after ln 50 / w."""
    control = "command_interface: velocity, gains: {hinge: {p: 1}}"
    one = tuned(tmp_path, Wish(2.0, 1.0, 1e-3), simulated=True, control=control)
    w = 2 * math.pi * 2.0
    assert one.p == pytest.approx(w, rel=5e-3)
    assert one.bandwidth == pytest.approx(2.0, rel=0.02)
    assert one.predicted.overshoot == 0.0
    assert one.predicted.settling_time == pytest.approx(math.log(50.0) / w, abs=0.003)
    assert one.simulated is not None
    np.testing.assert_allclose(one.simulated.share, one.predicted.share, atol=0.02)
    slow = tuned(tmp_path, Wish(2.0, 1.0, 1e-3), simulated=True, control=control, acceleration=0.5)
    assert slow.predicted.overshoot > 0.05
    assert slow.simulated is not None
    np.testing.assert_allclose(slow.simulated.share, slow.predicted.share, atol=0.02)
    fast = tuned(tmp_path, Wish(400.0, 1.0, 1e-3), control=control, step=1e-3)
    assert fast.limited_by == "control step"
    assert fast.margin == pytest.approx(MARGIN, rel=0.01)


def test_a_velocity_loop_is_given_the_whole_velocity_of_its_reference(tmp_path: Path) -> None:
    """Without it, a reference at speed v is followed v / p behind."""
    control = "command_interface: velocity, gains: {hinge: {p: 1}}"
    found = tune(*pendulum(tmp_path, control=control), Wish(2.0, 1.0, 1e-3), simulated=False)
    spec = found.controllers.controllers["c"]
    assert isinstance(spec, JointTrajectorySpec)
    assert spec.gains["hinge"].ff_velocity_scale == 1.0


@pytest.mark.parametrize("friction", [0.0, 0.5, 40.0])
@pytest.mark.parametrize("substeps", [1, 4])
def test_the_bound_of_damping_is_that_of_the_engine(tmp_path: Path, friction: float, substeps: int) -> None:
    """A pendulum without gravity, its damping 3 % below and above the bound, for 300 ticks."""
    robot_path, _ = pendulum(tmp_path, friction=friction, effort=1e6)
    file = load_robot(robot_path)
    robot, _ = build_robot(file.spec, file=robot_path)
    period, p = 2e-3, 30.0
    bound = largest_damping(
        Loop.of_joint(INERTIA, p=p, d=1.0, damping=friction, period=period, substeps=substeps)
    )  # fmt: skip
    for factor, settles in ((0.97, True), (1.03, False)):
        settings = EngineSettings(period / substeps, substeps, np.array([1e-4]))
        engine = ENGINES["pybullet"].open(robot, Scene((), (), np.zeros(3)), settings)
        command = JointCommand(1)
        command.obey(["effort"])
        first = last = 0.0
        for tick in range(300):
            state = engine.read()
            command.effort[:] = -p * state.position - factor * bound * state.velocity
            engine.write(command)
            engine.advance()
            speed = abs(float(state.velocity[0]))
            first, last = (max(first, speed), last) if tick < 10 else (first, speed)
        engine.close()
        assert last < first if settles else last > 5.0 * first


@pytest.fixture(scope="module")
def arm() -> Tuning:
    return tune(
        ROOT / "robots" / "arm7_hand3" / "robot.yaml", ROOT / "controllers" / "arm7_hand3.yaml", Wish(5.0, 1.0, 1e-3)
    )


def test_the_file_that_is_written_is_the_old_one_with_other_gains(arm: Tuning, tmp_path: Path) -> None:
    source = ROOT / "controllers" / "arm7_hand3.yaml"
    (tmp_path / "tuned.yaml").write_text(written(arm, source))
    before, after = (
        load_controllers(source, model=controllers_spec()).spec,
        load_controllers(tmp_path / "tuned.yaml", model=controllers_spec()).spec,
    )
    for name, spec in after.controllers.items():
        gains = {one.joint: (one.p, one.d) for one in arm.joints if one.controller == name}
        assert {joint: (g.p, g.d) for joint, g in spec.gains.items()} == gains  # type: ignore[union-attr]
        same = {"gains": before.controllers[name].gains}  # type: ignore[union-attr]
        assert spec.model_copy(update=same) == before.controllers[name]


def test_gains_of_an_arm_have_their_margin_and_give_no_doubt(arm: Tuning, tmp_path: Path) -> None:
    assert len(arm.joints) == 13
    assert all(one.margin >= MARGIN for one in arm.joints)
    (tmp_path / "tuned.yaml").write_text(written(arm, Path("x.yaml")))
    text = (ROOT / "tasks" / "home.yaml").read_text().replace("../robots", str(ROOT / "robots"))
    (tmp_path / "home.yaml").write_text(text.replace("../controllers/arm7_hand3.yaml", "tuned.yaml"))
    assert preflight_findings(load_task(tmp_path / "home.yaml")) == ()


def test_the_chart_has_a_panel_a_controller(arm: Tuning) -> None:
    chart = chart_of(arm)
    assert [panel.title for panel in chart.panels] == ["arm_controller", "hand_controller"]
    assert [len(panel.curves) for panel in chart.panels] == [7, 6]
    assert chart.end >= max(one.predicted.settling_time for one in arm.joints)


def test_what_has_no_loop_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="'elbow' has no loop"):
        tune(*pendulum(tmp_path), Wish(5.0, 1.0, 1e-3), joints=["elbow"])
    with pytest.raises(InvalidInput, match="no controller has a loop") as refused:
        tune(*pendulum(tmp_path, control="command_interface: position"), Wish(5.0, 1.0, 1e-3))
    assert refused.value.findings[0].hint == "c: its interface is position, which needs no gains"
    robot, controllers = pendulum(tmp_path)
    controllers.write_text("controllers:\n  c: {type: computed_torque, joints: [hinge], bandwidth: 5 Hz}\n")
    with pytest.raises(InvalidInput, match="no controller has a loop") as refused:
        tune(robot, controllers, Wish(5.0, 1.0, 1e-3))
    needs = "c: the type computed_torque needs no gains, its `bandwidth` and `damping_ratio` define them"
    assert refused.value.findings[0].hint == needs
    robot, controllers = pendulum(tmp_path)
    controllers.write_text(controllers.read_text().replace("hinge", "hing"))
    with pytest.raises(InvalidInput, match=r"joint 'hing' is not in robot 'one'"):
        tune(robot, controllers, Wish(5.0, 1.0, 1e-3))


@pytest.mark.slow
@pytest.mark.parametrize(("carries", "bandwidth"), [("inverse_dynamics", 5.0), ("gravity_compensation", 10.0)])
def test_a_pick_and_a_lift_are_tracked_with_tuned_gains(tmp_path: Path, carries: str, bandwidth: float) -> None:
    """Below 10 mrad RMS of all joints while the arm moves, with a cup in the hand of which the model knows nothing."""
    source = tmp_path / "controllers.yaml"
    text = (ROOT / "controllers" / "arm7_hand3.yaml").read_text()
    source.write_text(text.replace("inverse_dynamics: true", f"{carries}: true"))
    joints = [f"joint_{k}" for k in range(1, 8)]
    tuning = tune(ROOT / "robots" / "arm7_hand3" / "robot.yaml", source, Wish(bandwidth, 1.0, 1e-3), joints=joints)
    (tmp_path / "tuned.yaml").write_text(written(tuning, source))
    task = (ROOT / "tasks" / "pour.yaml").read_text().partition("  - pour:")[0].replace("../robots", f"{ROOT}/robots")
    (tmp_path / "pour.yaml").write_text(task.replace("../controllers/arm7_hand3.yaml", "tuned.yaml"))
    report = run_task(tmp_path / "pour.yaml", log=tmp_path / "pour.mcap")
    assert all(step.outcome == "done" for step in report.verdict.steps)
    trace = next(one for one in open_recording(tmp_path / "pour.mcap").controllers if "joint_1" in one.joints)
    moving = np.abs(np.gradient(trace.reference_position, axis=0)).max(axis=1) > 1e-7
    error = (trace.reference_position - trace.position)[moving]
    assert float(np.sqrt(np.mean(error**2))) < 0.010


def test_no_gains_are_proposed_where_next_to_none_are_stable(tmp_path: Path) -> None:
    """Two hinges on one axis, and next to nothing between them: the first one's own effort moves 0.01 g cm2."""
    link = "<link name='{}'><inertial><mass value='{}'/><inertia ixx='{}' iyy='{}' izz='{}' ixy='0' ixz='0' iyz='0'/>"
    hinge = "<joint name='{}' type='revolute'><parent link='{}'/><child link='{}'/><axis xyz='0 0 1'/>"
    ends = "<limit lower='-2' upper='2' velocity='20' effort='40'/></joint>"
    links = [link.format(n, *[x] * 4) + "</inertial></link>" for n, x in (("speck", 1e-9), ("arm", 0.02))]
    joints = [hinge.format(*names) + ends for names in (("first", "base", "speck"), ("second", "speck", "arm"))]
    text = "".join(["<robot name='two'><link name='base'/>", *links, *joints, "</robot>"])
    (tmp_path / "two.urdf").write_text(text)
    robot, controllers = tmp_path / "two.yaml", tmp_path / "controllers.yaml"
    robot.write_text("robot: two\ndescription: two.urdf\n")
    controllers.write_text(
        "controllers:\n  c: {type: joint_trajectory, joints: [first, second], command_interface: effort}\n"
    )
    with pytest.raises(InvalidInput, match="first: no useful gains are stable at 1 ms"):
        tune(robot, controllers, Wish(5.0, 1.0, 1e-3))
