"""Sensors of a live session: what clients get is what the log has, pictures only on request, and nobody waits."""

from __future__ import annotations

import pickle
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader

from manipcli import pipeline
from manipcli.live.link import PICTURE, SAMPLE, TOO_LARGE, Link, complete
from manipcli.live.pictures import FIRST, MAX_PICTURE, PART, RATE, PictureQueue, PictureRequests, numbers_for
from manipcli.live.sensed import Sensed, SensedMessages
from manipcli.record.channels import MeasuredChannel
from manipcli.record.json_message import definition, to_json
from tests.live.sessions import SMALL, opened, serving

IMAGE, CLOUD, OTHER = "/sensors/eye/image_raw", "/sensors/eye/points", "/sensors/other/image_raw"
TOPICS = (IMAGE, CLOUD, OTHER)


class Clock:
    """Wall time, and what is to be called later."""

    def __init__(self) -> None:
        self.time = 100.0
        self.calls: list[tuple[float, Callable[[], None]]] = []

    def later(self, seconds: float, call: Callable[[], None]) -> None:
        self.calls.append((self.time + seconds, call))

    def pass_(self, seconds: float) -> None:
        self.time += seconds
        due, self.calls = [c for t, c in self.calls if t <= self.time], [x for x in self.calls if x[0] > self.time]
        for call in due:
            call()


def both() -> tuple[PictureQueue, PictureRequests, Clock]:
    numbers, clock = memoryview(bytearray(8 * numbers_for(TOPICS))).cast("q"), Clock()
    return PictureQueue(TOPICS, numbers), PictureRequests(TOPICS, numbers, lambda: clock.time, clock.later), clock


def test_one_whole_exposure_of_what_is_wanted_for_each_request() -> None:
    queue, requests, clock = both()
    wants = [queue.wants(topic, 1) for topic in TOPICS]
    requests.want({IMAGE, CLOUD, "/clock"})  # in the middle of an exposure: not half of it
    wants += [queue.wants(CLOUD, 1)]
    assert wants == [False] * 4
    assert [queue.wants(topic, ns) for ns in (2, 3) for topic in TOPICS] == [True, True, False, False, False, False]
    requests.handled(IMAGE, 10**6)
    assert not queue.wants(IMAGE, 4)
    clock.pass_(1.01 * 10**6 / RATE)
    assert queue.wants(IMAGE, 5)
    requests.handled(CLOUD, 1)
    clock.pass_(1.0)
    queue.put(IMAGE, 5, b"x")
    assert not queue.wants(IMAGE, 6)  # one is on its way
    assert queue.part() == (IMAGE, 5, b"x", True)
    assert queue.wants(IMAGE, 7)
    requests.want(())
    requests.handled(IMAGE, 1)
    clock.pass_(1.0)
    assert not queue.wants(IMAGE, 8)
    requests.want({IMAGE})
    clock.pass_(1.0)
    assert queue.wants(IMAGE, 9)


def test_all_pictures_together_keep_to_the_rate() -> None:
    queue, requests, clock = both()
    requests.want(TOPICS)
    sizes, sent, tick = {IMAGE: 900_000, CLOUD: 4_900_000, OTHER: 300_000}, 0, 0
    while clock.time < 104.0:
        tick += 1
        for topic in TOPICS:
            if queue.wants(topic, tick):
                sent += sizes[topic]
                requests.handled(topic, sizes[topic])
        clock.pass_(0.01)
    assert 0.7 * 4.0 * RATE < sent <= 4.0 * RATE + sum(sizes.values())


def test_pictures_come_in_parts_after_all_else_and_too_large_ones_not() -> None:
    numbers = memoryview(bytearray(8 * numbers_for(TOPICS))).cast("q")
    near, far = socket.socketpair()
    far.setblocking(False)
    received = bytearray()

    def arrived() -> list[tuple[Any, ...]]:
        try:
            while data := far.recv(1 << 20):
                received.extend(data)
        except BlockingIOError:
            pass
        return [pickle.loads(body) for body in complete(received)]

    with near, far:
        link = Link(near, numbers, TOPICS)
        picture = np.random.default_rng(3).bytes(3 * PART + 7)
        link.picture(IMAGE, 1, picture)
        assert arrived() == []
        for index in range(FIRST, len(numbers)):
            numbers[index] = 1
        link.picture(IMAGE, 2, picture)
        link.picture(CLOUD, 2, b"0" * (MAX_PICTURE + 1))
        found = arrived()
        for tick in range(6):
            link.sample(tick, None, [])
            link.take(tick)
            found += arrived()
    parts = [values for values in found if values[0] == PICTURE]
    assert b"".join(part for _, _, _, part, _ in parts) == picture
    assert [last for *_, last in parts] == [False] * 3 + [True]
    assert [values for values in found if values[0] == TOO_LARGE] == [(TOO_LARGE, CLOUD, MAX_PICTURE + 1)]
    kinds = [values[0] for values in found]
    assert kinds.count(SAMPLE) == 6
    samples = [k for k, kind in enumerate(kinds) if kind == SAMPLE]
    assert max(np.diff(samples)) <= 3


