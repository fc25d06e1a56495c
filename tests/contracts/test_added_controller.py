"""`hold_position`: u = p (q_held - q) - d v, where each joint was when the controller was activated.

    controllers:
      hold:
        type: hold_position
        joints: [joint_1]
        gains:
          joint_1: {p: 300, d: 20}

A controller that is added as one file and one entry of the registry is loaded, checked, run and recorded like ours.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.control.control_loop import ControlLoop, PidLoop
from manipcli.control.controller import BuildContext, ControllerMember, ControllerOutput, FeedForward, JointState
from manipcli.control.controllers import CONTROLLERS
from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.pipeline import run_task
from manipcli.preflight.check_files import check_files, schema
from manipcli.record.foreign.topics import open_topics
from manipcli.record.read.reading import read_recording
from manipcli.spec.controllers import ControllerSpec, GainsSpec, Interface, Role

# From here to MEMBER: what an author writes.


class HoldPositionSpec(ControllerSpec):
    """Holds each joint where it is when the controller is activated."""

    type: Literal["hold_position"] = Field(description="`hold_position`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    gains: dict[str, GainsSpec] = Field(description="Stiffness p [N m/rad] and damping d [N m s/rad] by joint.")

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        return ("effort",)


class HoldPosition:
    role: Role = "other"
    senses_contact = False
    sensors = ()
    interfaces: tuple[Interface, ...] = ("effort",)
    feed_forward: FeedForward = "gravity"

    def __init__(self, name: str, spec: HoldPositionSpec, context: BuildContext) -> None:
        self.name, self.joints = name, spec.joints
        self._p = np.array([spec.gains[joint].p for joint in spec.joints])
        self._d = np.array([spec.gains[joint].d for joint in spec.joints])
        self.output = ControllerOutput.of(len(spec.joints), 1)
        self._held: Array | None = None

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        if self._held is None:
            self._held = np.array(measured.position)
        self.output.position[:] = self._held
        self.output.command[:] = self._p * (self._held - measured.position) - self._d * measured.velocity
        return self.output

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        self._held = None


def check(spec: HoldPositionSpec, robot: RobotModel) -> Iterator[Problem]:
    return iter(())


def loop(spec: HoldPositionSpec) -> ControlLoop:
    return PidLoop(spec.gains, carries_weight=True, tunable=False)


MEMBER = ControllerMember("hold_position", HoldPositionSpec, HoldPosition, check, loop)

ROOT = Path(__file__).parents[2]
ROBOT = ROOT / "robots" / "arm7_hand3" / "robot.yaml"


@pytest.fixture
def task(tmp_path: Path) -> Iterator[Path]:
    """A task with a controller of the type, which is in the registry for as long."""
    (tmp_path / "c.yaml").write_text(
        "controllers:\n  hold: {type: hold_position, joints: [joint_1, joint_2], "
        "gains: {joint_1: &g {p: 300, d: 20}, joint_2: *g}}\n"
    )
    (tmp_path / "task.yaml").write_text(
        f"task: t\nrobot: {ROBOT}\ncontrollers: c.yaml\nsteps: [{{wait: 100 ms}}]\n"
        "expect: [{at_pose: {pose: home, within: 1 mrad}}]\n"
    )
    before = CONTROLLERS.members
    object.__setattr__(CONTROLLERS, "members", (*before, MEMBER))
    yield tmp_path / "task.yaml"
    object.__setattr__(CONTROLLERS, "members", before)


@pytest.mark.parametrize("engine", ["pybullet", "kinematic"])
def test_a_task_with_it_runs_and_its_log_has_its_states(task: Path, tmp_path: Path, engine: str) -> None:
    log = tmp_path / "t.mcap"
    report = run_task(task, overrides=[f"simulation.engine={engine}"], log=log)
    assert report.verdict.verdict == "passed"
    recording = read_recording(log)
    assert "type: hold_position" in recording.attachments["controllers.yaml"].decode()
    assert "/hold/controller_state" in open_topics(log).all


def test_its_gains_are_checked_before_the_run(task: Path) -> None:
    """A damping above 2 I / h is unstable, whatever the type of the controller is."""
    codes = [finding.code for finding in check_files([task])]
    assert "CTRL150" not in codes
    wild = check_files([task], overrides=[f"controllers.hold.gains.{joint}.d=1e5" for joint in ("joint_1", "joint_2")])
    doubted = [finding.message.partition(":")[0] for finding in wild if finding.code == "CTRL150"]
    assert doubted == ["joint_1", "joint_2"]


def test_a_mistake_in_its_block_is_reported_at_its_place(task: Path, tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text(
        "controllers:\n  hold: {type: hold_position, joints: [joint_1], gains: {}, dd: 20}\n"
    )
    with pytest.raises(InvalidInput) as error:
        run_task(task, log=tmp_path / "t.mcap")
    places = [(found.code, found.place.line, found.place.column) for found in error.value.findings if found.place]
    assert ("CTRL201", 2, 61) in places


def test_its_fields_are_in_the_schema_as_long_as_it_is_registered(task: Path) -> None:
    assert "HoldPositionSpec" in str(schema("controllers"))


def test_without_its_entry_the_type_is_unknown(tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text("controllers:\n  hold: {type: hold_position, joints: [joint_1], gains: {}}\n")
    (finding,) = check_files([tmp_path / "c.yaml"])
    assert "hold_position" in finding.message
    assert "joint_trajectory" in finding.message


def test_a_member_cannot_leave_out_what_preflight_asks() -> None:
    with pytest.raises(TypeError, match="loop"):
        ControllerMember("hold_position", HoldPositionSpec, HoldPosition, check)  # type: ignore[call-arg]
