"""What the pour's log says to a reader that knows nothing of manipcli: rosbags, numpy, the URDF in the log.

Lengths in metres, z up. The cup's frame is in the middle of its bottom, the ball's at its centre, the tray's in the
middle of its bottom, as the task file puts them.
"""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import yaml
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

pytestmark = pytest.mark.slow

Array = npt.NDArray[np.float64]
ROOT = Path(__file__).parents[2]
CUP_RADIUS, CUP_HEIGHT, CUP_WALL, BALL, TRAY = 0.036, 0.110, 0.004, 0.014, (0.3, 0.3, 0.05)


@dataclass(frozen=True)
class Facts:
    """Everything on the common clock of /joint_states (T)."""

    time: Array
    joints: list[str]
    position: Array
    velocity: Array
    effort: Array
    p: dict[str, Array]  # of each object in the world (T, 3), or (3,) where it never moves
    z: dict[str, Array]  # its z axis in the world (T, 3)
    limits: dict[str, tuple[float, float, float, float]]  # lower, upper, velocity, effort


@pytest.fixture(scope="module")
def facts(pour_run: Any) -> Facts:
    assert pour_run.ran.code == 0, pour_run.ran
    reader = McapReader(pour_run.log)
    reader.open()
    store = get_typestore(Stores.EMPTY)
    types: dict[str, Any] = {}
    for connection in reader.connections:
        types.update(get_types_from_msg(connection.msgdef.data, connection.msgtype))
    store.register(types)
    wanted = [c for c in reader.connections if c.topic in ("/tf", "/tf_static", "/joint_states", "/robot_description")]
    times, rows, poses, pose_times, fixed, urdf = [], [], {}, [], {}, ""
    names: list[str] = []
    for connection, ns, raw in reader.messages(wanted):
        message: Any = store.deserialize_cdr(raw, connection.msgtype)
        if connection.topic == "/robot_description":
            urdf = message.data
        elif connection.topic == "/joint_states":
            names = list(message.name)
            assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == ns
            times.append(ns)
            rows.append((message.position, message.velocity, message.effort))
        else:
            target = poses if connection.topic == "/tf" else fixed
            if connection.topic == "/tf":
                pose_times.append(ns)
            for stamped in message.transforms:
                if stamped.header.frame_id == "world":
                    t, r = stamped.transform.translation, stamped.transform.rotation
                    target.setdefault(stamped.child_frame_id, []).append((t.x, t.y, t.z, r.x, r.y, r.z, r.w))
    reader.close()
    assert pose_times == times
    states = np.array(rows)
    moving = {name: np.array(of) for name, of in poses.items()}
    still = {name: np.array(of[0]) for name, of in fixed.items()}
    quats = {name: pose[..., 3:] for name, pose in (moving | still).items()}
    return Facts(
        time=np.array(times) * 1e-9,
        joints=names,
        position=states[:, 0],
        velocity=states[:, 1],
        effort=states[:, 2],
        p={name: pose[..., :3] for name, pose in (moving | still).items()},
        z={name: z_axis(quat) for name, quat in quats.items()},
        limits=limits_of(urdf),
    )


def z_axis(quat: Array) -> Array:
    x, y, z, w = np.moveaxis(quat, -1, 0)
    return np.stack([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)], axis=-1)


def limits_of(urdf: str) -> dict[str, tuple[float, float, float, float]]:
    found = {}
    for joint in ET.fromstring(urdf).iter("joint"):
        limit = joint.find("limit")
        if joint.get("type") in ("revolute", "prismatic") and limit is not None:
            found[str(joint.get("name"))] = tuple(
                float(limit.get(key, "nan")) for key in ("lower", "upper", "velocity", "effort")
            )
    return found  # type: ignore[return-value]


def in_cup(facts: Facts, k: int) -> bool:
    """Whether the ball's centre is between the cup's floor and its rim, and within its walls."""
    arm = facts.p["ball"][k] - facts.p["cup"][k]
    height = float(arm @ facts.z["cup"][k])
    aside = float(np.linalg.norm(arm - height * facts.z["cup"][k]))
    return 0.0 < height < CUP_HEIGHT and aside < CUP_RADIUS - CUP_WALL


def test_the_ball_is_in_the_cup_at_the_start_and_not_at_the_end(facts: Facts) -> None:
    assert in_cup(facts, 0)
    assert not in_cup(facts, -1)