def test_samples_have_the_last_measurement_that_arrived_once() -> None:
    """A sensor that measures at every 7th tick, 3 ticks late, and loses some; samples at every 10th tick."""
    sensor = MeasuredChannel(
        "/sensors/s", "geometry_msgs/msg/WrenchStamped", "s", ("wrench",), arrived=2, first=3, width=6, every=7, delay=3
    )
    numbers = np.zeros(9)
    sensed, encoder = Sensed([sensor], numbers), SensedMessages([sensor], 0.001)
    kept = np.random.default_rng(5).random(400) < 0.5
    arrivals = [tick for tick in range(400) if tick >= 3 and (tick - 3) % 7 == 0 and kept[tick]]
    found: dict[int, tuple[int, float]] = {}
    for tick in range(400):
        if 150 <= tick < 200:  # nobody looks
            continue
        numbers[2] = tick in arrivals
        if tick in arrivals:
            numbers[3:] = tick
        sensed.tick(tick)
        if tick % 10 == 0:
            for data in encoder.new(sensed.read(), {"/sensors/s"}).values():
                message: Any = to_json(definition(sensor.message), data)
                stamp = message["header"]["stamp"]
                found[tick] = round(stamp["nanosec"] / 1e6), message["wrench"]["force"]["x"]
    expected = {}
    before = -1
    for tick in (t for t in range(0, 400, 10) if not 150 <= t < 200):
        last = max((t for t in arrivals if t <= tick and not (150 <= t < 200 <= tick)), default=-1)
        if last > before:
            expected[tick] = last - 3, float(last)
        before = max(before, last)
    assert found == expected
    assert len(found) > 15


def test_clients_get_what_the_log_has_and_the_session_simulates_the_same(tmp_path: Path) -> None:
    sensors = """\
sensors:
  slow: {type: imu, link: palm, rate: 50 Hz, delay: 3 ms, noise: {angular_velocity: {white: 1 deg/s}}}
  switch: {type: contact, link: palm, threshold: 1 N, rate: 100 Hz}
  eye: {type: camera, at: {xyz: [1.5, 0, 1], rpy: [0, 30 deg, 180 deg]}, resolution: [64, 48], cloud: true, rate: 20 Hz}
record: {topics: [sensors, joint_states, tf]}
"""
    wanted = ("/sensors/slow", "/sensors/switch", IMAGE, CLOUD)
    got: dict[str, list[dict[str, Any]]] = {}

    async def use(url: str) -> None:
        client = await opened(url)
        types = (await client.call("/rosapi/topics"))["values"]
        kinds = dict(zip(types["topics"], types["types"], strict=True))
        assert kinds[CLOUD] == "sensor_msgs/msg/PointCloud2"
        await client.send(op="subscribe", topic="/tf_static")
        frames = (await client.until(op="publish", topic="/tf_static"))["msg"]["transforms"]
        assert {("world", "eye"), ("eye", "eye_optical")} <= {
            (each["header"]["frame_id"], each["child_frame_id"]) for each in frames
        }
        for topic in wanted:
            await client.send(op="subscribe", topic=topic, type=kinds[topic])
        while min(len(got.get(topic, ())) for topic in wanted) < 3:
            message = await client.until(op="publish")
            got.setdefault(message["topic"], []).append(message["msg"])

    log = serving(tmp_path, use, task=SMALL + sensors)
    written: dict[str, list[dict[str, object]]] = {}
    with log.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(topics=wanted):
            assert schema is not None
            written.setdefault(channel.topic, []).append(to_json(definition(schema.name), message.data))
    for topic in wanted:
        assert all(message in written[topic] for message in got[topic]), topic
        stamps = [(m["header"]["stamp"]["sec"], m["header"]["stamp"]["nanosec"]) for m in got[topic]]
        assert stamps == sorted({*stamps})
    assert pipeline.verify_log(log).identical
