"""Wrenches are recorded at every tick in their own frame; what publishes nothing leaves no trace."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.control.controller import ControllerOutput
from manipcli.model.state import WorldState
from manipcli.record.channels import ControllerChannel, SensorChannel
from manipcli.record.read.reading import read_recording
from manipcli.record.schemas import WRENCH

ARM = ControllerChannel("arm", ("shoulder", "slide"))
HAND = ControllerChannel("hand", ("spin",), interfaces=("position",))
T = 605


def test_wrenches_stand_among_the_controllers(tmp_path: Path, make_run: Callable[[int], Any]) -> None:
    run = make_run(T)
    path = tmp_path / "run.mcap"
    recorder = run.recorder(path, controllers=(ARM, None, SensorChannel("sensor", "wrench", WRENCH, "wheel", 6), HAND))
    wrenches = np.random.default_rng(1).normal(size=(T, 6))
    s = run.states
    for k in range(T):
        arm, hand = run.outputs_at(k)
        wrench = ControllerOutput.published(6)
        wrench.rows[0] = wrenches[k]
        none = np.zeros((2, 3))
        one = [a[k] for a in (s.time, s.position, s.velocity, s.effort, s.body_position, s.body_quat_xyzw)]
        active = None if k == 7 else wrench
        recorder.tick(k, WorldState(*one, none, none), [arm, ControllerOutput.published(0), active, hand])
    recorder.finish({})
    active_at = [k for k in range(T) if k != 7]

    store = get_typestore(Stores.EMPTY)
    found = []
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(["/sensor/wrench"]):
            assert (schema.name, channel.message_encoding) == ("geometry_msgs/msg/WrenchStamped", "cdr")
            if not found:
                store.register(get_types_from_msg(schema.data.decode(), schema.name))
            found.append((message.log_time, store.deserialize_cdr(message.data, schema.name)))
    assert [time for time, _ in found] == [k * 1_000_000 for k in active_at]
    assert {m.header.frame_id for _, m in found} == {"wheel"}
    assert [m.header.stamp.nanosec for _, m in found] == [k * 1_000_000 for k in active_at]
    values = [
        [*(getattr(part, axis) for part in (m.wrench.force, m.wrench.torque) for axis in "xyz")] for _, m in found
    ]
    np.testing.assert_array_equal(values, wrenches[active_at])

    read = read_recording(path).whole()
    assert [trace.name for trace in read.controllers] == ["arm", "hand"]
    np.testing.assert_array_equal(read.controllers[1].reference_position, run.outputs[1][0])
