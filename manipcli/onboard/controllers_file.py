"""Controllers for a guessed arm and hand, with tuned gains where these are stable, else position control."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import did_you_mean, listed
from manipcli.model.robot import RobotModel
from manipcli.onboard.writer import Entry, Value, written
from manipcli.spec.load import load_controllers, read_bytes
from manipcli.task.vocabulary import controllers_spec
from manipcli.tuning.propose_gains import Tuning, Wish, tune

PERIOD: Final = 0.001
"""[s] Control period of a task by default."""
BANDWIDTHS: Final = (5.0, 3.0, 2.0)
"""[Hz] tried in turn."""
TRAJECTORY: Final = 0.2
GOAL: Final = 0.03
"""[rad or m] Tolerances."""


@dataclass(frozen=True, slots=True)
class WrittenControllers:
    """A controllers file: its text, entries and notes."""

    text: str
    entries: dict[str, Entry]
    notes: tuple[str, ...]


_HEAD: Final = (
    "yaml-language-server: $schema=schemas/controllers.json",
    "Written by `manipcli init --robot`; `manipcli tune robot.yaml controllers.yaml` proposes other gains.",
)


def given_controllers(path: Path, robot: RobotModel, arguments: Mapping[str, str]) -> WrittenControllers:
    """A file of the user, of ours or of ROS, unchanged.

    Raises:
        InvalidInput: it is invalid, or names joints that the robot does not have.
    """
    file = load_controllers(path, model=controllers_spec(), args=dict(arguments))
    known = robot.joint_names
    findings = [
        Diagnostic(
            "INIT001",
            f"controller '{name}': joint '{joint}' is not in the robot",
            file.place("controllers", name, "joints", k),
            did_you_mean(joint, known, kind="joints"),
        )
        for name, spec in file.spec.controllers.items()
        for k, joint in enumerate(spec.joints)
        if joint not in known
    ]
    if findings:
        raise InvalidInput(findings)
    commanded = {joint for spec in file.spec.controllers.values() for joint in spec.joints}
    notes = [f"controllers.yaml is a copy of {path}"]
    left = [joint.name for joint in robot.joints if joint.independent and joint.name not in commanded]
    if left:
        notes.append(f"no controller of it moves {listed(left)}")
    return WrittenControllers(read_bytes(path).decode("utf-8", "replace"), {}, tuple(notes))


class ControllersGuess:
    """Controllers for the joints of an arm and of a hand: by effort where gains are stable, else by position."""

    def __init__(
        self,
        robot_path: Path,
        arm: tuple[str, ...],
        hand: tuple[str, ...],
        *,
        package_path: tuple[Path, ...],
        allow_outside: bool,
    ) -> None:
        """
        Args:
            robot_path: the robot file; another file is written beside it.
            arm, hand: their joints; () for neither.
            package_path, allow_outside: see `read_robot`.
        """
        self._arm, self._hand = arm, hand
        self._tuning, self._failed = _tuned(robot_path, arm, hand, package_path, allow_outside)

    def variants(self) -> Iterator[Callable[[str], WrittenControllers]]:
        """What to try, the best first; each takes the reason why the one before failed."""
        if self._tuning is not None:
            yield lambda _: self._written(())
            if self._arm and self._hand:
                yield lambda why: self._written(("hand",), why)
        yield lambda why: self._written(("arm", "hand"), why or self._failed)

    def _written(self, by_position: tuple[str, ...], why: str = "") -> WrittenControllers:
        entries: dict[str, Entry] = {}
        if self._arm:
            reason = why if "arm" in by_position else None
            entries["arm_controller"] = Entry(_trajectory(self._arm, self._tuning, reason))
        if self._hand:
            reason = why if "hand" in by_position else None
            entries["hand_controller"] = Entry(_gripper(self._hand, self._tuning, reason))
        file = {"controllers": Entry(entries)}
        notes = self._tuning.notes if self._tuning is not None else ()
        return WrittenControllers(written(file, head=_HEAD), file, notes)


def _tuned(
    robot_path: Path, arm: tuple[str, ...], hand: tuple[str, ...], package_path: tuple[Path, ...], allow_outside: bool
) -> tuple[Tuning | None, str]:
    """Gains at the highest bandwidth with which all joints are stable; else None, and why."""
    path = robot_path.with_name("untuned.yaml")
    parts = {}
    if arm:
        parts["arm_controller"] = Entry(_trajectory(arm, None, None))
    if hand:
        parts["hand_controller"] = Entry(_gripper(hand, None, None))
    path.write_text(written({"controllers": Entry(parts)}), encoding="utf-8")
    failed = ""
    for bandwidth in BANDWIDTHS:
        wish = Wish(bandwidth, 1.0, PERIOD)
        try:
            return tune(robot_path, path, wish, package_path=package_path, allow_outside=allow_outside), ""
        except InvalidInput as refusal:
            failed = failed or refusal.findings[0].message
    return None, failed


def _trajectory(joints: tuple[str, ...], tuning: Tuning | None, position: str | None) -> dict[str, Entry]:
    tolerances: dict[str, Entry] = {name: Entry({"trajectory": TRAJECTORY, "goal": GOAL}) for name in joints}
    constraints = {
        "goal_time": Entry("2 s"),
        "stopped_velocity_tolerance": Entry(0.05),
        "joints": Entry(tolerances),
    }
    control = {"command_interface": Entry("position", f"because by effort: {position}", True)}
    if position is None:
        control = {
            "command_interface": Entry("effort", "PID on efforts, and the model's inverse dynamics as feed-forward"),
            "inverse_dynamics": Entry(True),
            **_gains(joints, tuning),
        }
    return {
        "type": Entry("joint_trajectory"),
        "joints": Entry(list(joints)),
        **control,
        "constraints": Entry(constraints, "tolerances of a goal: far above the error of these gains"),
    }


def _gripper(joints: tuple[str, ...], tuning: Tuning | None, position: str | None) -> dict[str, Entry]:
    control = (
        {"command_interface": Entry("position", f"because by effort: {position}", True)}
        if position is not None
        else _gains(joints, tuning)
    )
    return {"type": Entry("gripper"), "joints": Entry(list(joints)), **control}


def _gains(joints: tuple[str, ...], tuning: Tuning | None) -> dict[str, Entry]:
    if tuning is None:
        gains: dict[str, Value] = {name: {"p": 1.0, "d": 0.1} for name in joints}
        return {"gains": Entry(gains)}
    by_joint = {tuned.joint: tuned for tuned in tuning.joints}
    rows: dict[str, Entry] = {}
    for name in joints:
        tuned = by_joint[name]
        row: dict[str, Value] = {"p": tuned.p, "d": tuned.d}
        if tuned.i:
            row |= {"i": tuned.i, "i_clamp": tuned.i_clamp}
        rows[name] = Entry(row)
    limited = {tuned.limited_by for tuned in (by_joint[name] for name in joints)} - {""}
    wish = tuning.wish
    why = f"by `tune`: {wish.bandwidth:g} Hz, damping {wish.damping:g}, at the largest inertia of each joint"
    if limited:
        why += f"; some are limited by: {', '.join(sorted(limited))}"
    return {"gains": Entry(rows, why)}