def test_the_cup_is_lifted_with_the_ball_in_it_and_tilted_past_90_degrees(facts: Facts) -> None:
    cup = facts.p["cup"]
    lifted = np.flatnonzero(cup[:, 2] > cup[0, 2] + 0.05)
    assert lifted.size > 0
    assert in_cup(facts, int(lifted[0]))
    tilted = np.flatnonzero(facts.z["cup"][:, 2] < 0.0)
    assert tilted.size > 0
    assert lifted[0] < tilted[0]


def test_the_ball_comes_to_rest_in_the_tray(facts: Facts) -> None:
    """Inside the tray's walls, on its floor; below 1 mm/s in the last half second, by differences of positions."""
    ball = facts.p["ball"][-1] - facts.p["tray"]
    assert abs(ball[0]) < TRAY[0] / 2 - BALL
    assert abs(ball[1]) < TRAY[1] / 2 - BALL
    assert 0.0 < ball[2] < TRAY[2]
    late = facts.time >= facts.time[-1] - 0.5
    travelled = np.linalg.norm(np.diff(facts.p["ball"][late], axis=0), axis=1)
    # Over windows of 50 ms, so that a buzz of the contact solver below a micrometre is no speed.
    windows = np.convolve(travelled, np.ones(50), mode="valid") / (50 * 1e-3)
    assert windows.max() < 1e-3


def test_the_cup_stands_upright_where_it_stood(facts: Facts) -> None:
    assert math.degrees(math.acos(min(1.0, facts.z["cup"][-1, 2]))) < 5.0
    assert np.linalg.norm(facts.p["cup"][-1] - facts.p["cup"][0]) < 0.02


def test_the_arm_is_at_home_in_time(facts: Facts) -> None:
    robot = yaml.safe_load((ROOT / "robots" / "arm7_hand3" / "robot.yaml").read_text())
    arm = [facts.joints.index(f"joint_{k}") for k in range(1, 8)]
    np.testing.assert_allclose(facts.position[-1, arm], robot["poses"]["home"]["arm"], atol=0.02)
    assert facts.time[-1] < 60.0


def test_no_joint_goes_beyond_its_limits(facts: Facts) -> None:
    """0.01 rad of position, 5 % of velocity; the effort limit is kept to the digit."""
    for k, name in enumerate(facts.joints):
        lower, upper, velocity, effort = facts.limits[name]
        assert facts.position[:, k].min() > lower - 0.01, name
        assert facts.position[:, k].max() < upper + 0.01, name
        worst = int(np.abs(facts.velocity[:, k]).argmax())
        assert abs(facts.velocity[worst, k]) <= 1.05 * velocity, (name, facts.time[worst])
        assert np.abs(facts.effort[:, k]).max() <= effort * (1 + 1e-9), name


def test_joints_move_by_their_velocities(facts: Facts) -> None:
    """No teleporting: every change of position is velocity times time, from tick to tick and over the whole run."""
    step = np.diff(facts.time)[:, None]
    np.testing.assert_allclose(step, 1e-3, atol=1e-9)
    change = np.diff(facts.position, axis=0)
    np.testing.assert_allclose(change, facts.velocity[1:] * step, atol=2e-5)
    drift = facts.position[0] + np.cumsum(facts.velocity[1:] * step, axis=0) - facts.position[1:]
    assert np.abs(drift).max() < 0.01


def test_objects_never_jump(facts: Facts) -> None:
    """A cup carried at arm's length and a ball that falls half a metre stay below 4 m/s; g bounds a free fall."""
    for name in ("cup", "ball"):
        moved = np.diff(facts.p[name], axis=0)
        speed = np.linalg.norm(moved, axis=1) / 1e-3
        assert speed.max() < 4.0, name
        turned = np.degrees(np.arccos(np.clip(np.sum(facts.z[name][1:] * facts.z[name][:-1], axis=1), -1.0, 1.0)))
        if name == "cup":
            assert turned.max() < 1.0


def test_the_printed_object_agrees_with_the_log(facts: Facts, pour_run: Any) -> None:
    answer = json.loads(pour_run.ran.out)
    assert answer["verdict"] == "passed"
    assert answer["simulated_time"] == pytest.approx(facts.time[-1], abs=2e-3)
    assert [step["outcome"] for step in answer["steps"]] == ["done"] * len(answer["steps"])
