"""Sensors in the data-flow graph: where they are, who reads them, and their topics."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from manipcli.conditions.formula import sensors_of
from manipcli.conditions.members import CONDITIONS
from manipcli.control.controller import Controller
from manipcli.control.roles import has_reflex
from manipcli.core.text import number_of
from manipcli.model.robot import RobotModel
from manipcli.plan.steps.locate import LocateSpec
from manipcli.record.channels import Channel, MeasuredChannel, channel_table
from manipcli.report.logs.graph import Node
from manipcli.run.run_log import measured_channels
from manipcli.simulate.hand_pads import hand_pads
from manipcli.simulate.mount import WORLD
from manipcli.simulate.sensor_layout import Place, layout
from manipcli.spec.mounted_sensor import MountedSpec
from manipcli.spec.sensors import SensorSpec
from manipcli.spec.task import TaskSpec


@dataclass(frozen=True, slots=True)
class SensorGraph:
    """The sensors of a task: `period` [s] of its control loop."""

    specs: Mapping[str, SensorSpec]
    robot: RobotModel
    period: float

    @property
    def places(self) -> dict[str, Place]:
        """Their layout."""
        return layout(self.specs, self.robot, self.period)

    def nodes(self) -> Iterator[Node]:
        """One for each."""
        for name, place in self.places.items():
            spec = self.specs[name]
            where = number_of(len(place.joints or ()), "joint")
            if isinstance(spec, MountedSpec):
                where = f"on {spec.link}" if spec.link else f"in {spec.frame or WORLD}"
            details = [spec.type, where, f"{1.0 / (place.sampling.every * self.period):g} Hz"]
            details += [f"{1e3 * spec.delay:g} ms late"] if spec.delay else []
            yield Node(node_id(name), "sensor", name, details=tuple(details))

    def measured(self, controller: Controller) -> list[str]:
        """The sensors that measure joints of a controller, or the slip of what a hand holds."""
        own = set(self.robot.indices(controller.joints))
        pads = hand_pads(self.specs, self.robot, controller.joints) if has_reflex(controller) else ()
        joints = [name for name, place in self.places.items() if own & set(place.joints or ())]
        return [*joints, *(name for name, _, _ in pads)]

    def complete(self, controller: Controller) -> bool:
        """Whether sensors measure all joints of a controller."""
        measured = {index for place in self.places.values() for index in place.joints or ()}
        return measured.issuperset(self.robot.indices(controller.joints))

    def asked(self, task: TaskSpec) -> Iterator[tuple[str, str, str]]:
        """The sensors that the task asks: the name, the id of the node that gets the answer, and for what."""
        for step in task.steps:
            if isinstance(step.body, LocateSpec):
                yield step.body.with_, "planner", str(step.id)
        judged = dict.fromkeys(name for each in task.judged for name in sensors_of(each.condition, CONDITIONS))
        yield from ((name, "task", "expectations") for name in judged if name in self.specs)

    def topics(self) -> list[tuple[Channel, str, float]]:
        """Their channels, with the id of the node that publishes each, and its rate [Hz]."""
        measured: tuple[MeasuredChannel, ...] = measured_channels(self.specs, self.robot, self.period)
        table = {channel.topic: channel for channel in channel_table((), sensors=measured)}
        return [
            (table[own.topic], node_id(own.topic.split("/")[2]), 1.0 / (own.every * self.period)) for own in measured
        ]


def node_id(name: str) -> str:
    """The id of the node of a sensor."""
    return f"sensor {name}"
