"""Recorder of a run into an MCAP file, fast enough for the control loop.

`tick` only copies numbers into preallocated blocks. Every 0.5 s of simulated time a block is encoded at once: messages
of fixed size as rows of bytes, the others individually, in time order. A thread compresses and writes it as one chunk.
Flushed data stays readable if the process is killed.

Times are nanoseconds of simulated time: round(tick * period * 1e9); log time = publish time = header stamp.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from manipcli.control.action import Feedback, GoalResult
from manipcli.control.controller import ControllerOutput
from manipcli.core.geometry import Array, Transform
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.record import channels as topics
from manipcli.record import messages
from manipcli.record.channels import (
    NO_BELIEF,
    TRANSIENT_LOCAL,
    BeliefChannels,
    Channel,
    ControllerChannel,
    MeasuredChannel,
    Recorded,
    believed_frame,
    channel_table,
)
from manipcli.record.contents import RECORD, Contents
from manipcli.record.encode import encode
from manipcli.record.faults import RecordingRefused
from manipcli.record.recording import TaskEvent
from manipcli.record.schemas import ACTIONS, schema_text
from manipcli.record.selection import EVERYTHING, Selection, word
from manipcli.record.write.block import Block, Single
from manipcli.record.write.container import Container
from manipcli.record.write.goals import GoalLog
from manipcli.record.write.rows import message_record
from manipcli.scene.scene import Scene
from manipcli.spec.recording import JUDGED

BLOCK_SECONDS = 0.5
CHUNK = 1 << 24
"""[byte] Pictures and clouds beyond this begin a new block, and so do measurements of numbers."""
MOST_CHUNK = 3 << 24
"""[byte] A picture with which the block would have more than this begins a new one, within a tick, too: readers refuse
chunks of more than 64 MiB."""


class Recorder:
    """Records a run into `<path>.partial`, which is renamed to `path` when it is finished.

    Args:
        path: path of the finished recording.
        robot: robot whose moving joints define the joint vectors.
        scene: scene whose movable bodies define the body arrays.
        controllers: in the order of the outputs for `tick`; None is not recorded.
        period: control period [s].
        attachments: (file name, media type, bytes), written first.
        metadata: name -> key -> value, known before the run.
        selection: recorded topics and their rates.
        overwrite: replace a recording or partial recording at this path.
        live: the recording is that of a live session, and has its commands.
        sensors: topics of sensors; `attach` gives the numbers.
        sensor_frames: (parent, child, X_PC) of their frames.
        belief: topics of what the robot believes; `believe` gives the poses.

    Attributes:
        listener: called with the topic, time [ns] and CDR bytes of each message that is not written at every tick.

    Raises:
        RecordingRefused: the path cannot or must not be written.
        RecordingFailed: from any method, if writing fails; the partial file keeps the flushed data.
    """

    def __init__(
        self,
        path: Path,
        *,
        robot: RobotModel,
        scene: Scene,
        controllers: Sequence[Recorded],
        period: float,
        attachments: Sequence[tuple[str, str, bytes]],
        metadata: Mapping[str, Mapping[str, str]],
        selection: Selection = EVERYTHING,
        overwrite: bool = False,
        live: bool = False,
        sensors: Sequence[MeasuredChannel] = (),
        sensor_frames: Sequence[tuple[str, str, Transform]] = (),
        belief: BeliefChannels = NO_BELIEF,
    ) -> None:
        self.listener: Callable[[str, int, bytes], None] = _nobody
        further = [*(child for _, child, _ in sensor_frames), *map(believed_frame, belief.bodies)]
        _check_names(path, robot, scene, further, [name for name, _, _ in attachments])
        everything = channel_table(
            controllers, live=live, sensors=sensors, belief=belief, scene_joints=bool(scene.joints)
        )
        table = [channel for channel in everything if selection.holds(channel)]
        self._period = period
        self._ids = {channel.topic: channel.id for channel in table}
        measured = sum(8 * sensor.width / sensor.every for sensor in sensors)  # [byte] per tick
        capacity = max(1, min(round(BLOCK_SECONDS / period), int(CHUNK / max(1.0, measured))))
        self._block = Block(robot, scene, controllers, table, selection, period, capacity, sensors, belief.bodies)
        self._singles: list[Single] = []
        self._room = CHUNK
        self._sequences: Counter[int] = Counter()
        self._contact_encoder = messages.ContactEncoder()
        self._container = Container(path, overwrite=overwrite)
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._writing: Future[None] | None = None
        self._names = [None if c is None else c.name for c in controllers]
        self._contents = Contents(
            period=period,
            joints=robot.joint_names,
            bodies=tuple(body.name for body in scene.movable),
            controllers={c.name: c.joints for c in controllers if isinstance(c, ControllerChannel)},
            strides={
                c.topic: selection.stride(c.topic, period)
                for c in table
                if word(c.topic) in JUDGED and c.topic != topics.SCENE_JOINTS
            },
            absent=tuple(channel.topic for channel in everything if channel not in table),
            believed=belief.bodies,
        )
        self._goals = {c.name: GoalLog(c) for c in controllers if isinstance(c, ControllerChannel) and c.action}
        self._touches = topics.CONTACTS in self._ids
        self._frames = {sensor.topic: (sensor.message, sensor.frame) for sensor in sensors}
        static = (*messages.static_transforms(robot, scene), *sensor_frames)
        try:
            self._begin(table, attachments, {RECORD: self._contents.metadata(), **metadata}, robot, scene, static)
        except BaseException:
            self._thread.shutdown()
            self._container.close()
            raise

    def _begin(
        self,
        table: Sequence[Channel],
        attachments: Sequence[tuple[str, str, bytes]],
        metadata: Mapping[str, Mapping[str, str]],
        robot: RobotModel,
        scene: Scene,
        static: Sequence[tuple[str, str, Transform]],
    ) -> None:
        """Write what is known before the first tick."""
        _declare(self._container, table)
        for name, media_type, data in attachments:
            self._container.attachment(name, media_type, data)
        for name, values in metadata.items():
            self._container.metadata(name, values)
        self._single(topics.ROBOT_DESCRIPTION, 0, messages.string_message(robot.urdf))
        self._single(topics.TF_STATIC, 0, messages.tf_message(static, 0))
        self._single(topics.MARKERS, 0, messages.marker_message(scene, 0))
        self.flush()

    @property
    def partial_path(self) -> Path:
        """Path of the file while it is written."""
        return self._container.partial

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        """Record the state and the controller outputs at `tick`; the arrays can be reused afterwards."""
        if self._block.count == self._block.capacity or self._room < 0:
            self._send()
        self._block.add(tick, state, outputs)

    def attach(self, numbers: Array) -> None:
        """Record the numbers of all sensors from now on, at every tick; see `MeasuredChannel`."""
        self._block.attach(numbers)

    def believe(self, poses: Array) -> None:
        """Record these poses (k, 7) of the bodies of `belief` from now on, at every tick."""
        self._block.believe(poses)

    def believed(self, tick: int, name: str, X_WO: Transform, covariance: Array) -> None:
        """Record what the robot believes about an uncertain body from `tick` on; `covariance`: see `Belief`."""
        topic, ns = f"{topics.BELIEF}/{name}", self._ns(tick)
        if topic in self._ids:
            data = messages.pose_with_covariance(X_WO, covariance, ns)
            self._single(topic, ns, data)

    def measured(self, tick: int, taken: int, topic: str, fields: Mapping[str, object]) -> None:
        """Record a message of a sensor that arrives at `tick` and was taken at the tick `taken`."""
        if topic in self._ids or self.listener is not _nobody:
            kind, frame = self._frames[topic]
            data = encode(kind, fields, ns=self._ns(taken), frame=frame).data
            if topic in self._ids and CHUNK - self._room + len(data) > MOST_CHUNK:
                self._send()
            self._single(topic, self._ns(tick), data)

    def contacts(self, tick: int, contacts: Sequence[Contact]) -> None:
        """Record all contacts from `tick` until the next call; see `contact_filter.py`."""
        if self._touches:
            ns = self._ns(tick)
            self._single(topics.CONTACTS, ns, self._contact_encoder.encode(ns, contacts))

    def event(self, tick: int, *, kind: str, step: str, verb: str, outcome: str, text: str, place: str) -> None:
        """Record an event of the task, also on /rosout."""
        ns = self._ns(tick)
        event = TaskEvent(time=ns / 1e9, kind=kind, step=step, verb=verb, outcome=outcome, text=text, place=place)
        self._single(topics.EVENTS, ns, messages.event_message(ns, event))
        self._single(topics.ROSOUT, ns, messages.log_message(ns, event))

    def live_command(self, tick: int, *, op: str, name: str, id_: str, json: str) -> None:
        """Record a command from outside that takes effect at `tick`."""
        ns = self._ns(tick)
        data = messages.live_command_message(ns, tick, op, name, id_, json)
        self._single(topics.LIVE_COMMANDS, ns, data)

    def goal_sent(self, tick: int, controller: str) -> int:
        """Record that a controller accepted a goal before `tick`; returns its number in the log."""
        ns, goals = self._ns(tick), self._goals[controller]
        number = goals.sent(ns)
        self._single(goals.channel.status_topic, ns, goals.status(ns))
        return number

    def goal_feedback(self, tick: int, controller: str, number: int, feedback: Feedback) -> None:
        """Record the feedback of a goal; ROS action servers publish it at 20 Hz."""
        ns, goals = self._ns(tick), self._goals[controller]
        self._single(goals.channel.feedback_topic, ns, goals.feedback(ns, number, feedback))

    def feedback_message(self, tick: int, controller: str, feedback: Feedback) -> tuple[bytes, str]:
        """The message of `goal_feedback` without a goal id, and its type; it is not recorded."""
        goals = self._goals[controller]
        kind, _ = ACTIONS[goals.channel.action]
        return goals.feedback(self._ns(tick), None, feedback), kind

    def goal_ended(self, tick: int, controller: str, number: int, result: GoalResult, feedback: Feedback) -> None:
        """Record the end of a goal; `feedback`: final state of the joints."""
        ns, goals = self._ns(tick), self._goals[controller]
        goals.ended(ns, number, result)
        self._single(goals.channel.status_topic, ns, goals.status(ns))
        self._single(goals.channel.result_topic, ns, goals.result(ns, result, feedback))

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Append metadata; when read, later keys of a name replace earlier ones."""
        self.flush()
        self._container.metadata(name, values)

    def flush(self) -> None:
        """Write everything recorded so far to the partial file."""
        self._send()
        self._written()

    def _send(self) -> None:
        """Encode the block and hand it to the writer thread after its previous block; write errors are raised here or
        in the next flush."""
        singles, self._singles = self._singles, []
        self._room = CHUNK
        changes = self._block.idle
        content = self._block.encode(singles)
        self._written()
        if changes:
            self._switched(changes)
        if content is not None:
            self._writing = self._thread.submit(self._container.chunk, content)

    def _switched(self, changes: Sequence[tuple[int, frozenset[int]]]) -> None:
        """Write, before their chunk, which controllers are inactive from which ticks on."""
        inactive = dict(self._contents.inactive)
        for tick, idle in changes:
            time = self._ns(tick) / 1e9
            names = {self._names[k] for k in idle}
            for name, spans in inactive.items():
                if spans[-1][1] is None and name not in names:
                    inactive[name] = (*spans[:-1], (spans[-1][0], time))
            for name in filter(None, (self._names[k] for k in sorted(idle))):
                spans = inactive.get(name, ())
                if not spans or spans[-1][1] is not None:
                    inactive[name] = (*spans, (time, None))
        if inactive != self._contents.inactive:
            self._contents = replace(self._contents, inactive=inactive)
            self._container.metadata(RECORD, self._contents.metadata())

    def _written(self) -> None:
        """Wait for the writer thread and raise its error; after an interrupted wait it continues to write."""
        writing = self._writing
        if writing is None:
            return
        try:
            writing.result()
        finally:
            if writing.done():
                self._writing = None

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write the last metadata (the verdict) and the summary, close the file and rename it."""
        self.flush()
        for name, values in metadata.items():
            self._container.metadata(name, values)
        self._container.finish()
        self._thread.shutdown()

    def close_partial(self) -> None:
        """Flush and stop without finishing; the file keeps the name `*.partial`.

        Does nothing if the recording is finished, stopped or failed.
        """
        if self._container.closed and self._writing is None:
            return
        try:
            self.flush()
        finally:
            self._container.close()
            self._thread.shutdown()

    def _ns(self, tick: int) -> int:
        return round(tick * self._period * 1e9)

    def _single(self, topic: str, ns: int, data: bytes) -> None:
        self.listener(topic, ns, data)
        channel = self._ids.get(topic)
        if channel is None:  # left out
            return
        self._sequences[channel] += 1
        self._room -= len(data)
        self._singles.append(Single(ns, channel, message_record(channel, self._sequences[channel], ns, data)))


def _nobody(topic: str, ns: int, data: bytes) -> None:
    """Listens to nothing."""


def _declare(container: Container, table: Sequence[Channel]) -> None:
    """Declare each schema once, and the channels."""
    from mcap.records import Channel as ChannelRecord
    from mcap.records import Schema

    types = {channel.type: channel.definition or schema_text(channel.type) for channel in table}
    container.begin(
        [
            Schema(id=k, name=name, encoding="ros2msg", data=text.encode())
            for k, (name, text) in enumerate(types.items(), start=1)
        ],
        [
            ChannelRecord(
                id=channel.id,
                topic=channel.topic,
                message_encoding="cdr",
                metadata={"offered_qos_profiles": TRANSIENT_LOCAL} if channel.latched else {},
                schema_id=list(types).index(channel.type) + 1,
            )
            for channel in table
        ],
    )


def _check_names(
    path: Path, robot: RobotModel, scene: Scene, further: Sequence[str], attachments: Sequence[str]
) -> None:
    """Check that frame names are unique in /tf and attachments have plain file names."""
    frames = Counter([messages.WORLD, *(link.name for link in robot.links if link.name != messages.WORLD)])
    frames.update([body.name for body in scene.bodies])
    frames.update([frame.name for frame in scene.frames])
    frames.update(further)
    for name, times in frames.items():
        if times > 1:
            raise RecordingRefused(
                path,
                f"duplicate frame name '{name}' in robot and scene",
                hint="rename the body or frame of the task",
            )
    for name, times in Counter(attachments).items():
        if times > 1 or name in ("", "..") or name != Path(name).name or "\0" in name:
            raise RecordingRefused(path, f"attachment '{name}' needs a unique plain file name")
