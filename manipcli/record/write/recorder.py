"""Writes a run into an MCAP file, cheaply enough for the control loop.

`tick` only copies numbers into preallocated blocks. Twice a simulated second a block is encoded in one go: every
message of a fixed size as rows of bytes, the few others one by one, all in the order of their time, as one compressed
chunk, which a thread compresses and writes. What has been flushed stays readable whatever happens to the process.

Times are nanoseconds of simulated time: round(tick * period * 1e9); log time = publish time = header stamp.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from manipcli.control.action import Feedback, GoalResult
from manipcli.control.controller import ControllerOutput
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.record import channels as topics
from manipcli.record import messages
from manipcli.record.channels import TRANSIENT_LOCAL, Channel, ControllerChannel, Recorded, channel_table
from manipcli.record.contents import RECORD, Contents
from manipcli.record.faults import RecordingRefused
from manipcli.record.recording import TaskEvent
from manipcli.record.schemas import schema_text
from manipcli.record.selection import EVERYTHING, Selection, word
from manipcli.record.write.block import Block, Single
from manipcli.record.write.container import Container
from manipcli.record.write.goals import GoalLog
from manipcli.record.write.rows import message_record
from manipcli.scene.scene import Scene
from manipcli.spec.task import JUDGED

BLOCK_SECONDS = 0.5


class Recorder:
    """One run on its way into `<path>.partial`, which becomes `path` when it is finished.

    Args:
        path: where the recording will be.
        robot: whose moving joints the joint vectors follow.
        scene: whose movable bodies the body arrays follow.
        controllers: in the order of the outputs given to `tick`; None is not recorded.
        period: [s] of a tick.
        attachments: (file name, media type, bytes), written first.
        metadata: name -> key -> value, what is known before the run.
        selection: what of it is recorded, and how often.
        overwrite: replace a recording, or what a killed run left, at this path.

    Raises:
        RecordingRefused: nothing can or may be written there; nothing was.
        RecordingFailed: from any method: the disk refused; the partial file keeps what was flushed.
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
    ) -> None:
        _check_names(path, robot, scene, [name for name, _, _ in attachments])
        everything = channel_table(controllers)
        table = [channel for channel in everything if selection.holds(channel)]
        self._period = period
        self._ids = {channel.topic: channel.id for channel in table}
        capacity = max(1, round(BLOCK_SECONDS / period))
        self._block = Block(robot, scene, controllers, table, selection, period, capacity)
        self._singles: list[Single] = []
        self._sequences: Counter[int] = Counter()
        self._contact_encoder = messages.ContactEncoder()
        self._container = Container(path, overwrite=overwrite)
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._writing: Future[None] | None = None
        holds = Contents(
            period=period,
            joints=robot.joint_names,
            bodies=tuple(body.name for body in scene.movable),
            controllers={c.name: c.joints for c in controllers if isinstance(c, ControllerChannel)},
            strides={c.topic: selection.stride(c.topic, period) for c in table if word(c.topic) in JUDGED},
            absent=tuple(channel.topic for channel in everything if channel not in table),
        )
        self._goals = {c.name: GoalLog(c) for c in controllers if isinstance(c, ControllerChannel) and c.action}
        self._touches = topics.CONTACTS in self._ids
        try:
            self._begin(table, attachments, {RECORD: holds.metadata(), **metadata}, robot, scene)
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
    ) -> None:
        """Writes what is known before the first tick."""
        _declare(self._container, table)
        for name, media_type, data in attachments:
            self._container.attachment(name, media_type, data)
        for name, values in metadata.items():
            self._container.metadata(name, values)
        self._single(topics.ROBOT_DESCRIPTION, 0, messages.string_message(robot.urdf))
        self._single(topics.TF_STATIC, 0, messages.tf_message(messages.static_transforms(robot, scene), 0))
        self._single(topics.MARKERS, 0, messages.marker_message(scene, 0))
        self.flush()

    @property
    def partial_path(self) -> Path:
        """The file while it is written."""
        return self._container.partial

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        """The state of the world at `tick` and what the controllers put out; the arrays may be reused afterwards."""
        if self._block.count == self._block.capacity:
            self._send()
        self._block.add(tick, state, outputs)

    def contacts(self, tick: int, contacts: Sequence[Contact]) -> None:
        """Everything that touches at `tick`, until the next call; see `contact_filter.py`."""
        if self._touches:
            ns = self._ns(tick)
            self._single(topics.CONTACTS, ns, self._contact_encoder.encode(ns, contacts))

    def event(self, tick: int, *, kind: str, step: str, verb: str, outcome: str, text: str, place: str) -> None:
        """Something happened in the task; also said on /rosout."""
        ns = self._ns(tick)
        event = TaskEvent(time=ns / 1e9, kind=kind, step=step, verb=verb, outcome=outcome, text=text, place=place)
        self._single(topics.EVENTS, ns, messages.event_message(ns, event))
        self._single(topics.ROSOUT, ns, messages.log_message(ns, event))

    def goal_sent(self, tick: int, controller: str) -> int:
        """A controller accepted a goal before `tick`; its number, by which the log knows it from now on."""
        ns, goals = self._ns(tick), self._goals[controller]
        number = goals.sent(ns)
        self._single(goals.channel.status_topic, ns, goals.status(ns))
        return number

    def goal_feedback(self, tick: int, controller: str, number: int, feedback: Feedback) -> None:
        """How far a goal is; ROS's action servers tell it 20 times a second."""
        ns, goals = self._ns(tick), self._goals[controller]
        self._single(goals.channel.feedback_topic, ns, goals.feedback(ns, number, feedback))

    def goal_ended(self, tick: int, controller: str, number: int, result: GoalResult, feedback: Feedback) -> None:
        """A goal is over; `feedback`: where it left the joints."""
        ns, goals = self._ns(tick), self._goals[controller]
        goals.ended(ns, number, result)
        self._single(goals.channel.status_topic, ns, goals.status(ns))
        self._single(goals.channel.result_topic, ns, goals.result(ns, result, feedback))

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """More metadata behind all that was recorded so far; read back, later keys of a name replace earlier ones."""
        self.flush()
        self._container.metadata(name, values)

    def flush(self) -> None:
        """Everything given so far is in the partial file when this returns."""
        self._send()
        self._written()

    def _send(self) -> None:
        """Encodes what waits and hands it to the thread that compresses and writes, once that is done with what it
        has: the control loop goes on meanwhile. What the disk refuses is met here or in the next flush."""
        singles, self._singles = self._singles, []
        content = self._block.encode(singles)
        self._written()
        if content is not None:
            self._writing = self._thread.submit(self._container.chunk, content)

    def _written(self) -> None:
        """Waits for the thread; what it met is raised here. After an interrupted wait it still writes."""
        writing = self._writing
        if writing is None:
            return
        try:
            writing.result()
        finally:
            if writing.done():
                self._writing = None

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Writes the last metadata (the verdict) and the summary, closes the file and gives it its name."""
        self.flush()
        for name, values in metadata.items():
            self._container.metadata(name, values)
        self._container.finish()
        self._thread.shutdown()

    def close_partial(self) -> None:
        """Stops without finishing: everything is flushed, the file keeps the name `*.partial`.

        Does nothing once the recording is finished, has stopped or has failed.
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
        channel = self._ids.get(topic)
        if channel is None:  # left out
            return
        self._sequences[channel] += 1
        self._singles.append(Single(ns, channel, message_record(channel, self._sequences[channel], ns, data)))


