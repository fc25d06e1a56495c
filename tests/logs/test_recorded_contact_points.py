"""The contact points of a run: in the log, its snapshots and its page; and logs of format 1, which have none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.logs.replay import open_playback
from manipcli.logs.snapshot import moment
from manipcli.pipeline import judge_log, run_task
from manipcli.record.read.reading import read_recording
from manipcli.record.schemas import CONTACTS, CONTACTS_WITHOUT_POINTS, schema_text
from manipcli.replay.forces import Forces
from manipcli.report.logs.snapshot import render_text

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: rest
robot: {ROOT}/examples/04_own_robot/robot.yaml
controllers: {ROOT}/examples/04_own_robot/controllers.yaml
simulation: {{engine: pybullet}}
start: left
scene:
  table: {{box: {{size: [0.4, 0.4, 0.2]}}, pose: {{xyz: [2, 0, 0.1]}}, fixed: true}}
  block: {{box: {{size: [0.1, 0.1, 0.1]}}, rests_on: table, at: [2, 0], mass: 1 kg}}
steps:
  - wait: 0.2 s
expect:
  - contact_force: {{pair: [block, table], above: 9 N, below: 10.5 N}}
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rest")
    (folder / "rest.yaml").write_text(TASK)
    assert run_task(folder / "rest.yaml", log=folder / "rest.mcap").verdict.verdict == "passed"
    return folder / "rest.mcap"


@pytest.fixture(scope="module")
def older(log: Path, rewrite_log: Any) -> Path:
    """The same log in format 1, encoded by rosbags."""
    new, old = get_typestore(Stores.EMPTY), get_typestore(Stores.EMPTY)
    new.register(get_types_from_msg(schema_text(CONTACTS), CONTACTS))
    old.register(get_types_from_msg(CONTACTS_WITHOUT_POINTS, CONTACTS))

    def message(topic: str, one: Any) -> bytes:
        if topic != "/contacts":
            return bytes(one.data)
        taken: Any = new.deserialize_cdr(one.data, CONTACTS)
        kind = old.types["manipcli_msgs/msg/Contact"]
        pairs = [kind(c.a, c.b, c.force, c.distance) for c in taken.contacts]
        return bytes(old.serialize_cdr(old.types[CONTACTS](taken.header, pairs), CONTACTS))

    def metadata(name: str, values: dict[str, str]) -> dict[str, str]:
        return values | {"format": "1"} if name == "recording" else values

    def schema(name: str, text: bytes) -> bytes:
        return CONTACTS_WITHOUT_POINTS.encode() if name == CONTACTS else text

    path: Path = rewrite_log(log, log.with_name("old.mcap"), message=message, metadata=metadata, schema=schema)
    return path


def test_the_log_holds_the_points_of_every_contact(log: Path) -> None:
    for snapshot in read_recording(log).contacts:
        for contact in snapshot.contacts:
            assert sum(point.force for point in contact.points) == pytest.approx(contact.force, rel=1e-12)
    (contact,) = snapshot.contacts
    assert len(contact.points) == 4
    for point in contact.points:
        assert point.normal == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)
        assert point.position[2] == pytest.approx(0.2, abs=1e-3)


def test_a_log_without_points_is_read_and_judged_alike(log: Path, older: Path) -> None:
    new, old = read_recording(log), read_recording(older)
    assert [snapshot.time for snapshot in old.contacts] == [snapshot.time for snapshot in new.contacts]
    for one, other in zip(old.contacts, new.contacts, strict=True):
        assert one.contacts == tuple(contact._replace(points=()) for contact in other.contacts)
    assert judge_log(older).expectations == judge_log(log).expectations
    assert judge_log(older).verdict == "passed"


def test_a_page_draws_forces_at_the_points_or_says_that_there_are_none(log: Path, older: Path) -> None:
    new, old = open_playback(log), open_playback(older)
    assert not [note for note in new.notes if "contact" in note]
    assert [note for note in old.notes if note == "the log has no contact points: contact forces are not drawn"]
    pushes = Forces(new, new.poses()).at(len(new.times) - 1)
    assert sum(push.normal[2] for push in pushes) == pytest.approx(9.81, rel=0.01)
    nothing = Forces(old, old.poses())
    assert nothing.scale == 0.0
    assert not any(nothing.at(k) for k in range(len(old.times)))
    for ours, theirs in zip(old.curves(), new.curves(), strict=True):
        np.testing.assert_array_equal(ours.values, theirs.values)


def test_a_snapshot_shows_friction_where_it_is_known(log: Path, older: Path) -> None:
    assert "friction" in render_text(moment(log, 0.2))
    assert "friction" not in render_text(moment(older, 0.2))
    assert "9.81" in render_text(moment(older, 0.2))
