"""Data-flow graph of a task or its log: planner, controllers, limits, drives, engine, sensors, topics.

The graph is built from the parts of a run: its controllers, drivetrain, engine and table of channels. The graph of a
log shows the topics in the log.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from manipcli.control.actuation import Actuation
from manipcli.control.controller import Controller
from manipcli.control.factory import build_controllers
from manipcli.control.roles import is_follower, is_hand
from manipcli.core.text import number_of
from manipcli.logs.graph_sensors import SensorGraph, node_id
from manipcli.logs.recorded_files import (
    recorded_controllers_file,
    recorded_robot,
    recorded_robot_file,
    recorded_scene,
    recorded_task_file,
)
from manipcli.model.robot import RobotModel
from manipcli.record import channels
from manipcli.record.channels import channel_table
from manipcli.record.foreign.origin import is_own
from manipcli.record.foreign.topics import Topic, open_topics
from manipcli.record.read.reading import open_recording
from manipcli.record.selection import PLOTTED, Selection, word
from manipcli.report.logs.graph import Edge, Graph, Node
from manipcli.run.run_log import action_of, recorded
from manipcli.scene.scene import Scene
from manipcli.simulate.engines import ENGINES
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.recording import JUDGED
from manipcli.spec.sensors import SensorSpec
from manipcli.spec.task import TaskSpec
from manipcli.task.load_task import load_task

PRODUCERS: Final[Mapping[str, str]] = {
    channels.ROBOT_DESCRIPTION: "robot",
    channels.TF_STATIC: "robot",
    channels.MARKERS: "scene",
    channels.JOINT_STATES: "joints",
    channels.TF: "engine",
    channels.SCENE_JOINTS: "engine",
    channels.CONTACTS: "contacts",
    channels.EVENTS: "task",
    channels.ROSOUT: "task",
    channels.ACTUATOR_STATES: "drives",
}
"""Publishing node of the topics that no controller publishes."""
BY_THE_CLOCK: Final = (*JUDGED, *PLOTTED, "wrench", "sensors")
MOST_NAMES: Final = 4


def task_graph(path: Path, *, package_path: Sequence[Path] = (), allow_outside: bool = False) -> Graph:
    """The graph of a task file.

    Raises:
        InvalidInput: a file of the task cannot be used.
    """
    task = load_task(path, package_path=package_path, allow_outside=allow_outside)
    return _Builder(task.spec, task.controllers, task.robot, task.scene, task.sensors, None).graph()


def log_graph(path: Path) -> Graph:
    """The graph of a log, with the number of messages per topic; only topics for logs of other programs.

    Raises:
        InvalidInput: the file is not a log, is damaged, or lacks its attachments.
    """
    topics = open_topics(path).all
    if not is_own(path):
        nodes = tuple(_topic_node(name, topic.type, _held(topic)) for name, topic in topics.items())
        note = f"{path.name} not written by manipcli: the sources of its topics are unknown"
        return Graph(path.name, nodes, (), (note,))
    recording = open_recording(path)
    spec = recorded_task_file(recording, path).spec
    controllers = recorded_controllers_file(recording, path).spec
    robot, scene = recorded_robot(recording, path), recorded_scene(recording, path)
    sensors = {**(recorded_robot_file(recording, path).spec.sensors or {}), **(spec.sensors or {})}
    version = recording.metadata.get("versions", {}).get(spec.simulation.engine, "")
    notes = () if recording.lost is None else (recording.lost,)
    return _Builder(spec, controllers, robot, scene, sensors, topics, version=version, notes=notes).graph()


class _Builder:
    def __init__(
        self,
        spec: TaskSpec,
        file: ControllersSpec,
        robot: RobotModel,
        scene: Scene,
        sensors: Mapping[str, SensorSpec],
        topics: Mapping[str, Topic] | None,
        *,
        version: str = "",
        notes: tuple[str, ...] = (),
    ) -> None:
        self._spec, self._file, self._robot, self._scene = spec, file, robot, scene
        self._topics, self._notes = topics, notes
        self._period = spec.simulation.control_period
        self._sensors = SensorGraph(sensors, robot, self._period)
        self._member = ENGINES[spec.simulation.engine]
        self._version = version or self._member.version()
        manager = build_controllers(file, robot, self._period)
        self._controllers = manager.controllers
        self._nodes: dict[str, Node] = {}
        self._edges: list[Edge] = []

    def graph(self) -> Graph:
        self._task()
        for controller in self._controllers:
            self._controller(controller)
        self._limits_and_drives()
        self._engine()
        self._feedback()
        self._publish()
        return Graph(self._spec.task, tuple(self._nodes.values()), tuple(self._edges), self._notes)

    def _add(self, node: Node) -> None:
        self._nodes[node.id] = node

    def _join(self, source: str, target: str, label: str = "", *, idle: bool = False, back: bool = False) -> None:
        self._edges.append(Edge(source, target, label, idle, back))

    def _task(self) -> None:
        spec = self._spec
        steps = tuple(
            f"{step.id}: {step.verb}{f', until {step.until.name}' if step.until is not None else ''}"
            for step in spec.steps
        )
        self._add(Node("task", "task", spec.task, details=(number_of(len(steps), "step"),), items=steps))
        self._add(Node("planner", "planner", "planner", details=(f"seed {spec.simulation.seed}",)))
        self._join("task", "planner", "steps")

    def _controller(self, controller: Controller) -> None:
        own = self._file.controllers[controller.name]
        rate = own.update_rate or 1.0 / self._period
        details = [own.type, f"{rate:g} Hz"]
        if controller.feed_forward != "none":
            details.append(f"adds {controller.feed_forward.replace('_', ' ')}")
        details += [] if own.active else ["inactive at the start"]
        self._add(Node(controller.name, "controller", controller.name, details=tuple(details), idle=not own.active))
        if is_follower(controller) or is_hand(controller):
            what = "trajectories" if is_follower(controller) else "grips"
            self._join("planner", controller.name, f"{what} by {action_of(controller)}", idle=not own.active)
        if controller.interfaces:
            what = f"{', '.join(controller.interfaces)} of {_named(controller.joints)}"
            self._join(controller.name, "limits", what, idle=not own.active)

    def _limits_and_drives(self) -> None:
        """Joint limits, then transmissions and actuators if they are not ideal."""
        robot = self._robot
        limits = [joint.limits for joint in robot.moving_joints]
        there = {
            "position": any(limit.lower is not None or limit.upper is not None for limit in limits),
            "velocity": any(limit.velocity is not None for limit in limits),
            "effort": any(limit.effort is not None for limit in limits),
            "soft": any(limit.soft is not None for limit in limits),
        }
        held = [kind for kind, has in there.items() if has]
        self._add(Node("limits", "limits", "joint limits", details=(number_of(len(limits), "joint"), *held)))
        actuation = Actuation(robot, self._period)
        acts = bool(actuation.names) and not actuation.ideal and self._member.physics == "full"
        by_effort = any("effort" in controller.interfaces for controller in self._controllers)
        others = sorted({limit for c in self._controllers for limit in c.interfaces if limit != "effort"})
        if actuation.names:
            self._add(self._drives(actuation, acts=acts))
        if acts and by_effort:
            self._join("limits", "drives", "effort")
            self._join("drives", "engine", "effort at the joints")
            if others:
                self._join("limits", "engine", ", ".join(others))
        else:
            self._join("limits", "engine", ", ".join([*others, *(["effort"] if by_effort else [])]))
        if actuation.names and not (acts and by_effort):
            self._join("engine", "drives", "position, velocity, effort")

    def _drives(self, actuation: Actuation, *, acts: bool) -> Node:
        names = actuation.names
        tags = [tag for tag in self._robot.transmissions if set(tag.actuators) <= set(names)]
        kinds = dict.fromkeys(tag.type for tag in tags)
        counts = [f"{sum(tag.type == kind for tag in tags)} {kind}" for kind in kinds]
        details = (
            f"transmissions: {', '.join(counts)}",
            number_of(len(names), "actuator") + (f": {', '.join(names)}" if len(names) <= MOST_NAMES else ""),
            "with limits, friction and latency" if acts else "ideal: no effect",
        )
        return Node("drives", "drive", "transmissions and actuators", details=details)

    def _engine(self) -> None:
        simulation = self._spec.simulation
        steps = round(simulation.control_period / simulation.step)
        physics = f"{number_of(steps, 'physics step')} of {1e3 * simulation.step:g} ms per tick"
        if self._member.physics != "full":
            physics = "ideal tracking, no physics"
        self._add(Node("engine", "engine", f"{self._member.name} {self._version}".strip(), details=(physics,)))
        bodies = self._scene.bodies
        count = "1 body" if len(bodies) == 1 else f"{len(bodies)} bodies"
        free = sum(not body.fixed for body in bodies)
        self._add(Node("robot", "robot", self._robot.name, details=(number_of(len(self._robot.links), "link"),)))
        self._add(Node("scene", "scene", count, details=(f"{free} free to move",)))
        self._join("robot", "engine", "description")
        self._join("scene", "engine", "bodies")

    def _feedback(self) -> None:
        """Measurements and their consumers."""
        self._add(Node("joints", "sensor", "measured joints"))
        self._add(Node("contacts", "sensor", "contacts"))
        self._join("engine", "joints")
        self._join("engine", "contacts")
        for node in self._sensors.nodes():
            self._add(node)
            self._join("engine", node.id)
        for name, reader, what in self._sensors.asked(self._spec):
            self._join(node_id(name), reader, what, back=True)
        for controller in self._controllers:
            idle = not self._file.controllers[controller.name].active
            for request in controller.sensors:
                sensor = node_id(request.sensor) if request.sensor else f"wrench {controller.name}"
                if not request.sensor:
                    self._add(Node(sensor, "sensor", f"wrench at {request.joint}"))
                    self._join("engine", sensor)
                self._join(sensor, controller.name, idle=idle, back=True)
            for name in self._sensors.measured(controller):
                self._join(node_id(name), controller.name, idle=idle, back=True)
            if controller.joints and not self._sensors.complete(controller):
                self._join("joints", controller.name, idle=idle, back=True)
            if is_hand(controller):
                self._join("contacts", controller.name, "forces", idle=idle, back=True)

    def _publish(self) -> None:
        """Topics and their publishers."""
        spec = self._spec
        selection = Selection(spec.record.strides(self._period), spec.record.left_out)
        always = channel_table([], scene_joints=bool(self._scene.joints))
        common = {channel.topic for channel in always}
        rows = [(channel, PRODUCERS[channel.topic]) for channel in always]
        for controller in self._controllers:
            mine = channel_table([recorded(controller)])
            rows += [(channel, controller.name) for channel in mine if channel.topic not in common]
        rates = {channel.topic: rate for channel, _, rate in self._sensors.topics()}
        rows += [(channel, sensor) for channel, sensor, _ in self._sensors.topics()]
        for channel, producer in rows:
            if self._topics is None:
                if not selection.holds(channel):
                    continue
                clock = word(channel.topic) in BY_THE_CLOCK
                rate = 1.0 / (selection.stride(channel.topic, self._period) * self._period)
                about = f"{rates.get(channel.topic, rate):g} Hz" if clock else ""
            elif channel.topic in self._topics:
                about = _held(self._topics[channel.topic])
            else:
                continue
            self._add(_topic_node(channel.topic, channel.type, about))
            if producer in self._nodes:
                self._join(producer, channel.topic)
        known = {channel.topic for channel, _ in rows}
        for name, topic in (self._topics or {}).items():
            if name not in known:
                self._add(_topic_node(name, topic.type, _held(topic)))


def _topic_node(name: str, kind: str, about: str) -> Node:
    return Node(name, "topic", name, kind, (about,) if about else ())


def _held(topic: Topic) -> str:
    """`14550 messages, 1000 Hz`."""
    text = number_of(topic.count, "message")
    if topic.count > 2 and topic.last > topic.first:
        text += f", {(topic.count - 1) / ((topic.last - topic.first) / 1e9):.4g} Hz"
    return text


def _named(names: Sequence[str]) -> str:
    """The first few names, and the last."""
    return ", ".join(names) if len(names) <= MOST_NAMES else f"{names[0]}, {names[1]} … {names[-1]}"