def _declare(container: Container, table: Sequence[Channel]) -> None:
    """Schemas, each once, and channels."""
    from mcap.records import Channel as ChannelRecord
    from mcap.records import Schema

    types = list(dict.fromkeys(channel.type for channel in table))
    container.begin(
        [
            Schema(id=k, name=name, encoding="ros2msg", data=schema_text(name).encode())
            for k, name in enumerate(types, start=1)
        ],
        [
            ChannelRecord(
                id=channel.id,
                topic=channel.topic,
                message_encoding="cdr",
                metadata={"offered_qos_profiles": TRANSIENT_LOCAL} if channel.latched else {},
                schema_id=types.index(channel.type) + 1,
            )
            for channel in table
        ],
    )


def _check_names(path: Path, robot: RobotModel, scene: Scene, attachments: Sequence[str]) -> None:
    """One name is one frame in /tf, and attachments are plain file names."""
    frames = Counter([messages.WORLD, *(link.name for link in robot.links if link.name != messages.WORLD)])
    frames.update([body.name for body in scene.bodies])
    frames.update([frame.name for frame in scene.frames])
    for name, times in frames.items():
        if times > 1:
            raise RecordingRefused(
                path,
                f"'{name}' names more than one frame of robot and scene",
                hint="give the body or frame of the task another name",
            )
    for name, times in Counter(attachments).items():
        if times > 1 or name in ("", "..") or name != Path(name).name or "\0" in name:
            raise RecordingRefused(path, f"attachment '{name}' needs a plain file name of its own")
